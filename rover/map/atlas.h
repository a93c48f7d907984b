#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "rover/map/shared_map.h"

namespace rover {

// All maps of a session. A new one is begun when tracking is lost for good; none is thrown away.
class Atlas {
 public:
  explicit Atlas(std::shared_ptr<const Rig> rig)
      : rig_(std::move(rig)), ids_(std::make_shared<IdSource>()) {}

  // What later maps begin with: a calibration that one map has found holds for the next.
  void set_calibration(std::shared_ptr<const Rig> rig, const CalibrationStatus& calibration) {
    std::lock_guard lock(mutex_);
    rig_ = std::move(rig);
    calibration_ = calibration;
    calibration_.estimated = 0;
  }

  // Adds an empty map.
  std::shared_ptr<SharedMap> begin_map() {
    auto map = std::make_shared<SharedMap>(blank_map());
    add_map(map);
    return map;
  }

  // An empty map that is not yet part of the atlas, for a beginning that may fail; its id is the
  // one it will have. Only one at a time.
  Map blank_map() const {
    std::lock_guard lock(mutex_);
    Map map(MapId{static_cast<std::int64_t>(maps_.size())}, rig_, ids_);
    map.set_calibration(calibration_);
    return map;
  }
  void add_map(std::shared_ptr<SharedMap> map) {
    std::lock_guard lock(mutex_);
    maps_.push_back(std::move(map));
  }

  // In order of creation; MapId i is element i.
  std::vector<std::shared_ptr<SharedMap>> maps() const {
    std::lock_guard lock(mutex_);
    return maps_;
  }

 private:
  std::shared_ptr<const Rig> rig_;
  CalibrationStatus calibration_;
  std::shared_ptr<IdSource> ids_;
  mutable std::mutex mutex_;
  std::vector<std::shared_ptr<SharedMap>> maps_;
};

}  // namespace rover
