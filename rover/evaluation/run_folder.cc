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

constexpr std::size_t kAbsent = std::string::npos;

std::size_t find_column(const std::vector<std::string_view>& header, std::string column,
                        const fs::path& file) {
  const bool optional = column.ends_with('?');
  if (optional) column.pop_back();
  const auto found = std::find(header.begin(), header.end(), column);
  if (found == header.end() && optional) return kAbsent;
  require(found != header.end(), "{}: has no column '{}'", file.string(), column);
  return static_cast<std::size_t>(found - header.begin());
}

// Calls `use` with the fields of the named columns for each row after the header. A column whose
// name ends in '?' may be missing: its fields are empty.
void read_csv(const fs::path& file, const std::vector<std::string>& columns,
              const std::function<void(const std::vector<std::string_view>&)>& use,
              std::vector<std::string>& notes) {
  const std::string text = read_text_file(file);
  const auto rows = split_rows(text, ',');
  require(!rows.empty(), "{}: has no header line", file.string());
  std::vector<std::size_t> places;
  for (const std::string& column : columns) {
    places.push_back(find_column(rows.front().fields, column, file));
  }
  Omissions omissions(file);
  std::size_t kept = 0;
  for (const TextRow& row : std::span(rows).subspan(1)) {
    try {
      std::vector<std::string_view> fields;
      for (const std::size_t place : places) {
        if (place != kAbsent) require_fields(row, place + 1);
        fields.push_back(place == kAbsent ? std::string_view() : row.fields[place]);
      }
      use(fields);
      ++kept;
    } catch (const InputError& error) {
      omissions.add(row.line, error.what());
    }
  }
  if (rows.size() > 1) omissions.finish(kept, &notes);
}

double number_if_any(std::string_view field) { return field.empty() ? 0 : parse_number(field); }

void read_frames(const fs::path& file, RunFolder& run) {
  const auto use = [&](const std::vector<std::string_view>& fields) {
    run.frames.push_back(
        {parse_seconds_field(fields[0]), std::string(fields[1]), number_if_any(fields[2]),
         number_if_any(fields[3]), number_if_any(fields[4]), number_if_any(fields[5]),
         number_if_any(fields[6]), number_if_any(fields[7]), number_if_any(fields[8])});
  };
  read_csv(file,
           {"time", "state", "features?", "matches?", "inliers?", "frame_ms?", "rss_mb?", "map?",
            "epoch?"},
           use, run.notes);
  for (const FrameLine& frame : run.frames) {
    if (run.offered.frames == 0) run.offered.first = frame.time;
    run.offered.last = std::max(run.offered.last, frame.time);
    ++run.offered.frames;
    ++run.states[frame.state];
  }
}

StageTiming timing_of(const std::string& stage, std::vector<double> times) {
  std::vector<double> sorted = times;
  std::sort(sorted.begin(), sorted.end());
  const auto at = [&](double share) {
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1) + 0.5)];
  };
  return {stage, sorted.size(), at(0.5), at(0.95), sorted.back(), std::move(times)};
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

void read_states(const fs::path& file, RunFolder& run) {
  if (!fs::exists(file)) return;
  std::vector<std::string> columns = {"time"};
  for (const std::string prefix : {"", "sigma_"}) {
    for (const std::string quantity : {"v", "bg", "ba"}) {
      for (const char axis : {'x', 'y', 'z'}) columns.push_back(prefix + quantity + axis);
    }
  }
  const auto use = [&](const std::vector<std::string_view>& fields) {
    StateLine state;
    state.time = parse_seconds_field(fields[0]);
    for (std::size_t i = 0; i < state.values.size(); ++i) {
      state.values[i] = parse_number(fields[1 + i]);
      state.sigmas[i] = parse_number(fields[1 + state.values.size() + i]);
    }
    run.motion.push_back(state);
  };
  read_csv(file, columns, use, run.notes);
}

// samples/SECONDS.jpg; other files are none of ours.
void read_samples(const fs::path& folder, RunFolder& run) {
  if (!fs::is_directory(folder)) return;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".jpg") continue;
    try {
      run.samples.push_back({parse_seconds_field(entry.path().stem().string()), entry.path()});
    } catch (const InputError& error) {
      run.notes.push_back(fmt::format("{}: left out: {}", entry.path().string(), error.what()));
    }
  }
  std::sort(run.samples.begin(), run.samples.end(),
            [](const auto& a, const auto& b) { return a.time < b.time; });
}

}  // namespace

std::optional<double> RunFolder::initialised_after() const {
  const auto ok = [](const FrameLine& frame) { return frame.state == "ok"; };
  const auto first = std::find_if(frames.begin(), frames.end(), ok);
  if (first == frames.end()) return std::nullopt;
  return seconds_between(offered.first, first->time);
}

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
  run.odometry = read_if_any(folder / "trajectory_odometry.txt", run.notes);
  run.keyframes = read_if_any(folder / "keyframes.txt", run.notes);
  read_samples(folder / "samples", run);
  read_frames(folder / "frames.csv", run);
  read_timing(folder / "timing.csv", run);
  read_states(folder / "states.csv", run);
  return run;
}

}  // namespace rover
