#include <algorithm>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "rover/base/error.h"
#include "rover/base/thread_pool.h"
#include "rover/datasets/dataset.h"
#include "rover/datasets/test_folder.h"
#include "rover/datasets/test_sequences.h"
#include "rover/simulation/flight.h"
#include "rover/simulation/rigs.h"
#include "rover/simulation/scene_rays.h"
#include "rover/simulation/sequence_simulation.h"
#include "rover/simulation/sequence_writer.h"
#include "rover/simulation/texture_surfaces.h"

namespace rover {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr Timestamp kEpoch = 1'000'000'000'000;

Rig small_rig() {
  const Camera camera(CameraModel::kPinhole, 96, 64, {60, 60, 47.5, 31.5}, {-0.1, 0.01, 0, 0});
  SE3 right;
  right.translation.x() = 0.1;
  return {{camera, camera}, {SE3(), right}};
}

SequenceOptions small_sequence(const TestFolder& folder, const std::string& name) {
  SequenceOptions options;
  options.output = folder / name;
  options.cache = folder / "cache";
  options.rig = small_rig();
  options.scene.low_texture = true;  // quicker to paint
  options.scene.moving_objects = 2;
  options.render.samples = 2;
  options.lighting = LightingStyle::kSweep;
  options.frame_rate = 4;
  return options;
}

void write(const SequenceOptions& options, int threads) {
  ThreadPool pool(threads);
  const Scene scene = make_scene(options.scene, pool);
  FlightOptions flight;
  flight.duration = 1;
  const SplineMotion motion = make_flight(scene.flight_volume, flight);
  const ImuRecording imu = synthesize_imu(motion, kEpoch);
  write_sequence(options, scene, {motion, kEpoch, imu, euroc_imu_calibration()}, pool,
                 [](std::size_t, std::size_t) {});
}

std::map<std::string, std::string> contents(const TestFolder& folder, const std::string& name) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder / name)) {
    if (!entry.is_regular_file()) continue;
    const std::string path = fs::relative(entry.path(), folder / name).string();
    files[path] = folder.read(name + "/" + path);
  }
  return files;
}

class WholeSequence : public ::testing::Test {
 protected:
  WholeSequence() { write(small_sequence(folder_, "a"), 1); }
  TestFolder folder_;
};

TEST_F(WholeSequence, HasTheSameBytesWithTwoThreads) {
  SequenceOptions options = small_sequence(folder_, "b");
  options.cache = folder_ / "other-cache";
  write(options, 2);
  const auto a = contents(folder_, "a"), b = contents(folder_, "b");
  EXPECT_GT(a.size(), 12U);
  EXPECT_EQ(a, b);
}

TEST_F(WholeSequence, AnotherSeedRendersNothingAgain) {
  const auto cache = contents(folder_, "cache");
  SequenceOptions options = small_sequence(folder_, "b");
  options.seed = 7;
  write(options, 2);
  EXPECT_EQ(contents(folder_, "cache"), cache);
  const auto a = contents(folder_, "a"), b = contents(folder_, "b");
  ASSERT_EQ(a.size(), b.size());
  for (const auto& [name, bytes] : a) {
    EXPECT_EQ(b.at(name) != bytes, name.ends_with(".png")) << name;
  }
}

TEST_F(WholeSequence, IsReadAsEurocStereoWithItsGroundTruth) {
  DatasetOptions options;
  options.path = folder_ / "a";
  options.stereo = true;
  options.inertial = true;
  const auto dataset = open_dataset(options);
  EXPECT_TRUE(dataset->notes().empty());
  EXPECT_EQ(dataset->size(), 5U);
  EXPECT_NEAR(dataset->rig().baseline(), 0.1, 1e-9);
  EXPECT_EQ(dataset->ground_truth().size(), 201U);
  int frames = 0;
  while (const auto frame = dataset->next()) {
    EXPECT_EQ(frame->time, kEpoch + 250'000'000 * frames++);
    ASSERT_EQ(frame->images.size(), 2U);
    EXPECT_FALSE(frame->images[1].empty());
  }
  EXPECT_EQ(frames, 5);
}

TEST(SequenceWriter, UnfinishedSequencesLeaveNothing) {
  const TestFolder folder;
  {
    SequenceWriter writer(folder / "flight", false);
    writer.add_cameras(small_rig(), 20, {1, 2});
    writer.add_image(0, 1, cv::Mat(64, 96, CV_8U, cv::Scalar(9)));
    EXPECT_FALSE(fs::exists(folder / "flight"));  // as a killed program leaves it
    EXPECT_TRUE(fs::exists(folder / "flight.partial"));
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(SequenceWriter, ReplacesOnlyWhenTold) {
  const TestFolder folder;
  folder.write("flight/old.txt", "old");
  const std::string message =
      input_error_of([&] { SequenceWriter writer(folder / "flight", false); });
  EXPECT_THAT(message, HasSubstr("--overwrite"));
  SequenceWriter writer(folder / "flight/", true);
  writer.add_folder("imu0");
  EXPECT_TRUE(fs::exists(folder / "flight/old.txt"));
  writer.finish();
  EXPECT_FALSE(fs::exists(folder / "flight/old.txt"));
  EXPECT_TRUE(fs::is_directory(folder / "flight/mav0/imu0"));
}

TEST(SequenceWriter, SaysWhereItCannotWrite) {
  const TestFolder folder;
  folder.write("file", "");
  EXPECT_THAT(input_error_of([&] { SequenceWriter writer(folder / "file/flight", false); }),
              HasSubstr("cannot be written"));
  EXPECT_THAT(input_error_of([&] { SequenceWriter writer(folder / "file", true); }),
              HasSubstr("not a folder"));
}

TEST(Rigs, AreBuiltInOrReadFromFiles) {
  EXPECT_EQ(make_rig("euroc").size(), 2);
  EXPECT_NEAR(make_rig("tumvi").baseline(), 0.101, 1e-3);
  EXPECT_EQ(make_rig("mono").size(), 1);
  EXPECT_EQ(make_rig("paper").cameras[0].width(), 1440);
  const TestFolder folder;
  write_euroc(folder);
  EXPECT_NEAR(make_rig(folder.path().string()).baseline(), 0.1, 1e-9);
  EXPECT_EQ(make_rig((folder / "mav0/cam0/sensor.yaml").string()).size(), 1);
}

TEST(Rigs, RefuseWhatCannotBeRendered) {
  const TestFolder folder;
  for (const auto& [width, height] : {std::pair(641, 480), {640, 481}, {16, 16}, {20000, 400}}) {
    folder.write("sensor.yaml", camera_yaml(width, height));
    EXPECT_THAT(input_error_of([&] { make_rig(folder.path().string()); }),
                HasSubstr(fmt::format("{} x {}", width, height)));
  }
  EXPECT_THAT(input_error_of([] { make_rig("hexapod"); }), HasSubstr("hexapod"));
  fs::remove(folder / "sensor.yaml");
  EXPECT_THAT(input_error_of([&] { make_rig(folder.path().string()); }), HasSubstr("sensor.yaml"));
}

TEST(Rigs, CalibrationErrorIsAsLargeAsAskedFor) {
  for (const Camera& camera : {make_rig("euroc").cameras[0], make_rig("tumvi").cameras[0]}) {
    const Camera other = disturbed_camera(camera, 0.5, 3);
    double sum = 0;
    int count = 0;
    for (int y = 10; y < camera.height(); y += 20) {
      for (int x = 10; x < camera.width(); x += 20) {
        const Eigen::Vector2d pixel(x, y);
        const auto ray = camera.unproject(pixel);
        if (!ray || !other.project(*ray)) continue;
        sum += (*other.project(*ray) - pixel).squaredNorm();
        ++count;
      }
    }
    EXPECT_NEAR(std::sqrt(sum / count), 0.5, 0.03);
  }
}

TEST(Scenes, RefuseWhatCannotBeBuilt) {
  ThreadPool pool(1);
  const TestFolder folder;
  folder.write("notes.txt", "no image");
  folder.write("broken.png", "no image either");
  SceneOptions options;
  options.photographs = folder.path();
  EXPECT_THAT(input_error_of([&] { make_scene(options, pool); }), HasSubstr("no usable image"));
  options.photographs = folder / "nothing";
  EXPECT_THAT(input_error_of([&] { make_scene(options, pool); }), HasSubstr("cannot be read"));
  options = {};
  options.kind = SceneKind::kStreet;
  options.around = {Eigen::Vector3d::Zero()};
  EXPECT_THAT(input_error_of([&] { make_scene(options, pool); }), HasSubstr("room or hall"));
  EXPECT_THAT(input_error_of([] { parse_scene_kind("moon"); }), HasSubstr("moon"));
}

TEST(Scenes, LeaveRealFlightsFree) {
  ThreadPool pool(2);
  SceneOptions options;
  options.low_texture = true;
  for (int i = 0; i < 200; ++i) {
    options.around.push_back({2 * std::cos(0.05 * i), 1.5 * std::sin(0.07 * i), 1 + 0.002 * i});
  }
  const Scene scene = make_scene(options, pool);
  const SceneRays rays(scene.patches);
  for (const Eigen::Vector3d& place : options.around) {
    for (int i = 0; i < 26; ++i) {
      const Eigen::Vector3f direction(static_cast<float>(i % 3 - 1),
                                      static_cast<float>(i / 3 % 3 - 1),
                                      static_cast<float>(i / 9 - 1));
      if (direction.norm() < 0.5F) continue;
      EXPECT_FALSE(rays.blocked(place.cast<float>(), direction.normalized(), 0.4F));
    }
  }
}

// How well a piece of a texture fits anywhere else in it.
double best_repetition(const cv::Mat& texture, int edge) {
  const cv::Rect piece(texture.cols / 8, texture.rows / 8, edge, edge);
  cv::Mat fit;
  cv::matchTemplate(texture, texture(piece), fit, cv::TM_CCOEFF_NORMED);
  const cv::Rect around(piece.x - edge / 2, piece.y - edge / 2, edge, edge);
  fit(around & cv::Rect({0, 0}, fit.size())).setTo(0);
  double best = 0;
  cv::minMaxLoc(fit, nullptr, &best);
  return best;
}

TEST(Textures, DoNotRepeat) {
  for (const Surface surface :
       {Surface::kPlaster, Surface::kBrick, Surface::kWood, Surface::kConcrete, Surface::kCarpet,
        Surface::kTiles, Surface::kFabric, Surface::kPoster, Surface::kAsphalt}) {
    SurfacePaint paint;
    paint.surface = surface;
    paint.size = {2.5, 2.5};
    paint.texel = 0.01;
    EXPECT_LT(best_repetition(paint_surface(paint), 60), 0.8) << static_cast<int>(surface);
    const cv::Mat first = paint_surface(paint);
    paint.seed = 1;
    cv::Mat difference;
    cv::absdiff(first, paint_surface(paint), difference);
    EXPECT_GT(cv::mean(difference)[0], 2);
  }
}

}  // namespace
}  // namespace rover
