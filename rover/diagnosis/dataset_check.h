#pragma once

#include <string>

#include "rover/datasets/dataset.h"
#include "rover/diagnosis/finding.h"

namespace rover {

struct DatasetCheckOptions {
  int samples = 12;                     // frames whose images are looked at
  double visual_run = 12;               // s that are tracked, to compare camera and inertial sensor
  std::string family = "xfeat-corner";  // features and matcher
  int features = 500;                   // per image, at most
  int threads = 2;                      // of the networks

  void check() const;
};

// Asks for all that the folder holds: a second camera, inertial data.
DatasetOptions with_all_sensors(DatasetOptions input);

// Looks a dataset over as it would be used: calibration, clocks, images, inertial data, and the
// camera against the inertial sensor, each only where the options ask for the sensor. Same input,
// same findings. Throws InputError for a dataset that cannot be used at all, an unknown family and
// missing models.
Findings check_dataset(const DatasetOptions& input, const DatasetCheckOptions& options);

}  // namespace rover
