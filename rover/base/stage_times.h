#pragma once

#include <string>
#include <utility>
#include <vector>

#include "rover/base/stopwatch.h"

namespace rover {

// How long the stages of one frame or keyframe took, in the order in which they ran; ms.
using StageTimes = std::vector<std::pair<std::string, double>>;

// Fills a StageTimes: each call of done() names the stage that has just ended.
class StageTimer {
 public:
  explicit StageTimer(StageTimes& times) : times_(times) {}
  void done(std::string stage) { times_.emplace_back(std::move(stage), watch_.lap_ms()); }

 private:
  StageTimes& times_;
  Stopwatch watch_;
};

}  // namespace rover
