// TUM RGB-D folders: rgb.txt, groundtruth.txt; colour images only.
#include <array>

#include "rover/base/error.h"
#include "rover/datasets/sequence.h"
#include "rover/datasets/text_rows.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

// The benchmark's own calibration of its three colour cameras, all 640x480.
struct KnownCamera {
  const char* name;
  std::array<double, 4> intrinsics;
  std::array<double, 5> distortion;
};
constexpr std::array<KnownCamera, 3> kKnownCameras = {{
    {"freiburg1", {517.3, 516.5, 318.6, 255.3}, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}},
    {"freiburg2", {520.9, 521.0, 325.1, 249.7}, {0.2312, -0.7849, -0.0033, -0.0001, 0.9172}},
    {"freiburg3", {535.4, 539.2, 320.1, 247.6}, {0, 0, 0, 0, 0}},
}};

Rig single_camera(const Camera& camera) { return {{camera}, {SE3()}}; }

Rig read_rig(const DatasetOptions& options) {
  if (options.calibration) {
    const RigCalibration given = read_rig_calibration(*options.calibration);
    return single_camera(given.rig.cameras.front());
  }
  const std::string folder = fs::weakly_canonical(options.path).string();
  for (const KnownCamera& known : kKnownCameras) {
    if (folder.find(known.name) == std::string::npos) continue;
    const std::vector<double> distortion(known.distortion.begin(), known.distortion.end());
    return single_camera(Camera(CameraModel::kPinhole, 640, 480, known.intrinsics, distortion));
  }
  throw InputError(
      "{}: its name holds none of freiburg1, freiburg2, freiburg3, so its camera is "
      "unknown; give --calibration FILE",
      options.path.string());
}

}  // namespace

Sequence read_tum_sequence(const DatasetOptions& options) {
  require_monocular(options, "a TUM RGB-D folder");
  const auto parse = [&](const TextRow& row) {
    require_fields(row, 2);
    return SequenceFrame{parse_seconds_field(row.fields[0]), {options.path / row.fields[1]}};
  };
  Sequence sequence;
  sequence.rig = read_rig(options);
  sequence.frames =
      read_timed_rows<SequenceFrame>(options.path / "rgb.txt", ' ', parse, &sequence.notes);
  const fs::path ground_truth = options.path / "groundtruth.txt";
  if (fs::exists(ground_truth)) {
    sequence.ground_truth = read_tum_trajectory(ground_truth, &sequence.notes);
  }
  return sequence;
}

}  // namespace rover
