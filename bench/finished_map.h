#pragma once

#include <limits>
#include <memory>

#include "rover/base/error.h"
#include "rover/datasets/dataset.h"
#include "rover/slam/system.h"

namespace rover {

// Offers a dataset's frames and readings, up to the stamp `last`. A frame is offered before the
// next one's readings, as in a run.
inline void run_through(System& system, Dataset& dataset,
                        Timestamp last = std::numeric_limits<Timestamp>::max()) {
  while (const auto frame = dataset.next()) {
    if (frame->time > last) break;
    for (const ImuSample& sample : frame->imu) system.add_imu(sample);
    if (!frame->usable()) continue;
    const cv::Mat right = frame->images.size() > 1 ? frame->images[1] : cv::Mat();
    system.add_images(frame->time, frame->images[0], right);
  }
  system.finish();
}

// The map with most frames, as it is now.
inline std::shared_ptr<const Map> largest_map_of(const System& system) {
  const auto largest = system.largest_map();
  require(largest.has_value(), "no map was begun; use a longer sequence");
  return system.maps()[static_cast<std::size_t>(largest->value)];
}

}  // namespace rover
