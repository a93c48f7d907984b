#include "rover/slam/system.h"

#include <algorithm>
#include <cstring>
#include <map>

#include "rover/base/error.h"
#include "rover/map/atlas.h"
#include "rover/slam/final_adjustment.h"
#include "rover/slam/final_trajectory.h"
#include "rover/slam/mapping_worker.h"

namespace rover {
namespace {

void check_rig(const Rig& rig, Mode mode) {
  require(rig.size() >= 1, "the rig has no camera");
  require(!is_stereo(mode) || rig.size() >= 2,
          "mode {} needs two cameras, the rig has {}; use mode mono", to_string(mode), rig.size());
}

Rig cameras_for(const Rig& rig, Mode mode) {
  Rig used = rig;
  const std::size_t count = is_stereo(mode) ? 2 : 1;
  used.cameras.erase(used.cameras.begin() + static_cast<std::ptrdiff_t>(count), used.cameras.end());
  used.body_from_camera.resize(count);
  return used;
}

// The counts of features are meant for 640x480; other images get the same density, within limits.
Config with_scaled_counts(Config config, const Camera& camera) {
  constexpr double kReferenceArea = 640 * 480;
  const double area = static_cast<double>(camera.width()) * camera.height();
  const double scale = std::clamp(area / kReferenceArea, 0.5, 2.0);
  config.frame.features = static_cast<int>(config.frame.features * scale);
  config.extraction.min_features = static_cast<int>(config.extraction.min_features * scale);
  return config;
}

void check_image(const cv::Mat& image, const Camera& camera, const char* name) {
  require(image.type() == CV_8UC1, "the {} image must be 8 bit with one channel", name);
  require(image.cols == camera.width() && image.rows == camera.height(),
          "the {} image is {}x{}, the calibration says {}x{}; give the calibration of this camera",
          name, image.cols, image.rows, camera.width(), camera.height());
}

// Real images of the same view differ by noise. A buffer that the caller has filled anew cannot be
// compared.
bool is_same_image(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type() || a.data == b.data) return false;
  const auto row_bytes = static_cast<std::size_t>(a.cols) * a.elemSize();
  for (int row = 0; row < a.rows; ++row) {
    if (std::memcmp(a.ptr(row), b.ptr(row), row_bytes) != 0) return false;
  }
  return true;
}

}  // namespace

class System::Implementation {
 public:
  Implementation(const Config& config, const Rig& rig, Mode mode, const cv::Mat& mask,
                 const std::optional<ImuCalibration>& imu)
      : config_(config), mask_(mask) {
    config_.check();
    check_rig(rig, mode);
    require(!is_inertial(mode) || imu.has_value(),
            "mode {} needs the calibration of the inertial sensor; use mode {}", to_string(mode),
            is_stereo(mode) ? "stereo" : "mono");
    if (is_inertial(mode)) imu_ = imu;
    config_.mapping.is_inertial = is_inertial(mode);
    rig_ = std::make_shared<const Rig>(cameras_for(rig, mode));
    runtime_ = std::make_unique<Runtime>(config_.runtime);
    const Config scaled = with_scaled_counts(config_, rig_->cameras[0]);
    family_ = make_feature_family(config_.family, *runtime_, scaled.extraction.options());
    frame_options_ = scaled.frame;
    config_.distribute(family_.guided, mode == Mode::kStereoInertial);
    reset();
  }

  void reset() {
    worker_.reset();
    builder_ = std::make_unique<FrameBuilder>(rig_, family_, frame_options_, mask_);
    atlas_ = std::make_shared<Atlas>(rig_);
    tracker_ =
        std::make_unique<Tracker>(atlas_, rig_, with_matcher(family_, config_.tracking_matcher),
                                  config_.tracking, config_.seed, imu_);
    worker_ = std::make_unique<MappingWorker>(
        LocalMapper(with_matcher(family_, config_.mapping_matcher), config_.mapping),
        config_.execution, config_.mapping_queue);
    placed_.clear();
    tracked_.clear();
    follows_ = false;
    next_frame_ = 0;
    last_time_.reset();
    last_left_.release();
  }

  // On the clock of the cameras.
  bool add_imu(ImuSample sample) {
    if (!imu_) return true;
    sample.time -= given_offset();
    return tracker_->add_imu(sample);
  }

  TrackingResult add_images(Timestamp time, const cv::Mat& left, const cv::Mat& right) {
    check_input(left, right);
    const FrameId id{next_frame_++};
    worker_->set_current_frame(id);
    if (last_time_ && time <= *last_time_) return left_out(id, time);
    last_time_ = time;
    const TrackingResult result = track(id, time, left, right);
    record(result);
    if (result.new_keyframe.valid()) {
      worker_->submit(tracker_->active_map(), result.new_keyframe, id);
    }
    return result;
  }

  // On the inertial sensor's clock, as given.
  Timestamp imu_needed(Timestamp image) const {
    constexpr Timestamp kLead = 50'000'000;  // ns that a new offset may reach beyond the one found
    const Timestamp lead = config_.mapping.inertial.calibration.time_offset ? kLead : 0;
    const Timestamp offset = given_offset() + tracker_->imu_time_offset();
    return imu_ ? std::max(image, image + offset + lead) : image;
  }

  void finish() { worker_->finish(); }

  double adjust_largest_map() {
    finish();
    const auto largest = largest_map();
    if (!largest) return 0;
    Stopwatch watch;
    adjust_finally(*atlas_->maps()[static_cast<std::size_t>(largest->value)], config_);
    return watch.lap_ms();
  }

  std::vector<std::shared_ptr<const Map>> maps() const {
    std::vector<std::shared_ptr<const Map>> views;
    for (const auto& map : atlas_->maps()) views.push_back(map->view());
    return views;
  }

  std::optional<MapId> largest_map() const {
    std::map<MapId, int> frames;
    for (const PlacedFrame& frame : placed_) ++frames[frame.anchored.map];
    std::optional<MapId> largest;
    for (const auto& [map, count] : frames) {
      if (!largest || count > frames[*largest]) largest = map;
    }
    return largest;
  }

  std::vector<FinalPose> trajectory(MapId id) const {
    return final_trajectory(*maps()[static_cast<std::size_t>(id.value)], placed_, tracked_);
  }

  std::vector<FinalPose> keyframes(MapId id) const {
    std::vector<FinalPose> poses;
    for (const Keyframe& keyframe : maps()[static_cast<std::size_t>(id.value)]->keyframes()) {
      poses.push_back({keyframe.frame.id, keyframe.frame.time, keyframe.world_from_body()});
    }
    return poses;
  }

  std::vector<MappingRecord> take_mapping_records() { return worker_->take_records(); }
  const Config& config() const { return config_; }

 private:
  Timestamp given_offset() const {
    return static_cast<Timestamp>(config_.imu_time_offset * kNanosecondsPerSecond);
  }

  static TrackingResult left_out(FrameId id, Timestamp time) {
    TrackingResult result;
    result.anchored.frame = id;
    result.anchored.time = time;
    result.left_out = true;
    return result;
  }

  void check_input(const cv::Mat& left, const cv::Mat& right) const {
    check_image(left, rig_->cameras[0], "left");
    if (!right.empty()) {
      require(rig_->size() > 1, "mode mono takes one image; use mode stereo for two");
      check_image(right, rig_->cameras[1], "right");
    }
  }

  TrackingResult track(FrameId id, Timestamp time, const cv::Mat& left, const cv::Mat& right) {
    if (shows_nothing_new(left)) return tracker_->skip(id, time);
    last_left_ = left;
    StageTimes times;
    StageTimer timer(times);
    Frame frame = builder_->build(id, time, left, right, tracker_->last_matches());
    saw_features_ = frame.size() > 0;
    timer.done("features");
    TrackingResult result = tracker_->track(std::move(frame));
    result.times.insert(result.times.begin(), times.begin(), times.end());
    return result;
  }

  // A camera that repeats its last image says nothing of this moment, unless nothing moves.
  bool shows_nothing_new(const cv::Mat& left) const {
    return imu_ && saw_features_ && !tracker_->still() && is_same_image(left, last_left_);
  }

  void record(const TrackingResult& result) {
    if (result.new_keyframe.valid() && follows_ &&
        placed_.back().anchored.map == result.anchored.map) {
      tracked_[result.anchored.frame] = {result.last_from_body, result.anchored.units};
    }
    for (const AnchoredPose& pose : result.earlier) placed_.push_back({pose});
    if (result.placed()) placed_.push_back({result.anchored, result.covariance});
    if (!result.left_out) follows_ = result.placed();
    for (const AnchoredPose& pose : result.corrected) {
      const auto place = std::find_if(placed_.rbegin(), placed_.rend(), [&](const auto& old) {
        return old.anchored.frame == pose.frame;
      });
      if (place != placed_.rend()) place->anchored = pose;
    }
  }

  Config config_;
  FrameBuilderOptions frame_options_;
  cv::Mat mask_;
  std::optional<ImuCalibration> imu_;  // inertial modes
  std::shared_ptr<const Rig> rig_;
  std::unique_ptr<Runtime> runtime_;
  FeatureFamily family_;
  std::unique_ptr<FrameBuilder> builder_;
  std::shared_ptr<Atlas> atlas_;
  std::unique_ptr<Tracker> tracker_;
  std::unique_ptr<MappingWorker> worker_;
  std::vector<PlacedFrame> placed_;
  std::map<FrameId, TrackedMotion> tracked_;  // of frames that became keyframes
  bool follows_ = false;                      // the next frame one that was placed
  std::int64_t next_frame_ = 0;
  std::optional<Timestamp> last_time_;
  cv::Mat last_left_;  // inertial modes: of the frame before
  bool saw_features_ = false;
};

System::System(const Config& config, const Rig& rig, Mode mode, const cv::Mat& mask,
               const std::optional<ImuCalibration>& imu)
    : implementation_(std::make_unique<Implementation>(config, rig, mode, mask, imu)) {}
System::~System() = default;

bool System::add_imu(const ImuSample& sample) { return implementation_->add_imu(sample); }
Timestamp System::imu_needed(Timestamp image) const { return implementation_->imu_needed(image); }

TrackingResult System::add_images(Timestamp time, const cv::Mat& left, const cv::Mat& right) {
  return implementation_->add_images(time, left, right);
}
void System::finish() { implementation_->finish(); }
double System::adjust_largest_map() { return implementation_->adjust_largest_map(); }
void System::reset() { implementation_->reset(); }
std::vector<std::shared_ptr<const Map>> System::maps() const { return implementation_->maps(); }
std::optional<MapId> System::largest_map() const { return implementation_->largest_map(); }
std::vector<FinalPose> System::trajectory(MapId map) const {
  return implementation_->trajectory(map);
}
std::vector<FinalPose> System::keyframes(MapId map) const {
  return implementation_->keyframes(map);
}
std::vector<MappingRecord> System::take_mapping_records() {
  return implementation_->take_mapping_records();
}
const Config& System::config() const { return implementation_->config(); }

}  // namespace rover
