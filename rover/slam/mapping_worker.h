#pragma once

#include <atomic>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "rover/base/bounded_queue.h"
#include "rover/map/shared_map.h"
#include "rover/slam/system.h"

namespace rover {

// Runs the mapping stage: inline in lockstep, on a thread of its own in concurrent execution. The
// same LocalMapper serves both.
class MappingWorker {
 public:
  MappingWorker(LocalMapper mapper, Execution execution, int queue_capacity);
  ~MappingWorker();

  // Maps a keyframe (lockstep) or queues it (concurrent; waits while the queue is full). Throws
  // what the mapping of an earlier keyframe threw.
  void submit(std::shared_ptr<SharedMap> map, KeyframeId keyframe, FrameId frame);

  // Waits until nothing is queued or under way.
  void finish();

  // The frame being tracked, for the lag.
  void set_current_frame(FrameId frame) { current_frame_ = frame.value; }
  std::vector<MappingRecord> take_records();

 private:
  struct Task {
    std::shared_ptr<SharedMap> map;
    KeyframeId keyframe;
    FrameId frame;
  };
  void work();
  void process(const Task& task);
  void rethrow();

  LocalMapper mapper_;
  const bool concurrent_;
  BoundedQueue<Task> queue_;
  std::atomic<std::int64_t> current_frame_ = 0;
  std::mutex mutex_;
  std::condition_variable idle_;
  int pending_ = 0;
  std::vector<MappingRecord> records_;
  std::exception_ptr error_;
  std::thread thread_;
};

}  // namespace rover
