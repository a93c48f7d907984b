#include <atomic>
#include <numeric>
#include <thread>

#include <gtest/gtest.h>

#include "rover/base/bounded_queue.h"
#include "rover/base/error.h"
#include "rover/base/random.h"
#include "rover/base/thread_pool.h"

namespace rover {
namespace {

TEST(ThreadPool, CoversEveryIndexOnceWithFixedParts) {
  for (int threads : {1, 2, 3, 8}) {
    ThreadPool pool(threads);
    for (std::size_t count : {0, 1, 2, 7, 1000}) {
      std::vector<int> visits(count, 0);
      pool.parallel_for(count, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) ++visits[i];
      });
      EXPECT_EQ(std::accumulate(visits.begin(), visits.end(), 0), static_cast<int>(count));
      for (int visit : visits) EXPECT_EQ(visit, 1);
    }
  }
}

TEST(ThreadPool, PassesExceptionsOnAndGoesOn) {
  ThreadPool pool(2);
  const auto fail = [](std::size_t, std::size_t) { throw InputError("no"); };
  EXPECT_THROW(pool.parallel_for(10, fail), InputError);
  std::atomic<int> sum = 0;
  pool.parallel_for(10, [&](std::size_t begin, std::size_t end) {
    sum += static_cast<int>(end - begin);
    pool.parallel_for(2, [&](std::size_t, std::size_t) {});  // inline, no deadlock
  });
  EXPECT_EQ(sum, 10);
}

TEST(BoundedQueue, HandsOverInOrderAndDrainsAfterClose) {
  BoundedQueue<int> queue(2);
  std::thread producer([&] {
    for (int i = 0; i < 100; ++i) EXPECT_TRUE(queue.push(i));
    queue.close();
  });
  for (int i = 0; i < 100; ++i) {
    EXPECT_LE(queue.size(), 2u);
    EXPECT_EQ(queue.pop(), i);
  }
  EXPECT_EQ(queue.pop(), std::nullopt);
  EXPECT_FALSE(queue.push(1));
  producer.join();
}

TEST(Random, HasTheMomentsItClaims) {
  Random random(1);
  double mean = 0, square = 0;
  constexpr int kCount = 100000;
  for (int i = 0; i < kCount; ++i) {
    const double x = random.gaussian();
    mean += x / kCount;
    square += x * x / kCount;
    const int index = random.index(3);
    ASSERT_TRUE(index >= 0 && index < 3);
  }
  EXPECT_NEAR(mean, 0, 0.02);
  EXPECT_NEAR(square, 1, 0.02);
}

TEST(Random, SeedsDifferByPurpose) {
  EXPECT_NE(hash_seed(1, 2, 3), hash_seed(1, 3, 2));
  EXPECT_NE(hash_seed(1, 2, 3), hash_seed(2, 2, 3));
  EXPECT_EQ(hash_seed(1, 2, 3), hash_seed(1, 2, 3));
}

TEST(Error, SaysWhatItIsTold) {
  EXPECT_NO_THROW(require(true, "never"));
  try {
    require(false, "{}: {} is wrong", "file", 3);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "file: 3 is wrong");
  }
}

}  // namespace
}  // namespace rover
