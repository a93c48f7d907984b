#include "rover/mapping/inertial_mapper.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "rover/map/test_map.h"
#include "rover/optimization/simulated_map.h"

namespace rover {
namespace {

using ::testing::HasSubstr;

constexpr int kFixed = 20;
const Sim3 kVisual(0.4, so3_exp({0.5, 1.2, -0.3}), {1, 2, 3});  // map of vision from the world

FlightSimulation lively(std::uint64_t seed) {
  return {.keyframes = 80, .points = 150, .imu_inflation = 8, .seed = seed};
}

// Mapping of a flight, keyframe by keyframe, with perfect tracking.
class Flight {
 public:
  explicit Flight(const SimulatedFlight& flight, const InertialMapperOptions& options = {})
      : flight_(flight),
        simulated_(flight, kVisual),
        mapper_(options, {}),
        map_(std::make_unique<SharedMap>(simulated_.blank())) {}

  // The map is begun with extrinsics that are wrong.
  void believe(const SE3& body_from_camera) {
    simulated_.believe(body_from_camera);
    map_ = std::make_unique<SharedMap>(simulated_.blank());
  }

  InertialReport step() {
    const KeyframeId id = map_->commit([&](Map& map) { return add(map); });
    InertialReport report;
    if (view()->inertial().aligned) report = mapper_.adjust_window(*map_, id, kFixed, {});
    if (report.event == InertialEvent::kNone) report = mapper_.advance(*map_, id);
    map_->commit([&](Map& map) { simulated_.follow(map); });
    return report;
  }

  bool is_over() const { return next_ >= static_cast<int>(flight_.truth.velocity.size()); }

  // The first event of a kind, or of any but none; empty where the flight is over before.
  std::optional<InertialReport> step_until(InertialEvent event) {
    while (!is_over()) {
      const InertialReport report = step();
      if (report.event == event) return report;
    }
    return std::nullopt;
  }

  // Takes the map as aligned, though it is off by `wrong`.
  void align_wrongly(const Sim3& wrong) {
    map_->commit([&](Map& map) {
      map.transform(wrong * kVisual.inverse());
      simulated_.follow(map);
      for (KeyframeId id = map.newest_keyframe(); id.valid(); id = map.at(id).previous) {
        const auto index = static_cast<std::size_t>(map.at(id).frame.id.value);
        map.set_velocity(id, wrong.scale * (wrong.rotation * flight_.truth.velocity[index]),
                         flight_.truth.bias[index]);
      }
      const Timestamp now = map.at(map.newest_keyframe()).frame.time;
      map.set_inertial({.aligned = true, .begin = now, .refined = now, .scale_sigma = 0.03});
    });
  }

  std::shared_ptr<const Map> view() const { return map_->view(); }

  // The similarity that takes the map's keyframes to the true ones best, and what is left, rms.
  std::pair<Sim3, double> fit() const {
    const auto count = static_cast<Eigen::Index>(view()->keyframes().size());
    Eigen::Matrix3Xd truth(3, count), estimate(3, count);
    Eigen::Index column = 0;
    for (const Keyframe& keyframe : view()->keyframes()) {
      const auto index = static_cast<std::size_t>(keyframe.frame.id.value);
      truth.col(column) = flight_.truth.bundle.world_from_body[index].translation;
      estimate.col(column++) = keyframe.world_from_body().translation;
    }
    const Eigen::Matrix4d fit = Eigen::umeyama(estimate, truth);
    const double scale = fit.block<3, 1>(0, 0).norm();
    const Eigen::Matrix3d turn = fit.topLeftCorner<3, 3>() / scale;
    const Eigen::Matrix3Xd left =
        truth - ((scale * turn * estimate).colwise() + fit.topRightCorner<3, 1>());
    return {Sim3(scale, Eigen::Quaterniond(turn), fit.topRightCorner<3, 1>()),
            std::sqrt(left.squaredNorm() / static_cast<double>(count))};
  }
  double scale_error() const { return std::abs(std::log(fit().first.scale)); }
  double tilt() const {
    return std::acos(std::min(1.0, (fit().first.rotation * Eigen::Vector3d::UnitZ()).z()));
  }

 private:
  KeyframeId add(Map& map) {
    const KeyframeId id = simulated_.add(map, next_++);
    const Keyframe& keyframe = map.at(id);
    if (!map.inertial().aligned || !keyframe.motion) return id;
    const InertialState before = map.at(keyframe.previous).state();
    const Eigen::Vector3d velocity = keyframe.motion->predict(before, gravity_of_z_up()).velocity;
    map.set_velocity(id, velocity, before.bias);
    return id;
  }

  const SimulatedFlight& flight_;
  SimulatedMap simulated_;
  InertialMapper mapper_;
  std::unique_ptr<SharedMap> map_;
  int next_ = 0;
};

TEST(InertialMapper, InitialisesAndRefinesTwice) {
  double squares = 0;
  constexpr int kFlights = 5;
  for (std::uint64_t seed = 1; seed <= kFlights; ++seed) {
    const auto simulated = simulate_flight(lively(seed));
    Flight flight(simulated);
    const auto begin = flight.step_until(InertialEvent::kInitialized);
    ASSERT_TRUE(begin.has_value());
    EXPECT_GT(begin->scale_sigma, 0);
    EXPECT_LE(begin->scale_sigma, 0.05);
    EXPECT_LT(flight.scale_error(), 3 * begin->scale_sigma);
    EXPECT_LT(flight.tilt(), 0.06);
    squares += std::pow(flight.scale_error() / begin->scale_sigma, 2) / kFlights;
    const Timestamp aligned = flight.view()->inertial().begin;
    double sigma = begin->scale_sigma;
    std::vector<double> ages;  // at refinements
    while (const auto refined = flight.step_until(InertialEvent::kRefined)) {
      const Map& map = *flight.view();
      ages.push_back(seconds_between(aligned, map.at(map.newest_keyframe()).frame.time));
      // Until the scale is certain they come often, then twice more at the most.
      EXPECT_TRUE(sigma >= 0.015 || ages.back() < 5.26 || ages.back() > 14.9) << ages.back();
      EXPECT_LT(refined->scale_sigma, sigma);
      sigma = refined->scale_sigma;
      std::printf("seed %d, +%.1f s: scale off by %.2f%%, said to be known to %.2f%%\n",
                  static_cast<int>(seed), ages.back(), 100 * flight.scale_error(), 100 * sigma);
    }
    for (const double wanted : {5.0, 15.0}) {
      const auto near = [&](double age) { return std::abs(age - wanted) < 0.26; };
      EXPECT_EQ(std::ranges::count_if(ages, near), 1) << wanted;
    }
    EXPECT_LT(flight.scale_error(), std::max(0.01, 3 * sigma));
    EXPECT_LT(flight.tilt(), 0.02);
    EXPECT_FALSE(flight.step_until(InertialEvent::kUndone).has_value());
    EXPECT_TRUE(is_consistent(*flight.view()));
  }
  EXPECT_LT(squares, 3);
}

TEST(InertialMapper, SaysWhatIsMissing) {
  const auto simulated = simulate_flight(lively(3));
  InertialMapperOptions options;
  options.initialization.max_scale_sigma = 1e-4;
  Flight flight(simulated, options);
  EXPECT_THAT(flight.step().waiting, HasSubstr("1 of 6 keyframes"));
  InertialReport report;
  for (int i = 1; i < 6; ++i) report = flight.step();
  EXPECT_EQ(report.event, InertialEvent::kNone);
  EXPECT_THAT(report.waiting, HasSubstr("scale is known to"));
  EXPECT_THAT(report.waiting, HasSubstr("needs"));
}

TEST(InertialMapper, UndoesAWrongAlignmentAndAlignsAgain) {
  const auto simulated = simulate_flight(lively(4));
  for (const Sim3& wrong : {Sim3(1.6, Eigen::Quaterniond::Identity(), {0, 0, 0}),
                            Sim3(1, so3_exp({0.4, 0, 0}), {0, 0, 0})}) {
    Flight flight(simulated, {.min_keyframes = 50});  // does not align by itself at first
    for (int i = 0; i < 15; ++i) flight.step();
    const double shape = flight.fit().second;
    flight.align_wrongly(wrong);
    const Timestamp begin = flight.view()->inertial().begin;
    ASSERT_TRUE(flight.step_until(InertialEvent::kUndone).has_value());
    const Map& map = *flight.view();
    EXPECT_LT(seconds_between(begin, map.at(map.newest_keyframe()).frame.time), 3.01);
    EXPECT_FALSE(map.inertial().aligned);
    EXPECT_EQ(map.inertial().undone, map.at(map.newest_keyframe()).frame.time);
    EXPECT_LT(flight.fit().second, shape + 0.005);
    EXPECT_TRUE(is_consistent(map));
    const int left = static_cast<int>(map.keyframes().size());
    ASSERT_TRUE(flight.step_until(InertialEvent::kInitialized).has_value());
    EXPECT_GE(static_cast<int>(flight.view()->keyframes().size()), left + 49);
    EXPECT_LT(flight.scale_error(), 0.03);
    EXPECT_LT(flight.tilt(), 0.02);
  }
}

// Readings of a sensor that is mounted otherwise than its calibration says.
TEST(InertialMapper, ReadingsOfSwappedAxesAlignNothing) {
  auto simulated = simulate_flight(lively(5));
  const Eigen::Matrix3d axes = (Eigen::Matrix3d() << 0, 1, 0, 1, 0, 0, 0, 0, -1).finished();
  for (InertialLink& link : simulated.truth.links) {
    std::vector<ImuSample> samples = link.motion.samples();
    for (ImuSample& sample : samples) {
      sample.angular_velocity = axes * sample.angular_velocity;
      sample.acceleration = axes * sample.acceleration;
    }
    link.motion = Preintegration(samples, ImuBias{}, simulated_noise(8));
  }
  Flight flight(simulated);
  flight.step_until(InertialEvent::kRefined);
  EXPECT_FALSE(flight.view()->inertial().aligned);
}

TEST(InertialMapper, ALongMapIsRefinedInPart) {
  const auto simulated = simulate_flight(lively(6));
  Flight flight(simulated, {.max_refined = 15});
  ASSERT_TRUE(flight.step_until(InertialEvent::kInitialized).has_value());
  while (flight.view()->keyframes().size() <= 60) {
    ASSERT_TRUE(flight.step_until(InertialEvent::kRefined).has_value());
  }
  EXPECT_GT(flight.view()->keyframes().size(), 60u);
  EXPECT_LT(flight.scale_error(), 0.03);
  EXPECT_LT(flight.tilt(), 0.02);
  EXPECT_LT(flight.fit().second, 0.02);  // old and new keyframes are still one map
}

// A clock that is late and cameras that sit elsewhere than was said.
TEST(InertialMapper, CalibratesWhereAskedFor) {
  InertialMapperOptions options;
  options.calibration = {.time_offset = true, .extrinsics = true};
  Vector6d wrong;
  wrong << 0.015, -0.02, 0.01, 0.012, -0.015, 0.01;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    FlightSimulation simulation = lively(seed);
    simulation.late = 0.014;
    const auto simulated = simulate_flight(simulation);
    const SE3& truth = simulated.truth.bundle.rig.body_from_camera[0];
    Flight flight(simulated, options);
    flight.believe(se3_plus(truth, wrong));
    while (!flight.is_over()) flight.step();
    const CalibrationStatus& status = flight.view()->calibration();
    EXPECT_GE(status.changes, 1);
    EXPECT_GE(status.estimates, 1) << status.missing;
    EXPECT_NEAR(seconds_between(0, status.time_offset), 0.014, 4 * status.time_sigma);
    EXPECT_LT(status.time_sigma, 0.001);
    const Vector6d error = se3_minus(flight.view()->rig().body_from_camera[0], truth);
    for (int i = 0; i < 3; ++i) {
      EXPECT_LT(std::abs(error[i]), 4 * status.translation_sigma[i]) << i;
      EXPECT_LT(std::abs(error[3 + i]), 4 * status.rotation_sigma[i]) << i;
    }
    EXPECT_LT(error.tail<3>().norm(), 0.5 * wrong.tail<3>().norm());
    EXPECT_LT(se3_minus(*status.given, se3_plus(truth, wrong)).norm(), 1e-9);
    EXPECT_LT(flight.tilt(), 0.03);
    EXPECT_LT(flight.scale_error(), 0.02);
  }
}

TEST(InertialMapper, LeavesTheCalibrationAloneUnlessAskedFor) {
  FlightSimulation simulation = lively(4);
  simulation.keyframes = 50;
  const auto simulated = simulate_flight(simulation);
  Flight flight(simulated);
  while (!flight.is_over()) EXPECT_NE(flight.step().event, InertialEvent::kCalibrated);
  EXPECT_EQ(flight.view()->calibration().estimated, 0);
  EXPECT_EQ(flight.view()->calibration().changes, 0);
}

}  // namespace
}  // namespace rover
