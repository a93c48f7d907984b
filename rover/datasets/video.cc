// A video file with a calibration file beside it.
#include <utility>

#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "rover/base/error.h"
#include "rover/datasets/sequence.h"

namespace rover {
namespace {

constexpr double kDefaultRate = 30;  // Hz, where neither the user nor the container tells

class VideoDataset : public Dataset {
 public:
  VideoDataset(cv::VideoCapture capture, Rig rig, double rate)
      : capture_(std::move(capture)), rig_(std::move(rig)), rate_(rate) {}

  const Rig& rig() const override { return rig_; }
  const std::optional<ImuCalibration>& imu_calibration() const override { return imu_; }
  const Trajectory& ground_truth() const override { return ground_truth_; }
  const std::vector<std::string>& notes() const override { return notes_; }
  std::size_t size() const override {
    const double count = capture_.get(cv::CAP_PROP_FRAME_COUNT);
    return count > 0 && count < 1e9 ? static_cast<std::size_t>(count) : 0;
  }

  std::optional<SensorFrame> next() override {
    cv::Mat image;
    if (!read(image)) return std::nullopt;
    SensorFrame frame;
    frame.index = next_frame_++;
    frame.time = from_seconds(static_cast<double>(frame.index) / rate_);
    const bool fits = image.cols == rig_.cameras[0].width() &&
                      image.rows == rig_.cameras[0].height() && image.depth() == CV_8U;
    frame.problems.push_back(fits ? "" : "the video changes its image size");
    frame.images.push_back(fits ? to_gray(image) : cv::Mat());
    return frame;
  }

 private:
  bool read(cv::Mat& image) {
    try {
      return capture_.read(image) && !image.empty();
    } catch (const cv::Exception&) {
      return false;
    }
  }

  static cv::Mat to_gray(const cv::Mat& image) {
    cv::Mat gray;
    if (image.channels() == 1) {
      gray = image.clone();
    } else {
      cv::cvtColor(image, gray, image.channels() == 4 ? cv::COLOR_BGRA2GRAY : cv::COLOR_BGR2GRAY);
    }
    return gray;
  }

  cv::VideoCapture capture_;
  Rig rig_;
  double rate_;
  std::int64_t next_frame_ = 0;
  std::optional<ImuCalibration> imu_;
  Trajectory ground_truth_;
  std::vector<std::string> notes_;
};

cv::VideoCapture open_capture(const std::filesystem::path& file) {
  cv::VideoCapture capture;
  try {
    // Other backends print errors of their own for what is no video, and leak.
    capture.open(file.string(), cv::CAP_FFMPEG);
  } catch (const cv::Exception&) {
    capture.release();
  }
  require(capture.isOpened(), "{}: not a video that can be decoded", file.string());
  return capture;
}

double choose_rate(const DatasetOptions& options, const cv::VideoCapture& capture) {
  if (options.frame_rate > 0) return options.frame_rate;
  const double own = capture.get(cv::CAP_PROP_FPS);
  return own > 0.1 && own < 10000 ? own : kDefaultRate;
}

}  // namespace

std::unique_ptr<Dataset> open_video(const DatasetOptions& options) {
  require_monocular(options, "a video");
  require(options.calibration.has_value(),
          "{}: a video says nothing about its camera; give --calibration FILE",
          options.path.string());
  const Camera camera = read_rig_calibration(*options.calibration).rig.cameras.front();
  cv::VideoCapture capture = open_capture(options.path);
  const int width = static_cast<int>(capture.get(cv::CAP_PROP_FRAME_WIDTH));
  const int height = static_cast<int>(capture.get(cv::CAP_PROP_FRAME_HEIGHT));
  require(width == camera.width() && height == camera.height(),
          "{}: {}x{} px, but {} is for {}x{}; give the calibration of this camera",
          options.path.string(), width, height, options.calibration->string(), camera.width(),
          camera.height());
  const double rate = choose_rate(options, capture);
  return std::make_unique<VideoDataset>(std::move(capture), Rig{{camera}, {SE3()}}, rate);
}

}  // namespace rover
