// rover check: a dataset looked over before it is used, in plain words.

#include <algorithm>
#include <iostream>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "rover/cli/commands.h"
#include "rover/diagnosis/dataset_check.h"
#include "rover/slam/mode.h"

namespace rover {
namespace {

using Json = nlohmann::ordered_json;

struct CheckOptions {
  std::string dataset, format = "auto", calibration, imu_calibration, mode = "auto";
  double frame_rate = 0;
  bool json = false;
  DatasetCheckOptions check;
};

DatasetOptions input_of(const CheckOptions& options) {
  DatasetOptions input;
  input.path = options.dataset;
  input.format = parse_dataset_format(options.format);
  if (!options.calibration.empty()) input.calibration = options.calibration;
  if (!options.imu_calibration.empty()) input.imu_calibration = options.imu_calibration;
  input.frame_rate = options.frame_rate;
  if (options.mode == "auto") return with_all_sensors(input);
  const Mode mode = parse_mode(options.mode);
  input.stereo = is_stereo(mode);
  input.inertial = is_inertial(mode);
  return input;
}

std::string to_text(const Findings& findings) {
  std::string text, topic;
  for (const Finding& finding : findings) {
    if (finding.topic != topic) text += finding.topic + '\n';
    topic = finding.topic;
    text += fmt::format("  {:<9}{}{}{}\n", to_string(finding.severity), finding.text,
                        finding.advice.empty() ? "" : "; ", finding.advice);
  }
  return text;
}

std::string summary_of(const Findings& findings) {
  const auto count = [&](Severity severity) {
    return std::count_if(findings.begin(), findings.end(),
                         [&](const Finding& finding) { return finding.severity == severity; });
  };
  const auto warnings = count(Severity::kWarning), notes = count(Severity::kNote);
  return fmt::format("{} warning{}, {} note{}\n", warnings, warnings == 1 ? "" : "s", notes,
                     notes == 1 ? "" : "s");
}

Json to_json(const Findings& findings) {
  Json all = Json::array();
  for (const Finding& finding : findings) {
    Json entry = {{"severity", to_string(finding.severity)},
                  {"topic", finding.topic},
                  {"name", finding.name},
                  {"text", finding.text}};
    if (!finding.advice.empty()) entry["advice"] = finding.advice;
    if (finding.value) entry["value"] = *finding.value;
    all.push_back(std::move(entry));
  }
  return {{"worst", to_string(worst_of(findings))}, {"findings", std::move(all)}};
}

void check(const CheckOptions& options) {
  const Findings findings = check_dataset(input_of(options), options.check);
  if (options.json) {
    std::cout << to_json(findings).dump(2) << '\n';
  } else {
    std::cout << to_text(findings) << summary_of(findings);
  }
  if (worst_of(findings) == Severity::kWarning) throw CLI::RuntimeError(1);
}

}  // namespace

void add_check(CLI::App& program) {
  const auto options = std::make_shared<CheckOptions>();
  CLI::App* command = program.add_subcommand("check", "Look a dataset over and explain");
  command->add_option("--dataset", options->dataset, "Folder or video")->required();
  command->add_option("--format", options->format, "auto, euroc, tum, kitti, folder or video");
  command->add_option("--calibration", options->calibration,
                      "EuRoC sensor.yaml or Kalibr camchain.yaml");
  command->add_option("--imu-calibration", options->imu_calibration,
                      "EuRoC imu0/sensor.yaml or Kalibr imu.yaml");
  command->add_option("--mode", options->mode,
                      "mono, stereo, mono-inertial or stereo-inertial; default: all sensors there");
  command->add_option("--frame-rate", options->frame_rate, "Hz, for folders without time stamps")
      ->check(CLI::PositiveNumber);
  command->add_option("--family", options->check.family, "Feature family; default xfeat-corner");
  command->add_option("--samples", options->check.samples, "Frames looked at; default 12");
  command->add_option("--visual-run", options->check.visual_run,
                      "Seconds tracked to compare camera and inertial sensor; default 12");
  command->add_option("--threads", options->check.threads, "Threads of the networks; default 2");
  command->add_flag("--json", options->json, "Print JSON instead of text");
  command->callback([options] { check(*options); });
}

}  // namespace rover
