#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "rover/base/random.h"
#include "rover/geometry/triangulation.h"
#include "rover/mapping/local_mapper.h"
#include "rover/matching/test_matcher.h"
#include "rover/optimization/simulated_flight.h"
#include "rover/tracking/tracker.h"

namespace rover {

// Flights along a wall of points, through tracking and mapping in lockstep, for tests: features are
// projections with noise of exactly the deviation stated, descriptors tell all points apart, and
// the inertial sensor is exactly as noisy as it is taken to be: by default as one that flies (see
// ImuNoiseOptions).

struct SimulatedRunOptions {
  int cameras = 2;
  double duration = 15;  // s
  double rate = 10;      // images per s
  double sigma = 0.5;    // px
  ImuNoiseOptions noise{};
  int points = 1000;
  double yaw = 0;  // rad, turn of the whole world about the vertical
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();  // m, likewise
  std::uint64_t seed = 1;
};

// Sideways along the wall at about 1 m/s, swinging: what was seen does not come back.
inline SimulatedMotion passing_motion(Random& random) {
  SimulatedMotion motion = SimulatedMotion::random(random);
  motion.position[1] = {20, 0.05, random.uniform(0, 0.1)};
  return motion;
}

class SimulatedRun {
 public:
  using Visit = std::function<void(const TrackingResult&, const InertialState& truth)>;

  explicit SimulatedRun(const SimulatedRunOptions& options)
      : options_(options),
        random_(hash_seed(options.seed, 5)),
        motion_(passing_motion(random_)),
        rig_(std::make_shared<const Rig>(forward_rig(options.cameras))),
        atlas_(std::make_shared<Atlas>(rig_)),
        tracker_(atlas_, rig_, test_family(), tracker_options(options), 1, kCalibration),
        mapper_(test_family(), mapper_options()) {
    bias_ = {0.02 * random_gaussian_vector(random_), 0.1 * random_gaussian_vector(random_)};
    for (int i = 0; i < options.points; ++i) {
      const double x = random_.uniform(2.5, 6), y = random_.uniform(-6, 21);
      points_.push_back(moved() * Eigen::Vector3d(x, y, random_.uniform(-3, 3)));
    }
  }

  // The whole flight, each frame shown with the true state of the body.
  void fly(const Visit& visit) {
    const int frames = static_cast<int>(options_.duration * options_.rate);
    for (int i = 0; i < frames; ++i) {
      const double time = i / options_.rate;
      feel_until(time);
      const TrackingResult result = tracker_.track(look(i, time));
      if (result.new_keyframe.valid()) mapper_.process(*map(), result.new_keyframe);
      visit(result, truth(time));
    }
  }

  // In the world's frame as it was turned and shifted.
  InertialState truth(double time) const {
    InertialState state = motion_.state(time, bias_);
    state.world_from_body = moved() * state.world_from_body;
    state.velocity = moved().rotation * state.velocity;
    return state;
  }
  const std::shared_ptr<SharedMap>& map() const { return tracker_.active_map(); }
  int maps() const { return static_cast<int>(atlas_->maps().size()); }

 private:
  static constexpr ImuCalibration kCalibration = {1.7e-4, 1.9e-5, 2e-3, 3e-3, 200};

  // Noise is what is stated.
  static constexpr WeightingOptions kExact = {
      .model_sigma = 0, .detection_sigma = 0, .disparity_sigma = 0};

  static TrackerOptions tracker_options(const SimulatedRunOptions& simulated) {
    TrackerOptions options;
    options.weighting = kExact;
    options.inertial.noise = simulated.noise;
    return options;
  }
  static LocalMapperOptions mapper_options() {
    LocalMapperOptions options;
    options.creation.weighting = kExact;
    options.is_inertial = true;
    return options;
  }

  SE3 moved() const { return {so3_exp({0, 0, options_.yaw}), options_.shift}; }

  // Readings up to the first one after a time; the biases walk.
  void feel_until(double time) {
    const ImuNoise noise = ImuNoise::of(kCalibration, options_.noise);
    const double root = std::sqrt(kCalibration.rate);
    for (; felt_ / kCalibration.rate < time + 1e-9; ++felt_) {
      ImuSample sample = motion_.sample(felt_ / kCalibration.rate, bias_);
      sample.angular_velocity += noise.gyroscope * root * random_gaussian_vector(random_);
      sample.acceleration += noise.accelerometer * root * random_gaussian_vector(random_);
      tracker_.add_imu(sample);
      bias_.gyroscope += noise.gyroscope_walk / root * random_gaussian_vector(random_);
      bias_.accelerometer += noise.accelerometer_walk / root * random_gaussian_vector(random_);
    }
  }

  // What a camera sees, off by an error that is given and by noise; the error then is both.
  std::optional<Eigen::Vector2f> see(std::size_t camera, const Eigen::Vector3d& in_body,
                                     Eigen::Vector2d& error) {
    const Camera& model = rig_->cameras[camera];
    const auto pixel = model.project(rig_->body_from_camera[camera].inverse() * in_body);
    if (!pixel || !model.contains(*pixel)) return std::nullopt;
    error += options_.sigma * Eigen::Vector2d(random_.gaussian(), random_.gaussian());
    return (*pixel + error).cast<float>();
  }

  StereoObservation join(const Eigen::Vector2f& left, const Eigen::Vector2f& right) const {
    const auto ray = [&](std::size_t camera, const Eigen::Vector2f& pixel) {
      return ViewRay{rig_->body_from_camera[camera],
                     rig_->cameras[camera].unproject(pixel.cast<double>())->normalized()};
    };
    const ViewRay rays[] = {ray(0, left), ray(1, right)};
    const auto found = triangulate(rays);
    if (!found) return {};
    const double bearing_sigma = options_.sigma / rig_->cameras[0].focal_length();
    const Eigen::Vector3d way = found->point - rays[0].world_from_camera.translation;
    const Eigen::Vector3d direction = way.normalized();
    const double spread = std::sqrt(direction.dot(found->unit_covariance * direction));
    const Eigen::Vector3d point = rays[0].world_from_camera.inverse() * found->point;
    return {right, static_cast<float>(options_.sigma), point.cast<float>(),
            static_cast<float>(way.norm()), static_cast<float>(bearing_sigma * spread)};
  }

  Frame look(int index, double time) {
    auto features = std::make_shared<FeatureSet>();
    auto stereo = std::make_shared<std::vector<StereoObservation>>();
    const SE3 body_from_world = truth(time).world_from_body.inverse();
    std::vector<int> seen;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Eigen::Vector3d in_body = body_from_world * points_[i];
      Eigen::Vector2d error = Eigen::Vector2d::Zero();  // of the left place, shared by the partner
      const auto left = see(0, in_body, error);
      if (!left) continue;
      seen.push_back(static_cast<int>(i));
      features->positions.push_back(*left);
      if (options_.cameras < 2) continue;
      const auto right = see(1, in_body, error);
      stereo->push_back(right ? join(*left, *right) : StereoObservation{});
    }
    describe(seen, *features);
    Frame frame;
    frame.id = {index};
    frame.time = from_seconds(time);
    for (const auto& pixel : features->positions)
      frame.observations.push_back({{}, pixel, static_cast<float>(options_.sigma), false, false});
    frame.features = std::move(features);
    if (options_.cameras > 1) frame.stereo = std::move(stereo);
    return frame;
  }

  void describe(const std::vector<int>& seen, FeatureSet& features) const {
    features.image_size = {rig_->cameras[0].width(), rig_->cameras[0].height()};
    features.scores.assign(seen.size(), 1);
    features.sigmas.assign(seen.size(), static_cast<float>(options_.sigma));
    features.descriptors.resize(static_cast<Eigen::Index>(seen.size()), 64);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      Random random(static_cast<std::uint64_t>(seen[i]));
      auto row = features.descriptors.row(static_cast<Eigen::Index>(i));
      for (auto& value : row) value = static_cast<float>(random.gaussian());
      row.normalize();
    }
  }

  SimulatedRunOptions options_;
  Random random_;
  SimulatedMotion motion_;
  std::vector<Eigen::Vector3d> points_;
  std::shared_ptr<const Rig> rig_;
  std::shared_ptr<Atlas> atlas_;
  Tracker tracker_;
  LocalMapper mapper_;
  ImuBias bias_;
  int felt_ = 0;
};

}  // namespace rover
