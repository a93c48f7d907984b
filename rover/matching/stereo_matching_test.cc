#include "rover/matching/stereo_matching.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "rover/base/error.h"
#include "rover/matching/test_features.h"
#include "rover/matching/test_images.h"

namespace rover {
namespace {

Camera pinhole(const std::vector<double>& distortion) {
  return {CameraModel::kPinhole, 400, 300, {230, 231, 198, 151}, distortion};
}

Camera fisheye() {
  return {CameraModel::kFisheye, 400, 300, {150, 150, 201, 149}, {0.003, 0.0007, -0.002, 0.0002}};
}

SE3 right_pose(double turn) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d(0.3, 1, 0.2).normalized())),
          Eigen::Vector3d(0.11, 0.01, -0.005)};
}

// A textured wall 2 m ahead, facing the left camera, seen by both cameras.
class Wall {
 public:
  static constexpr double kDepth = 2;

  Wall(const Rig& rig, int features, double noise)
      : rig_(rig),
        texture_(11, 0.05, 0.2, 30),
        left_image_(render(0, noise)),
        right_image_(render(1, noise)),
        left_(random_features(features, 64, 3, left_image_.size())),
        right_(left_) {
    for (int i = 0; i < features; ++i) {
      const auto seen = in_right(truth(i));
      right_.positions[i] = seen ? seen->cast<float>() : Eigen::Vector2f(-100, -100);
    }
    right_ = shuffled_features(right_, 0, 1);
  }

  // The point of a left feature, in the left camera's frame.
  Eigen::Vector3d truth(int i) const {
    const auto ray = rig_.cameras[0].unproject(left_.positions[i].cast<double>());
    return *ray * (kDepth / ray->z());
  }
  std::optional<Eigen::Vector2d> in_right(const Eigen::Vector3d& point) const {
    return rig_.cameras[1].project(rig_.body_from_camera[1].inverse() * point);
  }
  int visible() const {
    int count = 0;
    for (const auto& p : right_.positions) {
      count += rig_.cameras[1].contains(p.cast<double>(), 15);
    }
    return count;
  }
  std::vector<StereoMatch> match(const StereoMatchingOptions& options = {}) const {
    return match_stereo(left_, left_image_, right_, right_image_, rig_, options);
  }
  FeatureSet& right() { return right_; }
  void set_sigmas(float sigma) {
    for (FeatureSet* features : {&left_, &right_}) {
      std::fill(features->sigmas.begin(), features->sigmas.end(), sigma);
    }
  }
  void blank_right_image() { right_image_ = cv::Scalar(90); }

 private:
  cv::Mat render(int camera, double noise) const {
    const SE3& pose = rig_.body_from_camera[camera];
    const auto on_wall = [&](const Eigen::Vector2d& pixel) -> Eigen::Vector2d {
      const auto ray = rig_.cameras[camera].unproject(pixel);
      if (!ray) return {0, 0};
      const Eigen::Vector3d direction = pose.rotation * *ray;
      const double distance = (kDepth - pose.translation.z()) / direction.z();
      return (pose.translation + distance * direction).head<2>();
    };
    const cv::Size size(rig_.cameras[camera].width(), rig_.cameras[camera].height());
    return texture_.render(size, on_wall, 1, 0, noise, 5 + camera);
  }

  Rig rig_;
  SmoothTexture texture_;
  cv::Mat left_image_, right_image_;
  FeatureSet left_, right_;
};

std::vector<Rig> rigs() {
  const std::vector<double> radtan = {-0.28, 0.07, 0.0002, 0.00002};
  return {{{pinhole({}), pinhole({})}, {SE3(), right_pose(0)}},
          {{pinhole(radtan), pinhole(radtan)}, {SE3(), right_pose(0.05)}},
          {{fisheye(), fisheye()}, {SE3(), right_pose(0.08)}},
          {{fisheye(), pinhole(radtan)}, {SE3(), right_pose(-0.05)}}};
}

TEST(StereoMatching, FindsAndTriangulatesAllFeaturesOfAnyRig) {
  for (const Rig& rig : rigs()) {
    Wall wall(rig, 300, 1);
    wall.set_sigmas(0.2f);
    const auto matches = wall.match();
    // Those near the border have no window to be aligned in, but are matched.
    EXPECT_GE(static_cast<int>(matches.size()), wall.visible() * 97 / 100);
    int last = -1;
    for (const StereoMatch& match : matches) {
      EXPECT_GT(match.left, last);
      last = match.left;
      EXPECT_EQ(match.right, (match.left * 7 + 3) % 300);
      EXPECT_LT((match.point - wall.truth(match.left)).norm(), 6 * match.depth_sigma + 1e-6);
    }
  }
}

TEST(StereoMatching, DepthSigmaIsHonest) {
  double square = 0;
  int count = 0;
  for (const Rig& rig : rigs()) {
    const Wall wall(rig, 300, 8);
    for (const StereoMatch& match : wall.match()) {
      if (match.sigma >= 1) continue;  // not aligned
      const double error = match.point.norm() - wall.truth(match.left).norm();
      square += error * error / (match.depth_sigma * match.depth_sigma);
      ++count;
    }
  }
  EXPECT_GT(count, 500);
  EXPECT_NEAR(square / count, 0.85, 0.45);
}

TEST(StereoMatching, AlignmentMendsThePositions) {
  Wall wall(rigs()[1], 300, 1);
  Random random(8);
  for (auto& position : wall.right().positions) {
    position += 0.4f * Eigen::Vector2f(static_cast<float>(random.gaussian()),
                                       static_cast<float>(random.gaussian()));
  }
  StereoMatchingOptions options;
  const auto median_error = [&] {
    std::vector<double> errors;
    for (const StereoMatch& match : wall.match(options)) {
      errors.push_back((match.point - wall.truth(match.left)).norm());
    }
    std::nth_element(errors.begin(), errors.begin() + errors.size() / 2, errors.end());
    return errors[errors.size() / 2];
  };
  const double aligned = median_error();
  options.refine = false;
  EXPECT_LT(aligned, 0.3 * median_error());
}

TEST(StereoMatching, KeepsOnlyCornersOfWhatCannotBeAligned) {
  Wall wall(rigs()[0], 300, 1);
  wall.blank_right_image();
  StereoMatchingOptions options;
  wall.set_sigmas(0.2f);
  const auto corners = wall.match(options);
  EXPECT_GE(static_cast<int>(corners.size()), wall.visible() * 97 / 100);
  for (const StereoMatch& match : corners) EXPECT_GE(match.sigma, 1);
  wall.set_sigmas(0.35f);
  EXPECT_TRUE(wall.match(options).empty());
  options.refine = false;  // nothing is known of any
  EXPECT_EQ(wall.match(options).size(), corners.size());
}

TEST(StereoMatching, RefusesDepthsOutOfRangeAndOtherLines) {
  Wall wall(rigs()[0], 300, 0);
  StereoMatchingOptions options;
  options.min_depth = 4;  // the wall is at 2 m, at most 3 m away along a ray
  EXPECT_TRUE(wall.match(options).empty());
  options = {};
  options.max_depth = 1;
  EXPECT_TRUE(wall.match(options).empty());
  for (auto& position : wall.right().positions) position.y() += 6;
  EXPECT_LT(wall.match().size(), 5u);
}

TEST(StereoMatching, TakesEmptySetsAndRefusesOneCamera) {
  const Rig rig = rigs()[0];
  const cv::Mat image(300, 400, CV_8UC1, cv::Scalar(0));
  const FeatureSet none = random_features(0, 64, 1), some = random_features(5, 64, 1);
  EXPECT_TRUE(match_stereo(none, image, some, image, rig, {}).empty());
  EXPECT_TRUE(match_stereo(some, image, none, image, rig, {}).empty());
  const Rig one{{rig.cameras[0]}, {SE3()}};
  EXPECT_THROW(match_stereo(some, image, some, image, one, {}), InputError);
}

TEST(StereoMatchingOptions, ChecksItself) {
  EXPECT_NO_THROW(StereoMatchingOptions{}.check());
  StereoMatchingOptions options;
  options.max_depth = 0.1f;
  EXPECT_THROW(options.check(), InputError);
  options = {};
  options.epipolar_gate = 0;
  EXPECT_THROW(options.check(), InputError);
  options = {};
  options.max_unaligned_sigma = -1;
  EXPECT_THROW(options.check(), InputError);
}

}  // namespace
}  // namespace rover
