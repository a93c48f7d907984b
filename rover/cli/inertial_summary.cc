#include "rover/cli/inertial_summary.h"

#include <algorithm>

#include <fmt/format.h>

#include "rover/cli/calibration_summary.h"

namespace rover {
namespace {

using Json = nlohmann::ordered_json;

std::shared_ptr<const Map> largest_map_of(const System& system) {
  const auto largest = system.largest_map();
  return largest ? system.maps()[static_cast<std::size_t>(largest->value)] : nullptr;
}

std::string state_of(const InertialStatus& status, const RunRecorder& recorder) {
  if (status.aligned) return "aligned";
  if (recorder.mapping().empty()) return "waiting for a map";
  const std::string& missing = recorder.mapping().back().report.inertial.waiting;
  return missing.empty() ? "waiting for excitation" : "waiting for excitation: " + missing;
}

auto count(const RunRecorder& recorder, InertialEvent event) {
  return std::ranges::count_if(recorder.mapping(), [&](const MappingRecord& record) {
    return record.report.inertial.event == event;
  });
}

const char* name_of(InertialEvent event) {
  switch (event) {
    case InertialEvent::kInitialized:
      return "initialised";
    case InertialEvent::kRefined:
      return "refined";
    case InertialEvent::kCalibrated:
      return "calibrated";
    case InertialEvent::kUndone:
      return "undone";
    case InertialEvent::kNone:
      break;
  }
  return "";
}

Json events_of(const RunRecorder& recorder) {
  Json events = Json::array();
  for (const MappingRecord& record : recorder.mapping()) {
    const InertialReport& report = record.report.inertial;
    if (report.event == InertialEvent::kNone) continue;
    events.push_back({{"time", format_seconds(record.time)},
                      {"event", name_of(report.event)},
                      {"scale_sigma", report.scale_sigma}});
  }
  return events;
}

}  // namespace

Json describe_inertia(const System& system, const RunRecorder& recorder) {
  const auto map = largest_map_of(system);
  const InertialStatus status = map ? map->inertial() : InertialStatus{};
  Json json;
  json["state"] = state_of(status, recorder);
  json["aligned_at"] = status.aligned ? Json(format_seconds(status.begin)) : Json();
  json["scale_sigma"] = status.aligned ? Json(status.scale_sigma) : Json();
  json["refinements"] = status.refinements;
  json["alignments"] = count(recorder, InertialEvent::kInitialized);
  json["undone"] = count(recorder, InertialEvent::kUndone);
  json["events"] = events_of(recorder);
  if (map && system.config().mapping.inertial.calibration.enabled())
    json["calibration"] = describe_calibration(*map, system.config());
  json["dead_reckoned_frames"] = recorder.count("dead-reckoning");
  return json;
}

std::string inertia_for_people(const Json& inertial) {
  const std::string state = inertial["state"].get<std::string>();
  const std::string calibration =
      inertial.contains("calibration") ? calibration_for_people(inertial["calibration"]) : "";
  if (inertial["aligned_at"].is_null())
    return fmt::format("inertial     {}\n{}", state, calibration);
  return fmt::format(
      "inertial     aligned at {} s, scale known to {:.1f}%; {} frame(s) by inertial "
      "data alone\n{}",
      inertial["aligned_at"].get<std::string>(), 100 * inertial["scale_sigma"].get<double>(),
      inertial["dead_reckoned_frames"].get<int>(), calibration);
}

}  // namespace rover
