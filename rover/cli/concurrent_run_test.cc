// The system with mapping on a thread of its own, as fast as frames come: not paced as `rover run
// --realtime` is, so that the thread sanitizer, too, sees tracking and mapping at work together.
#include <gtest/gtest.h>

#include "rover/cli/finished_run.h"
#include "rover/slam/system.h"

namespace rover {
namespace {

constexpr double kClipError = 0.024;  // m

Trajectory poses_of(const std::vector<FinalPose>& trajectory) {
  Trajectory poses;
  for (const FinalPose& pose : trajectory) poses.push_back({pose.time, pose.world_from_body});
  return poses;
}

TEST(ConcurrentRun, TracksWhileItMaps) {
  SKIP_UNLESS_PRESENT(kClip);
  DatasetOptions input;
  input.path = sequence_folder(kClip);
  input.inertial = true;
  const auto dataset = open_dataset(input);
  Config config;
  config.execution = Execution::kConcurrent;
  System system(config, dataset->rig(), Mode::kMonoInertial, {}, dataset->imu_calibration());
  Offered offered;
  std::size_t keyframes = 0, mapped = 0;
  while (const auto frame = dataset->next()) {
    if (offered.frames++ == 0) offered.first = frame->time;
    offered.last = frame->time;
    for (const ImuSample& sample : frame->imu) system.add_imu(sample);
    keyframes += system.add_images(frame->time, frame->images[0]).new_keyframe.valid();
    mapped += system.take_mapping_records().size();
    for (const auto& map : system.maps()) EXPECT_GT(map->keyframes().size(), 0u);
  }
  system.finish();
  mapped += system.take_mapping_records().size();
  system.adjust_largest_map();
  EXPECT_GT(keyframes, 5u);
  EXPECT_GE(mapped, keyframes);  // the first two, which begin the map, besides
  ASSERT_EQ(system.maps().size(), 1u);
  EXPECT_TRUE(system.maps()[0]->inertial().aligned);
  const Trajectory poses = poses_of(system.trajectory(*system.largest_map()));
  const Judgement found = judge("concurrent", poses, dataset->ground_truth(), 0.02, offered);
  ASSERT_TRUE(found.rigid.has_value());
  std::printf("V1_01 clip, mono-inertial, concurrent: ATE SE(3) %.4f m\n",
              found.rigid->position.rmse);
  EXPECT_GE(found.coverage.value(), 0.95);
  EXPECT_LE(found.rigid->position.rmse, kClipError);
}

}  // namespace
}  // namespace rover
