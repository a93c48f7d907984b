#include "rover/slam/mapping_worker.h"

namespace rover {

MappingWorker::MappingWorker(LocalMapper mapper, Execution execution, int queue_capacity)
    : mapper_(std::move(mapper)),
      concurrent_(execution == Execution::kConcurrent),
      queue_(static_cast<std::size_t>(queue_capacity)) {
  if (concurrent_) thread_ = std::thread([this] { work(); });
}

MappingWorker::~MappingWorker() {
  queue_.close();
  if (thread_.joinable()) thread_.join();
}

void MappingWorker::submit(std::shared_ptr<SharedMap> map, KeyframeId keyframe, FrameId frame) {
  Task task{std::move(map), keyframe, frame};
  if (!concurrent_) {
    process(task);
    return;
  }
  rethrow();
  {
    std::lock_guard lock(mutex_);
    ++pending_;
  }
  queue_.push(std::move(task));
}

void MappingWorker::finish() {
  std::unique_lock lock(mutex_);
  idle_.wait(lock, [&] { return pending_ == 0; });
  lock.unlock();
  rethrow();
}

std::vector<MappingRecord> MappingWorker::take_records() {
  std::lock_guard lock(mutex_);
  return std::move(records_);
}

void MappingWorker::work() {
  while (auto task = queue_.pop()) {
    std::exception_ptr error;
    try {
      process(*task);
    } catch (...) {
      error = std::current_exception();  // handed to the caller of the next submit() or finish()
    }
    std::lock_guard lock(mutex_);
    if (error && !error_) error_ = error;
    --pending_;
    idle_.notify_all();
  }
}

void MappingWorker::process(const Task& task) {
  std::function<bool()> hurry;
  if (concurrent_) hurry = [this] { return queue_.size() > 0; };
  MappingRecord record;
  record.keyframe = task.keyframe;
  record.frame = task.frame;
  record.time = task.map->view()->at(task.keyframe).frame.time;
  record.report = mapper_.process(*task.map, task.keyframe, hurry);
  record.lag_frames = static_cast<int>(current_frame_ - task.frame.value);
  std::lock_guard lock(mutex_);
  records_.push_back(std::move(record));
}

void MappingWorker::rethrow() {
  std::lock_guard lock(mutex_);
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

}  // namespace rover
