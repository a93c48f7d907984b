#include "rover/simulation/scene.h"

#include <cmath>

namespace rover {

SE3 MovingObject::world_from_object(double seconds) const {
  const double angle = phase + angular_speed * seconds;
  const Eigen::Vector3d offset(radius * std::cos(angle), radius * std::sin(angle), 0);
  return {so3_exp(Eigen::Vector3d(0, 0, angle)), centre + offset};
}

}  // namespace rover
