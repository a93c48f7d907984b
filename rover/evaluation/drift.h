#pragma once

#include <optional>
#include <span>

#include "rover/evaluation/metrics.h"

namespace rover {

// Part of a run for which there is no ground truth.
struct BlindStretch {
  Timestamp begin = 0;  // the last reference pose before it
  Timestamp end = 0;    // the first one after it
};

// The longest time between two poses of the reference from `first` to `last`, if it is at least
// 10 s and three tenths of that time: then the reference knows the beginning and the end of the run
// only, as in the corridors and halls of TUM-VI.
std::optional<BlindStretch> find_blind_stretch(const Trajectory& reference, Timestamp first,
                                               Timestamp last);

// How far a trajectory has drifted on its way through a blind stretch: the estimate is aligned with
// the reference before the stretch only, and judged behind it (the measure for sequences with
// partial ground truth in Campos et al., "ORB-SLAM3", 2021, section VII, and Schubert et al., "The
// TUM VI benchmark", 2018).
struct Drift {
  double blind = 0;          // s
  double path = 0;           // m, of the whole estimate in the scale of the alignment
  ErrorStatistics position;  // m, behind the stretch
  double percent = 0;        // rmse of these over the path
};
// Nothing if the pairs before the stretch do not determine the alignment, or none lie behind it.
std::optional<Drift> measure_drift(const Trajectory& estimate, std::span<const PosePair> pairs,
                                   const BlindStretch& stretch, AlignmentKind kind);

}  // namespace rover
