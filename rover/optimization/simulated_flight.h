#pragma once

#include <vector>

#include "rover/imu/simulated_motion.h"
#include "rover/optimization/inertial_bundle_adjustment.h"
#include "rover/optimization/simulated_bundle.h"

namespace rover {

// Visual-inertial problems with known answers, for tests: a body on a SimulatedMotion whose cameras
// look along its x axis at points on all sides of a room.

struct FlightSimulation {
  int cameras = 1;
  int keyframes = 12;
  double interval = 0.25;  // s between keyframes
  int points = 250;
  double sigma = 1;  // px
  double outliers = 0;
  double imu_inflation = 1;  // of the noise that is simulated and reckoned with
  double late = 0;           // s that the inertial sensor's stamps are too late by
  double gyroscope_bias = 0.02, accelerometer_bias = 0.1;  // deviations
  std::uint64_t seed = 1;
};

struct SimulatedFlight {
  SimulatedMotion motion;
  InertialBundleProblem truth;  // true states and points, noisy observations and inertial data
  std::vector<char> is_outlier;
};

// Cameras side by side, 0.11 m apart, that look along the body's x axis.
inline Rig forward_rig(int cameras) {
  Rig rig;
  const Eigen::Matrix3d axes =
      (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();  // body_from_camera
  for (int i = 0; i < cameras; ++i) {
    rig.cameras.push_back(simulated_pinhole());
    rig.body_from_camera.emplace_back(Eigen::Quaterniond(axes) * so3_exp({0.02, -0.01 * i, 0.03}),
                                      Eigen::Vector3d(0.05, 0.06 - 0.11 * i, 0.02));
  }
  return rig;
}

namespace internal {

inline void add_states(const FlightSimulation& simulation, Random& random,
                       SimulatedFlight& flight) {
  InertialBundleProblem& truth = flight.truth;
  const ImuNoise noise = simulated_noise(simulation.imu_inflation);
  ImuBias bias = {simulation.gyroscope_bias * random_gaussian_vector(random),
                  simulation.accelerometer_bias * random_gaussian_vector(random)};
  for (int i = 0; i < simulation.keyframes; ++i) {
    const double time = i * simulation.interval;
    const InertialState state = flight.motion.state(time, bias);
    truth.bundle.world_from_body.push_back(state.world_from_body);
    truth.bundle.pose_fixed.push_back(0);
    truth.velocity.push_back(state.velocity);
    truth.bias.push_back(bias);
    if (i + 1 == simulation.keyframes) break;
    auto samples =
        simulate_imu(flight.motion, time - simulation.late,
                     time + simulation.interval - simulation.late, 200, bias, noise, random);
    for (ImuSample& sample : samples) sample.time += from_seconds(simulation.late);
    truth.links.push_back({i, i + 1, {std::move(samples), ImuBias{}, noise}});
    const Vector6d walk = truth.links.back().motion.walk_sigma();
    bias.gyroscope += walk[0] * random_gaussian_vector(random);
    bias.accelerometer += walk[3] * random_gaussian_vector(random);
  }
}

inline void observe_all(const FlightSimulation& simulation, Random& random,
                        SimulatedFlight& flight) {
  BundleProblem& bundle = flight.truth.bundle;
  for (std::size_t pose = 0; pose < bundle.world_from_body.size(); ++pose) {
    for (std::size_t point = 0; point < bundle.points.size(); ++point) {
      for (int camera = 0; camera < bundle.rig.size(); ++camera) {
        const SE3 world_from_camera =
            bundle.world_from_body[pose] * bundle.rig.body_from_camera[camera];
        const Camera& model = bundle.rig.cameras[camera];
        const auto pixel = model.project(world_from_camera.inverse() * bundle.points[point]);
        if (!pixel || !model.contains(*pixel)) continue;
        const Eigen::Vector2d noise(random.gaussian(), random.gaussian());
        const bool outlier = random.uniform() < simulation.outliers;
        const double shift = outlier ? random.uniform(20, 80) : 0;
        bundle.observations.push_back(
            {static_cast<int>(pose), static_cast<int>(point), camera,
             *pixel + simulation.sigma * noise + Eigen::Vector2d(shift, -shift), simulation.sigma});
        flight.is_outlier.push_back(outlier);
      }
    }
  }
}

}  // namespace internal

inline SimulatedFlight simulate_flight(const FlightSimulation& simulation) {
  Random random(hash_seed(simulation.seed, 77));
  SimulatedFlight flight;
  flight.motion = SimulatedMotion::random(random);
  flight.truth.bundle.rig = forward_rig(simulation.cameras);
  internal::add_states(simulation, random, flight);
  for (int i = 0; i < simulation.points; ++i) {
    const double x = random.uniform(2.5, 6), y = random.uniform(-5, 5), z = random.uniform(-3, 3);
    flight.truth.bundle.points.emplace_back(x, y, z);
  }
  internal::observe_all(simulation, random, flight);
  return flight;
}

// The problem as it would be found: disturbed states and points; the gauge (position and yaw of the
// first pose) stays true, and so do fixed states.
inline InertialBundleProblem disturbed(const SimulatedFlight& flight, double amount,
                                       Random& random) {
  InertialBundleProblem problem = flight.truth;
  BundleProblem& bundle = problem.bundle;
  for (std::size_t i = 0; i < bundle.world_from_body.size(); ++i) {
    if (bundle.pose_fixed[i]) continue;
    Vector6d delta;
    delta << 0.03 * amount * random_gaussian_vector(random),
        0.005 * amount * random_gaussian_vector(random);
    if (i == 0) {
      const Eigen::Vector3d up =
          bundle.world_from_body[0].rotation.conjugate() * Eigen::Vector3d::UnitZ();
      delta.head<3>().setZero();
      delta.tail<3>() -= up * up.dot(delta.tail<3>());
    }
    bundle.world_from_body[i] = se3_plus(bundle.world_from_body[i], delta);
    problem.velocity[i] += 0.1 * amount * random_gaussian_vector(random);
    problem.bias[i] = {};
  }
  for (auto& point : bundle.points) point += 0.05 * amount * random_gaussian_vector(random);
  return problem;
}

// Root mean square distance between the positions of two solutions.
inline double position_error(const BundleProblem& a, const BundleProblem& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.world_from_body.size(); ++i)
    sum += (a.world_from_body[i].translation - b.world_from_body[i].translation).squaredNorm();
  return std::sqrt(sum / static_cast<double>(a.world_from_body.size()));
}

}  // namespace rover
