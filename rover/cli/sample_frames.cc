#include "rover/cli/sample_frames.h"

#include <algorithm>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "rover/datasets/atomic_file.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kKept = 16;
constexpr std::size_t kDrawn = 8;
constexpr int kWidth = 440;  // px

void remove_pictures(const fs::path& folder) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".jpg") fs::remove(entry.path(), ignored);
  }
}

void draw_points(const std::vector<Eigen::Vector2f>& points, double scale, int radius,
                 const cv::Scalar& color, cv::Mat& picture) {
  constexpr int kShift = 3;  // sub-pixel bits
  for (const Eigen::Vector2f& point : points) {
    const cv::Point centre(cvRound(8 * scale * (point.x() + 0.5)),
                           cvRound(8 * scale * (point.y() + 0.5)));
    cv::circle(picture, centre, radius, color, cv::FILLED, cv::LINE_AA, kShift);
  }
}

}  // namespace

void SampleFrames::offer(const cv::Mat& image, const TrackingResult& result, const System& system) {
  if (!result.new_keyframe.valid() || keyframes_++ % stride_ != 0) return;
  const auto maps = system.maps();
  const auto map = static_cast<std::size_t>(result.anchored.map.value);
  const Keyframe* keyframe = map < maps.size() ? maps[map]->find(result.new_keyframe) : nullptr;
  if (!keyframe) return;
  Sample sample{result.anchored.time, image, {}, {}};
  for (const Observation& observation : keyframe->frame.observations) {
    (observation.landmark.valid() ? sample.joined : sample.free).push_back(observation.pixel);
  }
  if (sample.joined.empty()) return;  // the second of the two that a map begins with
  samples_.push_back(std::move(sample));
  if (samples_.size() < kKept) return;
  for (std::size_t i = 0; i < kKept / 2; ++i) samples_[i] = std::move(samples_[2 * i]);
  samples_.resize(kKept / 2);
  stride_ *= 2;
}

void SampleFrames::write(const fs::path& folder) const {
  const fs::path pictures = folder / "samples";
  std::error_code error;
  fs::create_directories(pictures, error);
  require(!error, "{}: cannot be made ({})", pictures.string(), error.message());
  remove_pictures(pictures);
  const std::size_t count = std::min(kDrawn, samples_.size());
  for (std::size_t i = 0; i < count; ++i) {
    const Sample& sample = samples_[count < 2 ? 0 : i * (samples_.size() - 1) / (count - 1)];
    const double scale = static_cast<double>(kWidth) / sample.image.cols;
    cv::Mat picture;
    cv::resize(sample.image, picture, {}, scale, scale, cv::INTER_AREA);
    cv::cvtColor(picture, picture, cv::COLOR_GRAY2BGR);
    draw_points(sample.free, scale, 10, {170, 170, 170}, picture);
    draw_points(sample.joined, scale, 16, {60, 220, 60}, picture);
    std::vector<std::uint8_t> bytes;
    cv::imencode(".jpg", picture, bytes, {cv::IMWRITE_JPEG_QUALITY, 80});
    write_file_atomically(pictures / (format_seconds(sample.time) + ".jpg"),
                          {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }
}

}  // namespace rover
