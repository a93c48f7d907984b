// `rover check` from end to end: a small simulated flight as it is, and copies broken on purpose.
#include <algorithm>
#include <array>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "rover/base/thread_pool.h"
#include "rover/cli/test_program.h"
#include "rover/datasets/test_folder.h"
#include "rover/datasets/test_sequences.h"
#include "rover/networks/runtime.h"
#include "rover/simulation/flight.h"
#include "rover/simulation/sequence_simulation.h"

namespace rover {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

Outcome call(const std::vector<std::string>& arguments) {
  return call_subcommand("check", arguments);
}

// Two cameras, turned against the inertial sensor as on many robots: the body's x is forward.
Rig test_rig() {
  const Camera camera(CameraModel::kPinhole, 376, 240, {229, 228.5, 187.5, 119.5},
                      {-0.28, 0.07, 0, 0});
  Eigen::Matrix3d body_from_camera;
  body_from_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const SE3 left(body_from_camera, {0.05, 0.055, 0}), right(body_from_camera, {0.05, -0.055, 0});
  return {{camera, camera}, {left, right}};
}

void write_flight(const fs::path& output) {
  constexpr Timestamp kEpoch = 1'000'000'000'000;
  SequenceOptions options;
  options.output = output;
  options.rig = test_rig();
  options.render.samples = 2;
  ThreadPool pool(2);
  const Scene scene = make_scene(options.scene, pool);
  FlightOptions flight;
  flight.duration = 8;
  flight.style = FlightStyle::kAggressive;
  flight.body_from_camera = options.rig.body_from_camera[0];
  const SplineMotion motion = make_flight(scene.flight_volume, flight);
  const ImuRecording imu = synthesize_imu(motion, kEpoch);
  write_sequence(options, scene, {motion, kEpoch, imu, euroc_imu_calibration()}, pool,
                 [](std::size_t, std::size_t) {});
}

class Check : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (!have_models()) return;
    good_ = new TestFolder;
    write_flight(*good_ / "flight");
  }
  static void TearDownTestSuite() {
    delete good_;
    good_ = nullptr;
  }
  void SetUp() override {
    if (!good_) GTEST_SKIP() << "the models are not here; the set-up makes them";
    copy_ = folder_ / "flight";
    const fs::path good = *good_ / "flight";
    for (const auto& entry : fs::recursive_directory_iterator(good)) {
      const fs::path place = copy_ / fs::relative(entry.path(), good);
      if (entry.is_directory()) {
        fs::create_directories(place);
      } else {
        fs::create_symlink(entry.path(), place);
      }
    }
  }

  // The text of a file of the copy, after `change` of each line that is not a comment.
  template <class Change>
  void change_rows(const std::string& name, const Change& change) {
    std::istringstream lines(folder_.read("flight/mav0/" + name));
    std::string line, text;
    for (int row = 0; std::getline(lines, line); ++row)
      text += line.starts_with('#') ? line + '\n' : change(row, line);
    replace(name, text);
  }
  void replace(const std::string& name, const std::string& text) {
    fs::remove(copy_ / "mav0" / name);  // a link to the good one
    folder_.write("flight/mav0/" + name, text);
  }
  // Readings as (stamp, wx, wy, wz, ax, ay, az), changed by `change`.
  template <class Change>
  void change_imu(const Change& change) {
    change_rows("imu0/data.csv", [&](int, const std::string& line) {
      std::istringstream fields(line);
      Timestamp time = 0;
      std::array<double, 6> v{};
      char comma = 0;
      fields >> time;
      for (double& value : v) fields >> comma >> value;
      change(time, v);
      return fmt::format("{},{},{},{},{},{},{}\n", time, v[0], v[1], v[2], v[3], v[4], v[5]);
    });
  }

  Outcome check(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"--dataset", copy_.string()});
    return call(more);
  }
  // The names of what is warned of; the exit status says whether there are any.
  std::vector<std::string> warnings() const {
    const Outcome outcome = check({"--json"});
    std::vector<std::string> names;
    const auto report = nlohmann::json::parse(outcome.out);
    for (const auto& finding : report["findings"])
      if (finding["severity"] == "warning") names.push_back(finding["name"]);
    EXPECT_EQ(outcome.status, names.empty() ? 0 : 1) << outcome.err;
    return names;
  }

  static inline TestFolder* good_ = nullptr;
  TestFolder folder_;
  fs::path copy_;
};

TEST_F(Check, FindsNothingWrongWithAGoodFlight) {
  EXPECT_THAT(warnings(), IsEmpty());
  const Outcome outcome = check();
  EXPECT_EQ(outcome.status, 0);
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("calibration\n  ok"), HasSubstr("epipolar"),
                                 HasSubstr("inertial time = image time"), HasSubstr("0 warnings")));
  EXPECT_EQ(outcome.out, check().out);
}

TEST_F(Check, NamesWrongUnits) {
  change_imu([](Timestamp&, auto& v) {
    for (int i = 0; i < 3; ++i) v[i] *= 57.29578;
    for (int i = 3; i < 6; ++i) v[i] /= 9.81;
  });
  EXPECT_THAT(warnings(), AllOf(Contains("imu_data"), Contains("gyroscope_scale")));
  EXPECT_THAT(check().out, AllOf(HasSubstr("look like g"), HasSubstr("look like deg/s")));
}

TEST_F(Check, NamesSwappedAxes) {
  change_imu([](Timestamp&, auto& v) {
    std::swap(v[0], v[1]);
    std::swap(v[4], v[5]);
  });
  EXPECT_THAT(warnings(), AllOf(Contains("gyroscope_axes"), Contains("accelerometer_axes")));
  EXPECT_THAT(check().out, AllOf(HasSubstr("fit as (y, x, z)"), HasSubstr("fit as (x, z, y)")));
}

TEST_F(Check, NamesClocksThatAreApart) {
  change_imu([](Timestamp& time, auto&) { time += 20'000'000; });
  EXPECT_THAT(warnings(), ElementsAre("time_offset"));
  EXPECT_THAT(check().out, HasSubstr("inertial time = image time + "));
}

TEST_F(Check, NamesTurnedExtrinsics) {
  const auto turn = [this](const std::string& name, const SE3& body_from_camera) {
    std::string yaml = folder_.read("flight/mav0/" + name);
    const auto begin = yaml.find("data: ["), end = yaml.find(']', begin);
    std::string data = "data: [";
    const Eigen::Matrix4d matrix = body_from_camera.matrix();
    for (int i = 0; i < 16; ++i) data += fmt::format("{}{}", i ? ", " : "", matrix(i / 4, i % 4));
    replace(name, yaml.replace(begin, end - begin, data));
  };
  const Rig rig = test_rig();
  const SE3 tilt(so3_exp({0.07, 0.05, 0}), Eigen::Vector3d::Zero());
  turn("cam0/sensor.yaml", rig.body_from_camera[0] * tilt);
  EXPECT_THAT(warnings(), AllOf(Contains("epipolar_error"), Contains("extrinsic_rotation")));
  // Both alike: the pair is in order, its place on the body is not.
  turn("cam1/sensor.yaml", tilt * rig.body_from_camera[1]);
  turn("cam0/sensor.yaml", tilt * rig.body_from_camera[0]);
  EXPECT_THAT(warnings(), ElementsAre("extrinsic_rotation"));
}

TEST_F(Check, NamesGaps) {
  change_rows("cam0/data.csv", [](int row, const std::string& line) {
    return row > 60 && row <= 80 ? std::string() : line + '\n';
  });
  change_rows("imu0/data.csv", [](int row, const std::string& line) {
    return row > 1200 && row < 1300 ? std::string() : line + '\n';
  });
  EXPECT_THAT(warnings(), AllOf(Contains("image_gaps"), Contains("imu_data")));
  EXPECT_THAT(check().out, HasSubstr("the longest of 1.05"));
}

TEST_F(Check, NamesSwappedImages) {
  fs::rename(copy_ / "mav0/cam0/data", copy_ / "mav0/cam0/other");
  fs::rename(copy_ / "mav0/cam1/data", copy_ / "mav0/cam0/data");
  fs::rename(copy_ / "mav0/cam0/other", copy_ / "mav0/cam1/data");
  const Outcome outcome = check({"--mode", "stereo"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.out, HasSubstr("left and right images are swapped"));
}

TEST(CheckInput, IsRefusedInOneLine) {
  const TestFolder folder;
  write_euroc(folder);
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"--dataset", (folder / "none").string()},
        {"--dataset", folder.path().string(), "--mode", "trio"},
        {"--dataset", folder.path().string(), "--mode", "mono-thermal"},
        {"--dataset", folder.path().string(), "--family", "none"},
        {"--dataset", folder.path().string(), "--samples", "0"},
        {}}) {
    const Outcome outcome = call(arguments);
    EXPECT_EQ(outcome.status, 2);
    EXPECT_THAT(outcome.err, StartsWith("rover: "));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
}

}  // namespace
}  // namespace rover
