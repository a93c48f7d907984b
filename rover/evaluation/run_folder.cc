#include "rover/evaluation/run_folder.h"

#include <algorithm>
#include <functional>

#include "rover/base/error.h"
#include "rover/datasets/text_rows.h"

namespace rover {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Json read_summary(const fs::path& file) {
  const std::string text = read_text_file(file);
  const Json json = Json::parse(text, nullptr, false);
  require(json.is_object(), "{}: not a JSON object; was the run ended early?", file.string());
  return json;
}

std::string text_of(const Json& json, const std::string& key, const fs::path& file) {
  const auto found = json.find(key);
  require(found != json.end() && found->is_string(), "{}: '{}' is missing", file.string(), key);
  return found->get<std::string>();
}

// Calls `use` with the fields of the named columns for each row after the header.
void read_csv(const fs::path& file, const std::vector<std::string>& columns,
              const std::function<void(const std::vector<std::string_view>&)>& use,
              std::vector<std::string>& notes) {
  const std::string text = read_text_file(file);
  const auto rows = split_rows(text, ',');
  require(!rows.empty(), "{}: has no header line", file.string());
  std::vector<std::size_t> places;
  for (const std::string& column : columns) {
    const auto& header = rows.front().fields;
    const auto found = std::find(header.begin(), header.end(), column);
    require(found != header.end(), "{}: has no column '{}'", file.string(), column);
    places.push_back(static_cast<std::size_t>(found - header.begin()));
  }
  Omissions omissions(file);
  std::size_t kept = 0;
  for (const TextRow& row : std::span(rows).subspan(1)) {
    try {
      std::vector<std::string_view> fields;
      for (const std::size_t place : places) {
        require_fields(row, place + 1);
        fields.push_back(row.fields[place]);
      }
      use(fields);
      ++kept;
    } catch (const InputError& error) {
      omissions.add(row.line, error.what());
    }
  }
  if (rows.size() > 1) omissions.finish(kept, &notes);
}

void read_frames(const fs::path& file, RunFolder& run) {
  const auto use = [&](const std::vector<std::string_view>& fields) {
    const Timestamp time = parse_seconds_field(fields[0]);
    if (run.offered.frames == 0) run.offered.first = time;
    run.offered.last = std::max(run.offered.last, time);
    ++run.offered.frames;
    ++run.states[std::string(fields[1])];
  };
  read_csv(file, {"time", "state"}, use, run.notes);
}

StageTiming timing_of(const std::string& stage, std::vector<double> times) {
  std::sort(times.begin(), times.end());
  const auto at = [&](double share) {
    return times[static_cast<std::size_t>(share * static_cast<double>(times.size() - 1) + 0.5)];
  };
  return {stage, times.size(), at(0.5), at(0.95), times.back()};
}

void read_timing(const fs::path& file, RunFolder& run) {
  std::vector<std::pair<std::string, std::vector<double>>> stages;
  const auto use = [&](const std::vector<std::string_view>& fields) {
    const double ms = parse_number(fields[1]);
    const auto same = [&](const auto& stage) { return stage.first == fields[0]; };
    auto place = std::find_if(stages.begin(), stages.end(), same);
    if (place == stages.end()) {
      place = stages.insert(place, {std::string(fields[0]), {}});
    }
    place->second.push_back(ms);
  };
  read_csv(file, {"stage", "ms"}, use, run.notes);
  for (auto& [stage, times] : stages) run.stages.push_back(timing_of(stage, std::move(times)));
}

// A run that tracked nothing leaves an empty file.
Trajectory read_if_any(const fs::path& file, std::vector<std::string>& notes) {
  if (!fs::exists(file) || fs::file_size(file) == 0) return {};
  return read_tum_trajectory(file, &notes);
}

}  // namespace

RunFolder read_run_folder(const fs::path& folder) {
  require(fs::is_directory(folder), "{}: no such folder; name the --output of a rover run",
          folder.string());
  RunFolder run;
  run.summary = read_summary(folder / "summary.json");
  run.mode = text_of(run.summary, "mode", folder / "summary.json");
  run.pose_frame = text_of(run.summary, "pose_frame", folder / "summary.json");
  require(run.pose_frame == "cam0" || run.pose_frame == "body",
          "{}: pose_frame '{}' is not known; known are cam0 and body",
          (folder / "summary.json").string(), run.pose_frame);
  run.final = read_if_any(folder / "trajectory_final.txt", run.notes);
  require(!run.final.empty(), "{}: the run tracked no frame; there is nothing to judge",
          folder.string());
  run.causal = read_if_any(folder / "trajectory_causal.txt", run.notes);
  read_frames(folder / "frames.csv", run);
  read_timing(folder / "timing.csv", run);
  return run;
}

}  // namespace rover
