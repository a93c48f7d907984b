#pragma once

#include "rover/diagnosis/dataset_survey.h"
#include "rover/diagnosis/finding.h"

namespace rover {

// Looks over the stamps: rate, jitter and gaps of the images, pairs without partner, images that
// cannot be read, images without inertial data, the ground truth's rate and span.
void check_clocks(const DatasetSurvey& survey, Findings& findings);

}  // namespace rover
