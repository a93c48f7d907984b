#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/imgcodecs.hpp>

#include "rover/camera/calibration_file.h"

// Real image pairs with ground truth, for tests and benchmarks of matching. The folders lie beside
// the project (shared/data) and may be absent.
namespace rover::real_pairs {

inline std::filesystem::path data_folder() {
  return std::filesystem::path(ROVER_SOURCE_DIR) / "../shared/data";
}

struct Frame {
  std::filesystem::path left, right;
  SE3 world_from_body;

  cv::Mat left_image() const { return cv::imread(left.string(), cv::IMREAD_GRAYSCALE); }
  cv::Mat right_image() const { return cv::imread(right.string(), cv::IMREAD_GRAYSCALE); }
};

struct Sequence {
  Rig rig;
  std::vector<Frame> frames;  // in order of time; empty if the folder is absent

  SE3 world_from_camera(int frame, int camera = 0) const {
    return frames[frame].world_from_body * rig.body_from_camera[camera];
  }
  // b's left camera from a's.
  SE3 relative_pose(int a, int b) const {
    return world_from_camera(b).inverse() * world_from_camera(a);
  }
};

inline std::vector<std::filesystem::path> sorted_files(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  if (!std::filesystem::is_directory(folder)) return files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// Rows of "time,px,py,pz,qw,qx,qy,qz,...".
inline std::map<std::int64_t, SE3> read_euroc_poses(const std::filesystem::path& file) {
  std::map<std::int64_t, SE3> poses;
  std::ifstream stream(file);
  std::string line;
  while (std::getline(stream, line)) {
    if (line.empty() || line[0] == '#') continue;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream row(line);
    std::int64_t time = 0;
    Eigen::Vector3d p;
    Eigen::Quaterniond q;
    row >> time >> p.x() >> p.y() >> p.z() >> q.w() >> q.x() >> q.y() >> q.z();
    poses[time] = SE3(q.normalized(), p);
  }
  return poses;
}

// EuRoC V1_01_easy, stereo pairs spread over the flight, raw images. Frames without a pose within
// 2 ms are left out.
inline Sequence euroc() {
  Sequence sequence;
  const auto folder = data_folder() / "euroc/V1_01_sparse_stereo/mav0";
  if (!std::filesystem::is_directory(folder)) return sequence;
  sequence.rig = read_calibration({folder / "cam0/sensor.yaml", folder / "cam1/sensor.yaml"}).rig;
  const auto poses = read_euroc_poses(folder / "state_groundtruth_estimate0/data.csv");
  for (const auto& left : sorted_files(folder / "cam0/data")) {
    const std::int64_t time = std::stoll(left.stem().string());
    const auto pose = poses.lower_bound(time - 2'000'000);
    if (pose == poses.end() || pose->first > time + 2'000'000) continue;
    sequence.frames.push_back({left, folder / "cam1/data" / left.filename(), pose->second});
  }
  return sequence;
}

// KITTI odometry 00, the first 201 pairs, rectified.
inline Sequence kitti() {
  Sequence sequence;
  const auto folder = data_folder() / "kitti/00_first201";
  std::ifstream poses(folder / "poses.txt");
  const Camera camera(CameraModel::kPinhole, 1241, 376, {718.856, 718.856, 607.1928, 185.2157}, {});
  sequence.rig.cameras = {camera, camera};
  sequence.rig.body_from_camera = {
      SE3(), SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(386.1448 / 718.856, 0, 0))};
  for (const auto& left : sorted_files(folder / "image_0")) {
    Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
    for (int i = 0; i < 12; ++i) poses >> pose(i / 4, i % 4);
    sequence.frames.push_back({left, folder / "image_1" / left.filename(), SE3::from_matrix(pose)});
  }
  return sequence;
}

// Pairs of frames of a sequence whose left cameras are this far apart, spread evenly over all such
// pairs; at most `count`.
struct PairLimits {
  double min_degrees = 12, max_degrees = 45;
  double min_metres = 0.4, max_metres = 2;
};

inline std::vector<std::pair<int, int>> wide_pairs(const Sequence& sequence, int count,
                                                   const PairLimits& limits = {}) {
  std::vector<std::pair<int, int>> all, chosen;
  const int frames = static_cast<int>(sequence.frames.size());
  for (int a = 0; a < frames; ++a) {
    for (int b = a + 1; b < frames; ++b) {
      const SE3 pose = sequence.relative_pose(a, b);
      const double metres = pose.translation.norm();
      const double degrees =
          Eigen::AngleAxisd(pose.rotation_matrix()).angle() * 180 / 3.14159265358979;
      if (degrees >= limits.min_degrees && degrees <= limits.max_degrees &&
          metres >= limits.min_metres && metres <= limits.max_metres) {
        all.emplace_back(a, b);
      }
    }
  }
  const int size = static_cast<int>(all.size());
  for (int i = 0; i < std::min(count, size); ++i) {
    chosen.push_back(all[static_cast<std::size_t>(i) * size / std::min(count, size)]);
  }
  return chosen;
}

}  // namespace rover::real_pairs
