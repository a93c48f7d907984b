#pragma once

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace rover {

// Runs loops in a fixed number of equal parts, so that results do not depend on timing. Parts run
// on the pool's threads and on the caller's; a pool of one thread runs everything in the caller.
// Calls from several threads at once are served one after the other; a call from inside a part
// runs inline.
class ThreadPool {
 public:
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int threads() const { return static_cast<int>(workers_.size()) + 1; }

  // Calls body(begin, end) for consecutive parts of [0, count): one part per thread. The first
  // exception thrown by a part is thrown again here, after all parts have ended.
  void parallel_for(std::size_t count, const std::function<void(std::size_t, std::size_t)>& body);

 private:
  struct Job;
  void work(int index);

  std::mutex callers_;
  std::mutex mutex_;
  std::condition_variable changed_;
  Job* job_ = nullptr;
  std::size_t generation_ = 0;
  bool stopping_ = false;
  std::vector<std::thread> workers_;
};

}  // namespace rover
