#include "rover/cli/run_recorder.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>

#include <fmt/format.h>

#include "rover/datasets/atomic_file.h"

namespace rover {
namespace {

constexpr std::size_t kMemoryPeriod = 20;  // frames

// MB that the process occupies now; 0 where the system does not say.
double resident_memory_mb() {
  std::ifstream stream("/proc/self/statm");
  double whole = 0, resident = 0;
  stream >> whole >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1024 * 1024);
}

}  // namespace

void RunRecorder::add(std::int64_t index, const TrackingResult& result, double total_ms) {
  const AnchoredPose& pose = result.anchored;
  if (times_.size() % kMemoryPeriod == 0) rss_mb_ = resident_memory_mb();
  const char* state = result.left_out ? "skipped" : to_string(result.state);
  frames_.push_back({index, pose.time, state, pose.map.value, result.epoch, pose.reference.value,
                     result.features, result.matches, result.inliers, total_ms, rss_mb_});
  times_.emplace_back(index, result.times);
  if (!result.placed() || !result.metric) return;
  causal_.push_back({pose.time, result.live.world_from_body});
  odometry_.push_back({pose.time, result.live.odometry_from_body});
  covariances_.emplace_back(pose.time, result.covariance);
  if (result.inertial) {
    states_.push_back(
        state_record(pose.time, *result.inertial, result.inertial_covariance, result.drift));
  }
}

void RunRecorder::add_unusable(std::int64_t index, Timestamp time, const std::string& state) {
  FrameRecord record;
  record.index = index;
  record.time = time;
  record.state = state;
  frames_.push_back(record);
}

void RunRecorder::add_mapping(std::vector<MappingRecord> records) {
  mapping_.insert(mapping_.end(), std::make_move_iterator(records.begin()),
                  std::make_move_iterator(records.end()));
}

int RunRecorder::count(const std::string& state) const {
  return static_cast<int>(std::count_if(frames_.begin(), frames_.end(),
                                        [&](const auto& frame) { return frame.state == state; }));
}

int RunRecorder::lost_events() const {
  int events = 0;
  bool tracked = false;
  for (const FrameRecord& frame : frames_) {
    events += tracked && frame.state == "lost";
    if (frame.state == "ok" || frame.state == "lost") tracked = frame.state == "ok";
  }
  return events;
}

void RunRecorder::write(const std::filesystem::path& folder) const {
  write_tum_trajectory(folder / "trajectory_causal.txt", causal_);
  write_tum_trajectory(folder / "trajectory_odometry.txt", odometry_);
  write_file_atomically(folder / "frames.csv", frames_csv());
  write_file_atomically(folder / "timing.csv", timing_csv());
  write_file_atomically(folder / "covariance.csv", covariance_csv());
  if (!states_.empty()) write_file_atomically(folder / "states.csv", states_csv(states_));
  samples_.write(folder);
}

std::string RunRecorder::frames_csv() const {
  std::string text =
      "frame,time,state,map,epoch,reference_keyframe,features,matches,inliers,frame_ms,rss_mb\n";
  for (const FrameRecord& f : frames_) {
    text += fmt::format("{},{},{},{},{},{},{},{},{},{:.3f},{:.1f}\n", f.index,
                        format_seconds(f.time), f.state, f.map, f.epoch, f.reference, f.features,
                        f.matches, f.inliers, f.total_ms, f.rss_mb);
  }
  return text;
}

std::string RunRecorder::timing_csv() const {
  std::string text = "frame,stage,ms\n";
  for (const auto& [frame, times] : times_) {
    for (const auto& [stage, ms] : times) text += fmt::format("{},{},{:.3f}\n", frame, stage, ms);
  }
  for (const MappingRecord& record : mapping_) {
    for (const auto& [stage, ms] : record.report.times) {
      text += fmt::format("{},mapping.{},{:.3f}\n", record.frame.value, stage, ms);
    }
  }
  return text;
}

std::string RunRecorder::covariance_csv() const {
  std::string text = "time";
  const char* axes[] = {"tx", "ty", "tz", "rx", "ry", "rz"};
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) text += fmt::format(",{}_{}", axes[i], axes[j]);
  }
  text += '\n';
  for (const auto& [time, covariance] : covariances_) {
    text += format_seconds(time);
    for (int i = 0; i < 6; ++i) {
      for (int j = i; j < 6; ++j) text += fmt::format(",{:.6e}", covariance(i, j));
    }
    text += '\n';
  }
  return text;
}

std::vector<std::pair<std::string, std::vector<double>>> RunRecorder::stages() const {
  std::vector<std::pair<std::string, std::vector<double>>> result;
  const auto add_time = [&](const std::string& stage, double ms) {
    const auto place = std::find_if(result.begin(), result.end(),
                                    [&](const auto& entry) { return entry.first == stage; });
    (place == result.end() ? result.emplace_back(stage, std::vector<double>()) : *place)
        .second.push_back(ms);
  };
  for (const auto& [frame, times] : times_) {
    for (const auto& [stage, ms] : times) add_time(stage, ms);
  }
  for (const MappingRecord& record : mapping_) {
    for (const auto& [stage, ms] : record.report.times) add_time("mapping." + stage, ms);
  }
  return result;
}

}  // namespace rover
