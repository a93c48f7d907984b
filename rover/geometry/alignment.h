#pragma once

#include <optional>
#include <span>

#include "rover/geometry/sim3.h"

namespace rover {

enum class AlignmentKind {
  kRigid,       // rotation and translation
  kSimilarity,  // and scale: for trajectories of one camera
  kUpright,     // translation and turn about the vertical z axis: for gravity-aligned frames
};

struct PointAlignment {
  Sim3 to_from_from;  // scale 1 except for kSimilarity
  double rms = 0;     // m, of the distances left
  // How well the rotation is determined, in [0, 1]: the extent of the points across their longest
  // direction over that along it (of both sets together). For kUpright, the horizontal extent over
  // the whole.
  double spread = 0;
};

// The transform that brings points `from` closest to their partners `to`, in the sense of least
// squares (Umeyama, "Least-squares estimation of transformation parameters between two point
// patterns", 1991, equations 40 to 43).
//
// Nothing if the sets differ in size, hold a number that is not finite, or do not determine the
// transform: fewer than three points, all of them on one line or in one place (kUpright: fewer than
// two, or all on one vertical line). Points in one plane are fine; mirrored sets get the best
// rotation.
std::optional<PointAlignment> align_points(std::span<const Eigen::Vector3d> from,
                                           std::span<const Eigen::Vector3d> to, AlignmentKind kind);

}  // namespace rover
