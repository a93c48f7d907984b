// Poses of a camera from its images:   minimal CALIBRATION.yaml IMAGE...
// The calibration is an EuRoC sensor.yaml or a Kalibr camchain; images are taken for 20 Hz.
#include <cstdio>
#include <exception>
#include <string>

#include <opencv2/imgcodecs.hpp>

#include "rover/datasets/calibration.h"
#include "rover/slam/system.h"

int main(int argc, char** argv) try {
  if (argc < 3) {
    std::fprintf(stderr, "usage: %s CALIBRATION.yaml IMAGE...\n", argv[0]);
    return 2;
  }
  const rover::Rig rig = rover::read_rig_calibration(argv[1]).rig.in_camera_frame();
  rover::System slam(rover::Config(), rig, rover::Mode::kMono);

  for (int i = 2; i < argc; ++i) {
    const cv::Mat image = cv::imread(argv[i], cv::IMREAD_GRAYSCALE);
    const rover::TrackingResult result = slam.add_images(rover::from_seconds(0.05 * i), image);
    std::printf("%s: %s, %d inliers\n", argv[i], to_string(result.state), result.inliers);
  }
  slam.finish();

  if (const auto map = slam.largest_map()) {
    for (const rover::FinalPose& pose : slam.trajectory(*map)) {
      const auto& p = pose.world_from_body.translation;
      const std::string time = rover::format_seconds(pose.time);
      std::printf("%s %.4f %.4f %.4f\n", time.c_str(), p.x(), p.y(), p.z());
    }
  }
} catch (const std::exception& error) {
  std::fprintf(stderr, "minimal: %s\n", error.what());
  return 2;
}
