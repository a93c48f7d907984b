#include "rover/diagnosis/visual_motion.h"

#include <algorithm>

#include <Eigen/Eigenvalues>

#include "rover/slam/system.h"

namespace rover {
namespace {

constexpr double kLongestGap = 0.3;  // s between images that tracking is asked to bridge
constexpr double kSlide = 1;         // s between the spans that are compared
constexpr double kHighestRate = 25;  // Hz; of faster cameras frames are left out

// The stretches without gap: indices of first and last image.
std::vector<std::pair<std::size_t, std::size_t>> runs_of(std::span<const Timestamp> images) {
  std::vector<std::pair<std::size_t, std::size_t>> runs;
  std::size_t first = 0;
  for (std::size_t i = 1; i <= images.size(); ++i) {
    if (i < images.size() && seconds_between(images[i - 1], images[i]) <= kLongestGap) continue;
    if (i - first > 1) runs.emplace_back(first, i - 1);
    first = i;
  }
  return runs;
}

// How much is turned about the second most lively axis.
double liveliness(std::span<const ImuSample> imu, const TimeSpan& span) {
  const auto before = [](const ImuSample& sample, Timestamp time) { return sample.time < time; };
  const auto begin = std::lower_bound(imu.begin(), imu.end(), span.begin, before);
  const auto end = std::lower_bound(begin, imu.end(), span.end, before);
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (auto sample = begin; sample != end; ++sample) {
    squares += sample->angular_velocity * sample->angular_velocity.transpose();
    sum += sample->angular_velocity;
  }
  const auto count = static_cast<double>(end - begin);
  if (count < 1) return -1;
  squares -= sum * sum.transpose() / count;
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(squares).eigenvalues()[1];
}

// Frames of a span, at a rate that is enough for tracking.
class SpanReader {
 public:
  SpanReader(const DatasetOptions& input, const TimeSpan& span)
      : dataset_(open_dataset(input)), span_(span) {}

  const Rig& rig() const { return dataset_->rig(); }
  std::optional<SensorFrame> next() {
    while (auto frame = dataset_->next()) {
      if (frame->time > span_.end) return std::nullopt;
      if (frame->time < due_ || frame->time < span_.begin || !frame->usable()) continue;
      due_ = frame->time + from_seconds(0.9 / kHighestRate);
      return frame;
    }
    return std::nullopt;
  }

 private:
  std::unique_ptr<Dataset> dataset_;
  TimeSpan span_;
  Timestamp due_ = 0;
};

struct VisualRun {
  Trajectory poses;
  std::size_t frames = 0;
};

VisualRun track(DatasetOptions input, const TimeSpan& span, const Config& config, Mode mode) {
  input.stereo = mode == Mode::kStereo;
  SpanReader reader(input, span);
  System system(config, reader.rig().in_camera_frame(), mode);
  VisualRun run;
  while (const auto frame = reader.next()) {
    system.add_images(frame->time, frame->images[0],
                      frame->images.size() > 1 ? frame->images[1] : cv::Mat());
    ++run.frames;
  }
  system.adjust_largest_map();
  const auto map = system.largest_map();
  if (!map) return run;
  for (const FinalPose& pose : system.trajectory(*map))
    run.poses.push_back({pose.time, pose.world_from_body});
  return run;
}

}  // namespace

std::optional<TimeSpan> liveliest_span(std::span<const Timestamp> images,
                                       std::span<const ImuSample> imu, double length) {
  std::optional<TimeSpan> best;
  double most = -1;
  for (const auto& [first, last] : runs_of(images)) {
    Timestamp begin = images[first];
    do {
      const TimeSpan span{begin, std::min(images[last], begin + from_seconds(length))};
      const double lively = liveliness(imu, span);
      if (lively > most) best = span, most = lively;
      begin += from_seconds(kSlide);
    } while (begin + from_seconds(length) <= images[last]);
  }
  return best;
}

Trajectory visual_motion(DatasetOptions input, const TimeSpan& span, const Config& config) {
  const bool stereo = input.stereo;
  input.inertial = false;
  VisualRun run = track(input, span, config, Mode::kMono);
  if (stereo && 2 * run.poses.size() < run.frames) run = track(input, span, config, Mode::kStereo);
  return run.poses;
}

}  // namespace rover
