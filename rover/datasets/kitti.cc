// KITTI odometry folders: image_0, image_1, calib.txt, times.txt, and poses.txt here or in the
// benchmark's own place. Images are rectified, so the cameras are pinholes without distortion.
#include <algorithm>
#include <array>
#include <charconv>
#include <map>

#include <opencv2/core.hpp>

#include "rover/base/error.h"
#include "rover/datasets/image_file.h"
#include "rover/datasets/sequence.h"
#include "rover/datasets/text_rows.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

using ImagesByNumber = std::map<std::int64_t, fs::path>;

// 000012.png is the image of line 12 of times.txt, counted from 0.
ImagesByNumber list_images(const fs::path& folder) {
  require(fs::is_directory(folder), "{}: no such folder; check that the dataset is complete",
          folder.string());
  ImagesByNumber images;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string stem = entry.path().stem().string();
    std::int64_t number = -1;
    const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), number);
    if (error == std::errc() && end == stem.data() + stem.size()) images[number] = entry.path();
  }
  require(!images.empty(), "{}: holds no image named by its number, like 000000.png",
          folder.string());
  return images;
}

// All images of a folder have one size, which calib.txt does not tell.
cv::Size find_image_size(const ImagesByNumber& images) {
  std::string problem;
  for (const auto& [number, file] : images) {
    const LoadedImage loaded = load_gray_image(file, {});
    if (!loaded.image.empty()) return loaded.image.size();
    if (problem.empty()) problem = loaded.problem;
  }
  throw InputError("{}; no image of this folder can be read", problem);
}

using Projection = std::array<double, 12>;  // 3x4, row by row

Projection read_projection(const fs::path& file, const std::string& name) {
  const std::string text = read_text_file(file);
  for (const TextRow& row : split_rows(text, ' ')) {
    if (row.fields.front() != name) continue;
    Projection projection{};
    try {
      require_fields(row, projection.size() + 1);
      for (std::size_t i = 0; i < projection.size(); ++i) {
        projection[i] = parse_number(row.fields[i + 1]);
      }
    } catch (const InputError& error) {
      throw InputError("{}: line {}: {}; correct the calibration file", file.string(), row.line,
                       error.what());
    }
    return projection;
  }
  throw InputError("{}: '{}' is missing; correct the calibration file", file.string(), name);
}

Camera make_camera(const Projection& p, cv::Size size, const fs::path& file) {
  try {
    return {CameraModel::kPinhole, size.width, size.height, {p[0], p[5], p[2], p[6]}, {}};
  } catch (const InputError& error) {
    throw InputError("{}: {}; correct the calibration file", file.string(), error.what());
  }
}

// Where camera 0 of the projection's frame lies along x, in metres: P = K [I | (-x, 0, 0)].
double position_of(const Projection& p) { return -p[3] / p[0]; }

Rig read_own_rig(const DatasetOptions& options, cv::Size size) {
  const fs::path file = options.path / "calib.txt";
  const Projection left = read_projection(file, "P0:");
  Rig rig{{make_camera(left, size, file)}, {SE3()}};
  if (!options.stereo) return rig;
  const Projection right = read_projection(file, "P1:");
  rig.cameras.push_back(make_camera(right, size, file));
  const double baseline = position_of(right) - position_of(left);
  require(baseline > 0, "{}: camera 1 does not lie to the right of camera 0; correct the file",
          file.string());
  rig.body_from_camera.emplace_back(Eigen::Quaterniond::Identity(),
                                    Eigen::Vector3d(baseline, 0, 0));
  return rig;
}

Rig read_rig(const DatasetOptions& options, const ImagesByNumber& images) {
  if (!options.calibration) return read_own_rig(options, find_image_size(images));
  const RigCalibration calibration = read_rig_calibration(*options.calibration);
  return choose_cameras(calibration, options, *options.calibration).in_camera_frame();
}

struct FrameTime {
  Timestamp time = 0;
  std::int64_t number = 0;
};

std::vector<FrameTime> read_times(const fs::path& file, std::vector<std::string>& notes) {
  std::int64_t number = 0;
  const auto parse = [&](const TextRow& row) {
    const std::int64_t own = number++;  // a line that cannot be read still counts
    return FrameTime{parse_seconds_field(row.fields.front()), own};
  };
  return read_timed_rows<FrameTime>(file, ' ', parse, &notes);
}

std::vector<SequenceFrame> join(const std::vector<FrameTime>& times,
                                const std::vector<ImagesByNumber>& cameras,
                                std::vector<std::string>& notes) {
  std::vector<SequenceFrame> frames;
  for (const auto& [time, number] : times) {
    SequenceFrame frame{time, {}};
    for (const ImagesByNumber& images : cameras) {
      const auto found = images.find(number);
      frame.images.push_back(found == images.end() ? fs::path() : found->second);
    }
    frames.push_back(std::move(frame));
  }
  const auto extra = cameras[0].size() > times.size() ? cameras[0].size() - times.size() : 0;
  if (extra > 0) notes.push_back(fmt::format("{} images have no line in times.txt", extra));
  return frames;
}

SE3 parse_pose(const TextRow& row) {
  require_fields(row, 12);
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  for (int i = 0; i < 12; ++i) matrix(i / 4, i % 4) = parse_number(row.fields[i]);
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const double deviation = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm();
  require(deviation < 1e-2 && rotation.determinant() > 0, "not a rigid transform");
  return SE3::from_matrix(matrix);
}

fs::path ground_truth_file(const fs::path& folder) {
  if (fs::exists(folder / "poses.txt")) return folder / "poses.txt";
  const fs::path whole = fs::weakly_canonical(folder);
  return whole.parent_path().parent_path() / "poses" / (whole.filename().string() + ".txt");
}

// Line i of the poses belongs to line i of the times.
Trajectory read_ground_truth(const fs::path& file, const std::vector<FrameTime>& times,
                             std::vector<std::string>& notes) {
  if (!fs::exists(file)) return {};
  const std::string text = read_text_file(file);
  const auto rows = split_rows(text, ' ');
  Omissions omissions(file);
  Trajectory poses;
  for (const auto& [time, number] : times) {
    if (number >= std::ssize(rows)) break;
    const TextRow& row = rows[static_cast<std::size_t>(number)];
    try {
      poses.push_back({time, parse_pose(row)});
    } catch (const InputError& error) {
      omissions.add(row.line, error.what());
    }
  }
  omissions.finish(poses.size(), &notes);
  return poses;
}

}  // namespace

Sequence read_kitti_sequence(const DatasetOptions& options) {
  require(!options.inertial,
          "{}: a KITTI odometry folder has no inertial data; choose a mode "
          "without",
          options.path.string());
  std::vector<ImagesByNumber> cameras = {list_images(options.path / "image_0")};
  if (options.stereo) cameras.push_back(list_images(options.path / "image_1"));
  Sequence sequence;
  sequence.rig = read_rig(options, cameras.front());
  const auto times = read_times(options.path / "times.txt", sequence.notes);
  sequence.frames = join(times, cameras, sequence.notes);
  sequence.ground_truth = read_ground_truth(ground_truth_file(options.path), times, sequence.notes);
  return sequence;
}

}  // namespace rover
