#include "rover/tracking/live_pose.h"

#include <cmath>

#include "rover/base/error.h"

namespace rover {
namespace {

// The pose moved on, with a share of what it is then off by.
SE3 corrected(const SE3& moved, const SE3& sought, double share) {
  return share < 1 ? se3_plus(moved, share * se3_minus(sought, moved)) : sought;
}

}  // namespace

void LivePoseOptions::check() const {
  require(settling_time >= 0 && settling_time < 60,
          "live.settling_time is {}; use 0 s (at once) to 60 s", settling_time);
}

LivePose LivePoseFilter::follow(const TrackingResult& result, const std::optional<SE3>& felt) {
  begin_odometry(result);
  Given given{result.anchored.time,
              result.anchored.map,
              result.epoch,
              {result.world_from_body, odometry_},
              odometry_};
  if (last_) {
    const double part = felt ? share(*last_, given.time) : 1;
    const SE3 motion = felt.value_or(result.last_from_body);
    given.odometry_sought = last_->odometry_sought * result.last_from_body;
    given.pose.odometry_from_body =
        corrected(last_->pose.odometry_from_body * motion, given.odometry_sought, part);
    if (given.map == last_->map && given.epoch == last_->epoch) {
      given.pose.world_from_body =
          corrected(last_->pose.world_from_body * motion, result.world_from_body, part);
    }
  }
  odometry_ = given.pose.odometry_from_body;
  last_ = given;
  return given.pose;
}

double LivePoseFilter::share(const Given& last, Timestamp now) const {
  if (options_.settling_time == 0) return 1;
  return 1 - std::exp(-seconds_between(last.time, now) / options_.settling_time);
}

// With the first pose that is metric (and upright, with inertial data); until then it is the map's.
void LivePoseFilter::begin_odometry(const TrackingResult& result) {
  if (odometry_begun_) return;
  odometry_ = result.world_from_body;
  odometry_begun_ = result.metric;
  last_.reset();
}

}  // namespace rover
