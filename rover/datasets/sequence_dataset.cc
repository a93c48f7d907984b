#include <algorithm>
#include <utility>

#include "rover/base/error.h"
#include "rover/datasets/image_file.h"
#include "rover/datasets/sequence.h"

namespace rover {
namespace {

cv::Size size_of(const Camera& camera) { return {camera.width(), camera.height()}; }

class SequenceDataset : public Dataset {
 public:
  explicit SequenceDataset(Sequence sequence) : sequence_(std::move(sequence)) {}

  const Rig& rig() const override { return sequence_.rig; }
  const std::optional<ImuCalibration>& imu_calibration() const override {
    return sequence_.imu_calibration;
  }
  std::size_t size() const override { return sequence_.frames.size(); }
  const Trajectory& ground_truth() const override { return sequence_.ground_truth; }
  const std::vector<std::string>& notes() const override { return sequence_.notes; }

  std::optional<SensorFrame> next() override {
    if (next_frame_ == sequence_.frames.size()) return std::nullopt;
    const SequenceFrame& record = sequence_.frames[next_frame_];
    SensorFrame frame;
    frame.index = static_cast<std::int64_t>(next_frame_++);
    frame.time = record.time;
    for (std::size_t i = 0; i < record.images.size(); ++i) add_image(record, i, frame);
    frame.imu = take_imu(record.time);
    return frame;
  }

 private:
  void add_image(const SequenceFrame& record, std::size_t camera, SensorFrame& frame) const {
    LoadedImage loaded;
    if (!record.images[camera].empty()) {
      loaded = load_gray_image(record.images[camera], size_of(sequence_.rig.cameras[camera]));
    } else if (camera == 0) {
      loaded.problem = "no image was recorded";
    }
    frame.images.push_back(std::move(loaded.image));
    frame.problems.push_back(std::move(loaded.problem));
  }

  std::vector<ImuSample> take_imu(Timestamp until) {
    const auto& all = sequence_.imu;
    const auto begin = all.begin() + static_cast<std::ptrdiff_t>(next_sample_);
    auto end = std::lower_bound(begin, all.end(), until, [](const ImuSample& sample, Timestamp t) {
      return sample.time < t;
    });
    // The sample that closes the last frame's interval may already lie at or after this frame.
    const bool covered = next_sample_ > 0 && all[next_sample_ - 1].time >= until;
    if (end != all.end() && !covered) ++end;
    next_sample_ = static_cast<std::size_t>(end - all.begin());
    return {begin, end};
  }

  Sequence sequence_;
  std::size_t next_frame_ = 0;
  std::size_t next_sample_ = 0;
};

// A single bad image is left out; a calibration that is not this camera's is told at once. A few
// images from all over the sequence are asked until one fits.
void require_fitting_image(const Sequence& sequence, std::size_t camera) {
  constexpr std::size_t kProbes = 10;
  std::vector<std::filesystem::path> files;
  for (const SequenceFrame& record : sequence.frames) {
    if (!record.images[camera].empty()) files.push_back(record.images[camera]);
  }
  std::string problem = "none was recorded";
  const std::size_t probes = std::min(kProbes, files.size());
  for (std::size_t i = 0; i < probes; ++i) {
    const auto& file = files[i * files.size() / probes];
    const auto loaded = load_gray_image(file, size_of(sequence.rig.cameras[camera]));
    if (!loaded.image.empty()) return;
    if (i == 0) problem = loaded.problem;
  }
  throw InputError("no usable image of camera {}: {}; check the calibration and the images", camera,
                   problem);
}

}  // namespace

std::unique_ptr<Dataset> make_sequence_dataset(Sequence sequence) {
  for (std::size_t i = 0; i < sequence.rig.cameras.size(); ++i) {
    require_fitting_image(sequence, i);
  }
  return std::make_unique<SequenceDataset>(std::move(sequence));
}

}  // namespace rover
