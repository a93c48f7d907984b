#include "rover/geometry/alignment.h"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "rover/geometry/random_geometry.h"

namespace rover {
namespace {

using Points = std::vector<Eigen::Vector3d>;
constexpr AlignmentKind kKinds[] = {AlignmentKind::kRigid, AlignmentKind::kSimilarity,
                                    AlignmentKind::kUpright};

Points random_points(Random& random, int count) {
  Points points;
  const Eigen::Vector3d centre = 10 * random_gaussian_vector(random);
  for (int i = 0; i < count; ++i) points.push_back(centre + 3 * random_gaussian_vector(random));
  return points;
}

Sim3 random_transform(Random& random, AlignmentKind kind) {
  Sim3 transform(random_pose(random, 5));
  if (kind == AlignmentKind::kSimilarity) transform.scale = std::exp(random.gaussian());
  if (kind == AlignmentKind::kUpright)
    transform.rotation = so3_exp({0, 0, random.uniform(-3.2, 3.2)});
  return transform;
}

Points moved(const Points& points, const Sim3& transform) {
  Points result;
  for (const auto& p : points) result.push_back(transform * p);
  return result;
}

TEST(Alignment, FindsExactTransforms) {
  Random random(1);
  for (int i = 0; i < 3000; ++i) {
    const AlignmentKind kind = kKinds[i % 3];
    Points from = random_points(random, 4 + random.index(20));
    if (i % 5 == 0)  // a plane, as of a trajectory on flat ground
      for (auto& p : from) p.z() = 1;
    const Sim3 transform = random_transform(random, kind);
    const auto found = align_points(from, moved(from, transform), kind);
    ASSERT_TRUE(found);
    EXPECT_LT((found->to_from_from.matrix() - transform.matrix()).norm(),
              1e-9 * (1 + transform.matrix().norm()));
    EXPECT_LT(found->rms, 1e-11 * (1 + transform.matrix().norm()));
  }
}

// No neighbouring transform fits noisy points better.
TEST(Alignment, IsTheLeastSquaresSolution) {
  Random random(2);
  for (int i = 0; i < 1000; ++i) {
    const AlignmentKind kind = kKinds[i % 3];
    const Points from = random_points(random, 10);
    Points to = moved(from, random_transform(random, kind));
    for (auto& p : to) p += 0.5 * random_gaussian_vector(random);
    const auto found = align_points(from, to, kind);
    ASSERT_TRUE(found);
    const auto rms = [&](const Sim3& transform) {
      double sum = 0;
      for (std::size_t k = 0; k < from.size(); ++k)
        sum += (to[k] - transform * from[k]).squaredNorm();
      return std::sqrt(sum / static_cast<double>(from.size()));
    };
    EXPECT_NEAR(found->rms, rms(found->to_from_from), 1e-12);
    for (int axis = 0; axis < 7; ++axis) {
      if (kind != AlignmentKind::kSimilarity && axis == 6) continue;
      if (kind == AlignmentKind::kUpright && (axis == 3 || axis == 4)) continue;
      for (const double step : {-1e-3, 1e-3})
        EXPECT_LT(found->rms, rms(found->to_from_from * sim3_exp(step * Vector7d::Unit(axis))));
    }
  }
}

TEST(Alignment, GravityKeepsTheVertical) {
  Random random(3);
  for (int i = 0; i < 500; ++i) {
    const Points from = random_points(random, 5), to = random_points(random, 5);
    const auto found = align_points(from, to, AlignmentKind::kUpright);
    ASSERT_TRUE(found);
    EXPECT_LT(
        (found->to_from_from.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitZ()).norm(),
        1e-15);
  }
}

TEST(Alignment, OfMirroredPointsIsStillARotation) {
  Random random(4);
  for (int i = 0; i < 500; ++i) {
    const Points from = random_points(random, 8);
    Points to = from;
    for (auto& p : to) p.x() = -p.x();
    const auto found = align_points(from, to, AlignmentKind::kSimilarity);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->to_from_from.rotation.toRotationMatrix().determinant(), 1, 1e-12);
    EXPECT_GT(found->to_from_from.scale, 0);
    EXPECT_GT(found->rms, 0.1);
  }
}

TEST(Alignment, RefusesWhatDoesNotDetermineIt) {
  Random random(5);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d start = 10 * random_gaussian_vector(random), d = random_direction(random);
    Points line, place(5, start), vertical;
    for (int k = 0; k < 8; ++k) {
      line.push_back(start + random.gaussian() * d);
      vertical.push_back(start + random.gaussian() * Eigen::Vector3d::UnitZ());
    }
    for (const AlignmentKind kind : {AlignmentKind::kRigid, AlignmentKind::kSimilarity}) {
      const Sim3 transform = random_transform(random, kind);
      EXPECT_FALSE(align_points(line, moved(line, transform), kind));
    }
    for (const AlignmentKind kind : kKinds) {
      const Sim3 transform = random_transform(random, kind);
      EXPECT_FALSE(align_points(place, moved(place, transform), kind));
      EXPECT_FALSE(align_points(vertical, moved(vertical, transform), kind));
    }
  }
}

TEST(Alignment, RefusesBadInput) {
  Random random(6);
  const Points points = random_points(random, 5);
  const Points fewer(points.begin(), points.begin() + 2);
  EXPECT_FALSE(align_points(points, fewer, AlignmentKind::kRigid));
  EXPECT_FALSE(align_points(fewer, fewer, AlignmentKind::kRigid));
  EXPECT_TRUE(align_points(fewer, fewer, AlignmentKind::kUpright));
  EXPECT_FALSE(align_points({}, {}, AlignmentKind::kUpright));
  Points bad = points;
  bad[2].y() = std::numeric_limits<double>::quiet_NaN();
  for (const AlignmentKind kind : kKinds) EXPECT_FALSE(align_points(points, bad, kind));
}

TEST(Alignment, SpreadSaysHowThinThePointsAre) {
  Random random(7);
  Points thin = random_points(random, 100);
  const auto full = align_points(thin, thin, AlignmentKind::kRigid);
  for (auto& p : thin) p = {100 * p.x(), 0.1 * p.y(), 0.1 * p.z()};
  const auto narrow = align_points(thin, thin, AlignmentKind::kRigid);
  ASSERT_TRUE(full && narrow);
  EXPECT_GT(full->spread, 0.5);
  EXPECT_LT(narrow->spread, 0.01);
}

}  // namespace
}  // namespace rover
