#pragma once

#include <vector>

#include "rover/optimization/camera_imu_calibration.h"
#include "rover/optimization/robust_kernel.h"

namespace rover {

// The unknowns of a calibration between camera and inertial sensor.
struct CalibrationState {
  double time_offset = 0;  // s, that the motions at hand are still off by
  SE3 body_from_camera;
  Eigen::Quaterniond world_from_aligned = Eigen::Quaterniond::Identity();  // gravity is along -z
  ImuBias bias;
  std::vector<SE3> world_from_camera;
  std::vector<Eigen::Vector3d> velocity;

  Eigen::Vector3d gravity() const { return world_from_aligned * gravity_of_z_up(); }
  InertialState body(std::size_t keyframe) const;
};

// What the inertial sensor reads where a keyframe's stamp lies on its clock.
struct Reading {
  Eigen::Vector3d angular_velocity;  // rad/s, body
  Eigen::Vector3d acceleration;      // m/s^2, world, gravity included
};

// The body `time` seconds after a state, as a reading tells; with its Jacobians by the state, and
// by the time.
InertialState carried(const InertialState& state, const Reading& reading, double time,
                      Matrix15d* by_state = nullptr, Vector15d* by_time = nullptr);

// The problem as LevenbergMarquardt wants it, for motions that are cut for about the right offset.
// Unknowns: offset, extrinsics (6), gravity's direction (2), bias (6), then of each keyframe camera
// pose (6) and velocity (3).
class CalibrationModel {
 public:
  using State = CalibrationState;
  using Equations = DenseEquations;
  using Step = DenseStep;
  static constexpr int kOffset = 0, kExtrinsics = 1, kGravity = 7, kBias = 9, kStates = 15;
  static constexpr int kStride = 9;

  // `cut_offset`: s, what was taken from the motions' stamps already.
  CalibrationModel(const CalibrationProblem& problem, const CalibrationOptions& options,
                   std::vector<Preintegration> motions, std::vector<Reading> readings,
                   double cut_offset);

  // Leaves the calibration as it is.
  void hold_calibration() { offset_free_ = extrinsics_free_ = false; }
  // Motions that do not fit lose weight.
  void make_robust() { robust_ = true; }

  void linearize(const State& state, Equations& equations) const;
  bool solve(const Equations& equations, const Damping& damping, Step& step) const {
    return solve_damped(equations, damping, step);
  }
  void move(const State& from, const Step& step, State& to) const;

  double chi2(const State& state, std::size_t motion) const;
  double weight(double chi2) const { return robust_ ? kernel_.weight(chi2) : 1; }
  std::size_t motions() const { return motions_.size(); }

 private:
  void add_motion(const State& state, std::size_t i, Equations& equations) const;
  void add_vision(const State& state, Equations& equations) const;
  void add_priors(const State& state, Equations& equations) const;
  void hold(int first, int count, Equations& equations) const;

  const CalibrationProblem& problem_;
  CalibrationOptions options_;
  std::vector<Preintegration> motions_;
  std::vector<Reading> readings_;
  double cut_offset_;
  HuberKernel kernel_;
  bool robust_ = false;
  bool offset_free_, extrinsics_free_;
};

}  // namespace rover
