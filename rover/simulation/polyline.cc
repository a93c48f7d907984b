#include "rover/simulation/polyline.h"

#include <algorithm>
#include <cmath>

namespace rover {

Polyline::Polyline(std::vector<Eigen::Vector3d> points, bool closed)
    : points_(std::move(points)), starts_{0}, closed_(closed) {
  if (closed_ && points_.front() != points_.back()) points_.push_back(points_.front());
  for (std::size_t i = 1; i < points_.size(); ++i) {
    starts_.push_back(starts_.back() + (points_[i] - points_[i - 1]).norm());
  }
}

Eigen::Vector3d Polyline::at(double distance) const {
  if (closed_) distance -= std::floor(distance / length()) * length();
  const auto after = std::upper_bound(starts_.begin() + 1, starts_.end() - 1, distance);
  const auto i = static_cast<std::size_t>(after - starts_.begin());
  const double share = (distance - starts_[i - 1]) / (starts_[i] - starts_[i - 1]);
  return points_[i - 1] + share * (points_[i] - points_[i - 1]);
}

}  // namespace rover
