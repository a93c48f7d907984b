#include "rover/datasets/imu_file.h"

#include <array>

#include "rover/datasets/text_rows.h"

namespace rover {
namespace {

ImuSample parse_imu_row(const TextRow& row) {
  require_fields(row, 7);
  std::array<double, 6> v{};
  for (std::size_t i = 0; i < v.size(); ++i) v[i] = parse_number(row.fields[i + 1]);
  return {parse_nanoseconds_field(row.fields[0]), {v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
}

}  // namespace

std::vector<ImuSample> read_imu_file(const std::filesystem::path& file,
                                     std::vector<std::string>* notes) {
  return read_timed_rows<ImuSample>(file, ',', parse_imu_row, notes);
}

}  // namespace rover
