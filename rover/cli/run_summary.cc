#include "rover/cli/run_summary.h"

#include <sys/resource.h>

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "rover/base/quantile.h"
#include "rover/cli/inertial_summary.h"
#include "rover/cli/map_ply.h"
#include "rover/datasets/atomic_file.h"

namespace rover {
namespace {

using Json = nlohmann::ordered_json;

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

std::vector<double> frame_times(const RunRecorder& recorder) {
  std::vector<double> times;
  for (const FrameRecord& frame : recorder.frames()) {
    if (frame.total_ms > 0) times.push_back(frame.total_ms);
  }
  return times;
}

Trajectory to_trajectory(const std::vector<FinalPose>& poses) {
  Trajectory trajectory;
  for (const FinalPose& pose : poses) trajectory.push_back({pose.time, pose.world_from_body});
  return trajectory;
}

Json stage_table(const RunRecorder& recorder) {
  Json stages = Json::object();
  for (const auto& [stage, times] : recorder.stages()) {
    stages[stage] = {{"median", quantile(times, 0.5)},
                     {"p95", quantile(times, 0.95)},
                     {"max", quantile(times, 1)}};
  }
  return stages;
}

std::size_t write_trajectories(const std::filesystem::path& folder, const System& system) {
  const auto largest = system.largest_map();
  if (!largest) {
    write_tum_trajectory(folder / "trajectory_final.txt", {});
    write_tum_trajectory(folder / "keyframes.txt", {});
    return 0;
  }
  const Trajectory main = to_trajectory(system.trajectory(*largest));
  write_tum_trajectory(folder / "trajectory_final.txt", main);
  write_tum_trajectory(folder / "keyframes.txt", to_trajectory(system.keyframes(*largest)));
  int other = 0;
  for (const auto& map : system.maps()) {
    if (map->id() == *largest) continue;
    write_tum_trajectory(folder / fmt::format("trajectory_final.{}.txt", ++other),
                         to_trajectory(system.trajectory(map->id())));
  }
  return main.size();
}

int mapping_lag(const RunRecorder& recorder) {
  int lag = 0;
  for (const MappingRecord& record : recorder.mapping()) lag = std::max(lag, record.lag_frames);
  return lag;
}

Json describe_map(const System& system) {
  const auto largest = system.largest_map();
  const auto maps = system.maps();
  const Map* map = largest ? maps[static_cast<std::size_t>(largest->value)].get() : nullptr;
  return {{"keyframes", map ? map->keyframes().size() : 0},
          {"landmarks", map ? map->landmarks().size() : 0},
          {"maps", maps.size()}};
}

Json describe(const System& system, const RunRecorder& recorder, const RunFacts& facts,
              std::size_t final_poses) {
  const auto times = frame_times(recorder);
  Json json;
  json["dataset"] = facts.dataset.string();
  json["mode"] = to_string(facts.mode);
  json["pose_frame"] = is_inertial(facts.mode) ? "body" : "cam0";
  json["frames"] = facts.frames_offered;
  json["frames_tracked"] = recorder.count("ok");
  json["frames_skipped"] = recorder.count("skipped");
  json["coverage"] = static_cast<double>(final_poses) /
                     static_cast<double>(std::max<std::size_t>(1, facts.frames_offered));
  json.update(describe_map(system));
  json["lost_events"] = recorder.lost_events();
  json["loops_closed"] = 0;
  if (is_inertial(facts.mode)) json["inertial"] = describe_inertia(system, recorder);
  json["input"] = facts.input;
  json["stages"] = stage_table(recorder);
  json["frame_ms"] = {{"median", quantile(times, 0.5)},
                      {"p95", quantile(times, 0.95)},
                      {"p99", quantile(times, 0.99)},
                      {"max", quantile(times, 1)}};
  json["final_adjustment_ms"] = facts.final_adjustment_ms;
  json["dropped_frames"] = recorder.count("dropped");
  json["mapping_lag_frames"] = mapping_lag(recorder);
  json["realtime"] = facts.realtime;
  json["realtime_factor"] = facts.wall_seconds > 0 ? facts.sensor_seconds / facts.wall_seconds : 0;
  json["peak_rss_mb"] = peak_memory_mb();
  json["threads"] = system.config().runtime.threads;
  json["seed"] = system.config().seed;
  json["version"] = ROVER_VERSION;
  json["families"] = Json::array({system.config().family});
  for (const auto& [key, value] : list_config(system.config())) json["config"][key] = value;
  return json;
}

std::string for_people(const Json& json, const std::filesystem::path& folder) {
  std::string text;
  text += fmt::format(
      "frames       {} offered, {} tracked ({:.1f}% in the final trajectory), "
      "{} skipped, {} dropped\n",
      json["frames"].get<int>(), json["frames_tracked"].get<int>(),
      100 * json["coverage"].get<double>(), json["frames_skipped"].get<int>(),
      json["dropped_frames"].get<int>());
  text += fmt::format("map          {} keyframes, {} landmarks; {} map(s), lost {} time(s)\n",
                      json["keyframes"].get<int>(), json["landmarks"].get<int>(),
                      json["maps"].get<int>(), json["lost_events"].get<int>());
  if (json.contains("inertial")) text += inertia_for_people(json["inertial"]);
  const auto& ms = json["frame_ms"];
  text += fmt::format("frame time   median {:.1f} ms, 95% {:.1f} ms, longest {:.1f} ms\n",
                      ms["median"].get<double>(), ms["p95"].get<double>(), ms["max"].get<double>());
  text += fmt::format(
      "speed        {:.2f} x real time; peak memory {:.0f} MB; "
      "final adjustment {:.0f} ms\n",
      json["realtime_factor"].get<double>(), json["peak_rss_mb"].get<double>(),
      json["final_adjustment_ms"].get<double>());
  text += fmt::format("written to   {}\n", folder.string());
  return text;
}

}  // namespace

void write_unadjusted(const std::filesystem::path& folder, const System& system) {
  const auto largest = system.largest_map();
  if (!largest) return;
  write_tum_trajectory(folder / "trajectory_before_adjustment.txt",
                       to_trajectory(system.trajectory(*largest)));
}

std::string write_results(const std::filesystem::path& folder, const System& system,
                          const RunRecorder& recorder, const RunFacts& facts) {
  const std::size_t final_poses = write_trajectories(folder, system);
  recorder.write(folder);
  const auto largest = system.largest_map();
  const auto maps = system.maps();
  write_map_ply(folder / "map.ply",
                largest ? maps[static_cast<std::size_t>(largest->value)].get() : nullptr);
  const Json json = describe(system, recorder, facts, final_poses);
  write_file_atomically(folder / "summary.json", json.dump(2) + "\n");
  return for_people(json, folder);
}

}  // namespace rover
