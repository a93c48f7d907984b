#include "rover/datasets/trajectory.h"

#include <array>

#include <fmt/format.h>

#include "rover/base/error.h"
#include "rover/datasets/atomic_file.h"
#include "rover/datasets/text_rows.h"

namespace rover {
namespace {

std::array<double, 7> pose_numbers(const TextRow& row) {
  require_fields(row, 8);
  std::array<double, 7> v{};
  for (std::size_t i = 0; i < v.size(); ++i) v[i] = parse_number(row.fields[i + 1]);
  return v;
}

StampedPose parse_tum_row(const TextRow& row) {
  const auto v = pose_numbers(row);
  return {parse_seconds_field(row.fields[0]),
          {checked_quaternion(v[6], v[3], v[4], v[5]), Eigen::Vector3d(v[0], v[1], v[2])}};
}

StampedPose parse_euroc_row(const TextRow& row) {
  const auto v = pose_numbers(row);
  return {parse_nanoseconds_field(row.fields[0]),
          {checked_quaternion(v[3], v[4], v[5], v[6]), Eigen::Vector3d(v[0], v[1], v[2])}};
}

}  // namespace

Trajectory read_tum_trajectory(const std::filesystem::path& file, std::vector<std::string>* notes) {
  return read_timed_rows<StampedPose>(file, ' ', parse_tum_row, notes);
}

Trajectory read_euroc_trajectory(const std::filesystem::path& file,
                                 std::vector<std::string>* notes) {
  return read_timed_rows<StampedPose>(file, ',', parse_euroc_row, notes);
}

Trajectory read_trajectory(const std::filesystem::path& file, std::vector<std::string>* notes) {
  const auto name = file.extension() == ".gz" ? file.stem() : file.filename();
  return name.extension() == ".csv" ? read_euroc_trajectory(file, notes)
                                    : read_tum_trajectory(file, notes);
}

std::string format_tum_trajectory(const Trajectory& trajectory) {
  std::string text;
  for (const auto& [time, pose] : trajectory) {
    const auto& t = pose.translation;
    const auto& q = pose.rotation;
    text += fmt::format("{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                        format_seconds(time), t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

void write_tum_trajectory(const std::filesystem::path& file, const Trajectory& trajectory) {
  write_file_atomically(file, format_tum_trajectory(trajectory));
}

Trajectory move_frame(const Trajectory& trajectory, const SE3& frame_from_other) {
  Trajectory moved = trajectory;
  for (StampedPose& stamped : moved) stamped.pose = stamped.pose * frame_from_other;
  return moved;
}

}  // namespace rover
