#include "rover/map/feature_choice.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace rover {

// Features are ordered by score, so a stable partition keeps the best of either kind in front.
std::vector<int> choose_features(const Frame& frame, double share, Prefer preferred) {
  std::vector<int> rows(static_cast<std::size_t>(frame.size()));
  std::iota(rows.begin(), rows.end(), 0);
  const bool with_landmark = preferred == Prefer::kWithLandmark;
  std::stable_partition(rows.begin(), rows.end(),
                        [&](int row) { return frame[row].landmark.valid() == with_landmark; });
  rows.resize(static_cast<std::size_t>(std::ceil(share * frame.size())));
  std::sort(rows.begin(), rows.end());
  return rows;
}

}  // namespace rover
