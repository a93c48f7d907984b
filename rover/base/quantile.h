#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace rover {

// The value that the share q (0 to 1) of all values does not exceed, without interpolation; 0 for
// none.
template <class T>
T quantile(std::vector<T> values, double q) {
  if (values.empty()) return T{};
  const auto index = static_cast<std::size_t>(q * static_cast<double>(values.size() - 1) + 0.5);
  const auto position = values.begin() + static_cast<std::ptrdiff_t>(index);
  std::nth_element(values.begin(), position, values.end());
  return *position;
}

template <class T>
T median(std::vector<T> values) {
  return quantile(std::move(values), 0.5);
}

}  // namespace rover
