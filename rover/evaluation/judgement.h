#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "rover/evaluation/drift.h"

namespace rover {

// How a trajectory compares with its reference under one alignment.
struct AlignedErrors {
  Sim3 reference_from_estimate;
  ErrorStatistics position;              // absolute trajectory error, metres
  ErrorStatistics relative_translation;  // from pair to pair, metres
  ErrorStatistics relative_rotation;     // from pair to pair, degrees
  DistanceErrors per_distance;
  std::optional<Drift> drift;  // where the reference knows the beginning and the end only
};

// Everything that is said about one trajectory.
struct Judgement {
  std::string name;
  std::size_t poses = 0;           // of the estimate
  std::size_t associated = 0;      // pairs found
  double path = 0;                 // metres, of the reference along the pairs
  std::optional<double> coverage;  // poses / frames offered
  double longest_gap = 0;          // seconds without a pose
  // Nothing where the positions do not determine the alignment.
  std::optional<AlignedErrors> rigid, similarity, gravity;
  std::vector<PosePair> pairs;  // as associated, before any alignment
};

// What the estimate should have covered; absent for two trajectory files.
struct Offered {
  std::size_t frames = 0;
  Timestamp first = 0;
  Timestamp last = 0;
};

// Throws InputError if no pose of the estimate lies within max_difference seconds of the reference.
Judgement judge(const std::string& name, const Trajectory& estimate, const Trajectory& reference,
                double max_difference, const std::optional<Offered>& offered);

nlohmann::json to_json(const Judgement& judgement);

}  // namespace rover
