#include "rover/datasets/dataset.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "rover/base/error.h"
#include "rover/datasets/image_names.h"
#include "rover/datasets/sequence.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::pair<const char*, DatasetFormat>, 6> kFormats = {{
    {"auto", DatasetFormat::kAuto},
    {"euroc", DatasetFormat::kEuroc},
    {"tum", DatasetFormat::kTum},
    {"kitti", DatasetFormat::kKitti},
    {"folder", DatasetFormat::kFolder},
    {"video", DatasetFormat::kVideo},
}};

bool holds_images(const fs::path& folder) {
  const auto is_image = [](const fs::directory_entry& entry) {
    return has_image_name(entry.path());
  };
  return std::any_of(fs::directory_iterator(folder), fs::directory_iterator(), is_image);
}

DatasetFormat detect_format(const fs::path& path) {
  if (fs::is_regular_file(path)) {
    require(has_video_name(path), "{}: neither a folder nor a video (.mp4, .avi, .mov, .mkv ...)",
            path.string());
    return DatasetFormat::kVideo;
  }
  require(!fs::is_empty(path), "{}: the folder is empty", path.string());
  if (fs::exists(path / "mav0") || fs::exists(path / "cam0")) return DatasetFormat::kEuroc;
  if (fs::exists(path / "rgb.txt")) return DatasetFormat::kTum;
  if (fs::exists(path / "image_0")) return DatasetFormat::kKitti;
  require(holds_images(path),
          "{}: no known format; looked for mav0/ or cam0/ (EuRoC), rgb.txt "
          "(TUM), image_0/ (KITTI) and image files",
          path.string());
  return DatasetFormat::kFolder;
}

std::unique_ptr<Dataset> open_format(const DatasetOptions& options, DatasetFormat format) {
  switch (format) {
    case DatasetFormat::kEuroc:
      return make_sequence_dataset(read_euroc_sequence(options));
    case DatasetFormat::kTum:
      return make_sequence_dataset(read_tum_sequence(options));
    case DatasetFormat::kKitti:
      return make_sequence_dataset(read_kitti_sequence(options));
    case DatasetFormat::kFolder:
      return make_sequence_dataset(read_folder_sequence(options));
    case DatasetFormat::kVideo:
      return open_video(options);
    case DatasetFormat::kAuto:
      break;
  }
  return open_format(options, detect_format(options.path));
}

void require_openable(const fs::path& path, DatasetFormat format) {
  std::error_code error;
  require(fs::exists(path, error), "{}: no such folder or file", path.string());
  require(format == DatasetFormat::kAuto || format == DatasetFormat::kVideo ||
              fs::is_directory(path, error),
          "{}: not a folder", path.string());
}

}  // namespace

DatasetFormat parse_dataset_format(const std::string& name) {
  std::string names;
  for (const auto& [known, format] : kFormats) {
    if (name == known) return format;
    names += (names.empty() ? "" : ", ") + std::string(known);
  }
  throw InputError("unknown dataset format '{}'; known are {}", name, names);
}

void DatasetOptions::check() const {
  require(!path.empty(), "no dataset was named; give --dataset DIR");
  require(frame_rate == 0 || (frame_rate > 1e-3 && frame_rate < 1e5),
          "frame rate {} Hz makes no sense", frame_rate);
  require(read_ahead >= 0 && read_ahead <= 1000, "reading {} images ahead makes no sense",
          read_ahead);
}

std::unique_ptr<Dataset> open_dataset(const DatasetOptions& options) {
  options.check();
  require_openable(options.path, options.format);
  try {
    auto dataset = open_format(options, options.format);
    return options.read_ahead > 0 ? read_ahead(std::move(dataset), options.read_ahead)
                                  : std::move(dataset);
  } catch (const fs::filesystem_error& error) {
    throw InputError("{}: {}; check its permissions", error.path1().string(),
                     error.code().message());
  }
}

Rig choose_cameras(const RigCalibration& calibration, const DatasetOptions& options,
                   const fs::path& file) {
  const std::size_t count = options.stereo ? 2 : 1;
  require(calibration.rig.cameras.size() >= count, "{}: holds one camera; stereo needs two",
          file.string());
  require(!options.inertial || calibration.body_is_imu,
          "{}: does not say where the camera is on the inertial sensor (T_BS or T_cam_imu)",
          file.string());
  const auto n = static_cast<std::ptrdiff_t>(count);
  const Rig& all = calibration.rig;
  return {{all.cameras.begin(), all.cameras.begin() + n},
          {all.body_from_camera.begin(), all.body_from_camera.begin() + n}};
}

void require_monocular(const DatasetOptions& options, const std::string& format) {
  require(!options.stereo, "{}: {} has one camera; choose a mode with one", options.path.string(),
          format);
  require(!options.inertial, "{}: {} has no inertial data; choose a mode without",
          options.path.string(), format);
}

}  // namespace rover
