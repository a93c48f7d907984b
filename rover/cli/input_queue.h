#pragma once

#include <deque>
#include <optional>
#include <utility>

#include "rover/datasets/dataset.h"

namespace rover {

// A frame, and whether its readings were given already.
struct PendingFrame {
  SensorFrame frame;
  bool given = false;
};

// The frames of a dataset, some of them ahead: where the inertial sensor's clock is ahead of the
// cameras', a frame waits for readings that come with later ones.
class InputQueue {
 public:
  explicit InputQueue(Dataset& dataset) : dataset_(dataset) {}

  // Whether so many frames are left; they are in memory then.
  bool read_ahead(std::size_t frames) {
    while (frames_.size() < frames) {
      auto frame = dataset_.next();
      if (!frame) return false;
      frames_.push_back({std::move(*frame)});
    }
    return true;
  }

  PendingFrame pop() {
    PendingFrame first = std::move(frames_.front());
    frames_.pop_front();
    return first;
  }
  std::optional<Timestamp> next_time() const {
    return frames_.empty() ? std::nullopt : std::optional(frames_.front().frame.time);
  }

  // give(reading) for those of a frame and of the ones after it, up to the first frame at or after
  // `until`; each once.
  template <class Give>
  void give_readings(PendingFrame& pending, Timestamp until, const Give& give) {
    give_once(pending, give);
    Timestamp reached = pending.frame.time;
    for (std::size_t i = 0; reached < until && read_ahead(i + 1); ++i) {
      give_once(frames_[i], give);
      reached = frames_[i].frame.time;
    }
  }

 private:
  template <class Give>
  static void give_once(PendingFrame& pending, const Give& give) {
    if (std::exchange(pending.given, true)) return;
    for (const ImuSample& sample : pending.frame.imu) give(sample);
  }

  Dataset& dataset_;
  std::deque<PendingFrame> frames_;
};

}  // namespace rover
