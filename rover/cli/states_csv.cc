#include "rover/cli/states_csv.h"

#include <cmath>

#include <fmt/format.h>

namespace rover {

std::string states_csv(const std::vector<StateRecord>& states) {
  std::string text = "time";
  for (const char* prefix : {"", "sigma_"}) {
    for (const char* quantity : {"v", "bg", "ba"}) {
      for (const char axis : {'x', 'y', 'z'})
        text += fmt::format(",{}{}{}", prefix, quantity, axis);
    }
  }
  text += '\n';
  for (const auto& [time, state, covariance] : states) {
    text += format_seconds(time);
    for (const double v : state.velocity) text += fmt::format(",{:.6f}", v);
    for (const double b : state.bias.vector()) text += fmt::format(",{:.7f}", b);
    for (int i = 6; i < 15; ++i) text += fmt::format(",{:.3e}", std::sqrt(covariance(i, i)));
    text += '\n';
  }
  return text;
}

}  // namespace rover
