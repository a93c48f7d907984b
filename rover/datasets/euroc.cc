// EuRoC ASL folders: mav0/cam0, cam1, imu0, state_groundtruth_estimate0. TUM-VI shares the layout,
// with its calibration in dso/ and the ground truth in mocap0.
#include "rover/base/error.h"
#include "rover/datasets/imu_file.h"
#include "rover/datasets/sequence.h"
#include "rover/datasets/text_rows.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

// Exposures of a stereo pair are triggered together; stamps may differ by the clocks' rounding.
constexpr Timestamp kStereoTolerance = 500'000;  // ns

struct StampedFile {
  Timestamp time = 0;
  fs::path file;
};

fs::path find_root(const fs::path& path) {
  return fs::is_directory(path / "mav0") ? path / "mav0" : path;
}

std::vector<StampedFile> read_images(const fs::path& camera, std::vector<std::string>& notes) {
  const auto parse = [&](const TextRow& row) {
    require_fields(row, 2);
    require(!row.fields[1].empty(), "no file name");
    return StampedFile{parse_nanoseconds_field(row.fields[0]), camera / "data" / row.fields[1]};
  };
  return read_timed_rows<StampedFile>(camera / "data.csv", ',', parse, &notes);
}

RigCalibration read_sensor_files(const fs::path& root, bool stereo) {
  RigCalibration rig = read_rig_calibration(root / "cam0" / "sensor.yaml");
  if (!stereo) return rig;
  const RigCalibration right = read_rig_calibration(root / "cam1" / "sensor.yaml");
  require(rig.body_is_imu && right.body_is_imu,
          "{}: 'T_BS' is missing in sensor.yaml of cam0 or cam1; stereo needs both", root.string());
  rig.rig.cameras.push_back(right.rig.cameras.front());
  rig.rig.body_from_camera.push_back(right.rig.body_from_camera.front());
  return rig;
}

// The file that was named, else the sensor.yaml of each camera, else TUM-VI's camchain.
Rig read_rig(const fs::path& root, const DatasetOptions& options) {
  const fs::path camchain = root.parent_path() / "dso" / "camchain.yaml";
  if (options.calibration) {
    return choose_cameras(read_rig_calibration(*options.calibration), options,
                          *options.calibration);
  }
  if (!fs::exists(root / "cam0" / "sensor.yaml") && fs::exists(camchain)) {
    return choose_cameras(read_rig_calibration(camchain), options, camchain);
  }
  return choose_cameras(read_sensor_files(root, options.stereo), options,
                        root / "cam0" / "sensor.yaml");
}

fs::path imu_calibration_file(const fs::path& root, const DatasetOptions& options) {
  if (options.imu_calibration) return *options.imu_calibration;
  const fs::path tum_vi = root.parent_path() / "dso" / "imu_config.yaml";
  const fs::path own = root / "imu0" / "sensor.yaml";
  return !fs::exists(own) && fs::exists(tum_vi) ? tum_vi : own;
}

// Makes the inertial sensor's frame the body frame, should the files have set them apart.
void rebase_to_imu(const SE3& body_from_imu, Sequence& sequence) {
  for (SE3& body_from_camera : sequence.rig.body_from_camera) {
    body_from_camera = body_from_imu.inverse() * body_from_camera;
  }
  sequence.ground_truth = move_frame(sequence.ground_truth, body_from_imu);
}

void read_imu(const fs::path& root, const DatasetOptions& options, Sequence& sequence) {
  require(fs::is_directory(root / "imu0"),
          "{}: has no imu0 folder; choose a mode without inertial data", root.string());
  const ImuFileCalibration calibration = read_imu_calibration(imu_calibration_file(root, options));
  sequence.imu_calibration = calibration.imu;
  sequence.imu = read_imu_file(root / "imu0" / "data.csv", &sequence.notes);
  require(sequence.imu.front().time <= sequence.frames.back().time &&
              sequence.imu.back().time >= sequence.frames.front().time,
          "{}: inertial data and images do not overlap in time; are both of one clock?",
          (root / "imu0" / "data.csv").string());
  rebase_to_imu(calibration.body_from_imu, sequence);
}

Trajectory read_ground_truth(const fs::path& root, std::vector<std::string>& notes) {
  for (const char* folder : {"state_groundtruth_estimate0", "mocap0"}) {
    const fs::path file = root / folder / "data.csv";
    if (fs::exists(file)) return read_euroc_trajectory(file, &notes);
  }
  return {};
}

std::vector<SequenceFrame> join_stereo(const std::vector<StampedFile>& left,
                                       const std::vector<StampedFile>& right,
                                       std::vector<std::string>& notes) {
  std::vector<SequenceFrame> frames;
  std::size_t joined = 0, next = 0;
  for (const StampedFile& image : left) {
    while (next < right.size() && right[next].time < image.time - kStereoTolerance) ++next;
    const bool found = next < right.size() && right[next].time <= image.time + kStereoTolerance;
    frames.push_back({image.time, {image.file, found ? right[next].file : fs::path()}});
    if (found) ++joined, ++next;
  }
  if (joined < left.size() || joined < right.size()) {
    notes.push_back(fmt::format("stereo: {} of {} left and {} right images have a partner", joined,
                                left.size(), right.size()));
  }
  require(joined > 0,
          "stereo: no image of camera 0 has a partner of the same time in camera 1; "
          "check the time stamps in cam1/data.csv");
  return frames;
}

std::vector<SequenceFrame> read_frames(const fs::path& root, bool stereo,
                                       std::vector<std::string>& notes) {
  const auto left = read_images(root / "cam0", notes);
  if (stereo) return join_stereo(left, read_images(root / "cam1", notes), notes);
  std::vector<SequenceFrame> frames;
  for (const StampedFile& image : left) frames.push_back({image.time, {image.file}});
  return frames;
}

}  // namespace

Sequence read_euroc_sequence(const DatasetOptions& options) {
  const fs::path root = find_root(options.path);
  require(!options.stereo || fs::is_directory(root / "cam1"),
          "{}: has no cam1 folder; choose a mode with one camera", root.string());
  Sequence sequence;
  sequence.rig = read_rig(root, options);
  sequence.frames = read_frames(root, options.stereo, sequence.notes);
  sequence.ground_truth = read_ground_truth(root, sequence.notes);
  if (options.inertial) read_imu(root, options, sequence);
  return sequence;
}

}  // namespace rover
