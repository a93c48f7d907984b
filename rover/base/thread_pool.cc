#include "rover/base/thread_pool.h"

#include <exception>

namespace rover {

struct ThreadPool::Job {
  std::size_t count;
  std::size_t parts;
  const std::function<void(std::size_t, std::size_t)>& body;
  std::size_t pending;
  std::exception_ptr error = nullptr;

  void run(std::size_t part) const {
    const std::size_t begin = count * part / parts;
    const std::size_t end = count * (part + 1) / parts;
    if (begin < end) body(begin, end);
  }
};

namespace {
thread_local bool inside_part = false;
}  // namespace

ThreadPool::ThreadPool(int threads) {
  for (int i = 1; i < threads; ++i) workers_.emplace_back([this, i] { work(i); });
}

ThreadPool::~ThreadPool() {
  {
    std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  for (auto& worker : workers_) worker.join();
}

void ThreadPool::parallel_for(std::size_t count,
                              const std::function<void(std::size_t, std::size_t)>& body) {
  if (workers_.empty() || count <= 1 || inside_part) {
    if (count > 0) body(0, count);
    return;
  }
  std::lock_guard caller(callers_);
  Job job{count, workers_.size() + 1, body, workers_.size()};
  {
    std::lock_guard lock(mutex_);
    job_ = &job;
    ++generation_;
  }
  changed_.notify_all();
  std::exception_ptr own_error;
  inside_part = true;
  try {
    job.run(0);
  } catch (...) {
    own_error = std::current_exception();
  }
  inside_part = false;
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return job.pending == 0; });
  job_ = nullptr;
  if (own_error) std::rethrow_exception(own_error);
  if (job.error) std::rethrow_exception(job.error);
}

void ThreadPool::work(int index) {
  inside_part = true;
  std::size_t seen = 0;
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return stopping_ || generation_ != seen; });
    if (stopping_) return;
    seen = generation_;
    Job& job = *job_;
    lock.unlock();
    std::exception_ptr error;
    try {
      job.run(static_cast<std::size_t>(index));
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    if (error && !job.error) job.error = error;
    if (--job.pending == 0) changed_.notify_all();
  }
}

}  // namespace rover
