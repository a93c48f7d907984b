#include "rover/map/cow_table.h"

#include <map>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "rover/base/random.h"

namespace rover {
namespace {

using Table = CowTable<LandmarkId, int>;

TEST(CowTable, BehavesLikeAMapUnderRandomEdits) {
  Random random(3);
  Table table;
  std::map<LandmarkId, int> reference;
  for (int step = 0; step < 20000; ++step) {
    const LandmarkId id{random.index(500)};
    if (random.uniform() < 0.5) {
      table.insert(id, step);
      reference[id] = step;
    } else if (random.uniform() < 0.5) {
      table.erase(id);
      reference.erase(id);
    } else if (table.contains(id)) {
      table.edit(id) = -step;
      reference[id] = -step;
    }
    if (random.uniform() < 0.01) table.freeze();
  }
  ASSERT_EQ(table.size(), reference.size());
  auto expected = reference.begin();
  for (const int value : table) EXPECT_EQ(value, (expected++)->second);
  EXPECT_EQ(table.find(LandmarkId{-1}), nullptr);
  EXPECT_EQ(table.find(LandmarkId{100000}), nullptr);
}

TEST(CowTable, CopiesKeepTheirValues) {
  Random random(4);
  Table table;
  std::vector<std::pair<Table, std::map<std::int64_t, int>>> snapshots;
  std::map<std::int64_t, int> now;
  for (int step = 0; step < 3000; ++step) {
    const LandmarkId id{random.index(300)};
    if (now.contains(id.value) && random.uniform() < 0.2) {
      table.erase(id);
      now.erase(id.value);
    } else if (now.contains(id.value)) {
      table.edit(id) = step;
      now[id.value] = step;
    } else {
      table.insert(id, step);
      now[id.value] = step;
    }
    if (step % 100 == 0) {
      snapshots.emplace_back(table, now);
      table.freeze();
    }
  }
  for (const auto& [snapshot, values] : snapshots) {
    EXPECT_EQ(snapshot.size(), values.size());
    for (const auto& [id, value] : values) EXPECT_EQ(snapshot.at({id}), value);
  }
}

TEST(CowTable, ReadersOfACopyDoNotRaceWithTheWriter) {
  Table table;
  for (int i = 0; i < 1000; ++i) table.insert({i}, i);
  const Table copy = table;
  table.freeze();
  std::thread reader([&copy] {
    for (int round = 0; round < 50; ++round) {
      int sum = 0;
      for (const int value : copy) sum += value;
      EXPECT_EQ(sum, 999 * 1000 / 2);
    }
  });
  for (int round = 0; round < 50; ++round) {
    for (int i = 0; i < 1000; ++i) table.edit({i}) += 1;
  }
  reader.join();
}

}  // namespace
}  // namespace rover
