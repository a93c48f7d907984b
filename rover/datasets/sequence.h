#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rover/datasets/calibration.h"
#include "rover/datasets/dataset.h"

namespace rover {

// The images of one instant; an empty path where a camera has none.
struct SequenceFrame {
  Timestamp time = 0;
  std::vector<std::filesystem::path> images;  // one per camera of the rig
};

// What a folder holds, before any image is decoded.
struct Sequence {
  Rig rig;
  std::optional<ImuCalibration> imu_calibration;
  std::vector<SequenceFrame> frames;
  std::vector<ImuSample> imu;
  Trajectory ground_truth;  // of the rig's body frame
  std::vector<std::string> notes;
};

// One file per format. All throw InputError for what makes the whole folder unusable.
Sequence read_euroc_sequence(const DatasetOptions& options);
Sequence read_tum_sequence(const DatasetOptions& options);
Sequence read_kitti_sequence(const DatasetOptions& options);
Sequence read_folder_sequence(const DatasetOptions& options);

// The frames of a sequence, decoded one after the other. Throws InputError if none of a few images
// from all over the sequence fits the calibration.
std::unique_ptr<Dataset> make_sequence_dataset(Sequence sequence);

std::unique_ptr<Dataset> open_video(const DatasetOptions& options);

// The cameras that the options ask for: one, or two for stereo. Throws InputError if `file` has
// fewer, or does not say where the inertial sensor is though inertial data are asked for.
Rig choose_cameras(const RigCalibration& calibration, const DatasetOptions& options,
                   const std::filesystem::path& file);

// Throws InputError where the options ask for a sensor that this format does not have.
void require_monocular(const DatasetOptions& options, const std::string& format);

}  // namespace rover
