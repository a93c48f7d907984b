#include <algorithm>
#include <iostream>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "rover/base/error.h"
#include "rover/cli/commands.h"
#include "rover/datasets/atomic_file.h"
#include "rover/datasets/dataset.h"
#include "rover/evaluation/live_judgement.h"
#include "rover/evaluation/report.h"
#include "rover/evaluation/run_folder.h"
#include "rover/evaluation/run_report.h"
#include "rover/evaluation/svg.h"
#include "rover/evaluation/text_table.h"
#include "rover/evaluation/trajectory_svg.h"

namespace rover {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct EvaluateOptions {
  std::string run, dataset, format = "auto", calibration;
  std::string estimate, reference, output;
  std::vector<std::string> peers;  // NAME=FILE
  LiveOptions live;
  bool json = false;
  bool report = false;
};

struct NamedTrajectory {
  std::string name;
  Trajectory trajectory;
};

// All that is judged against one reference, and what came out.
struct Evaluation {
  Trajectory reference;
  std::vector<NamedTrajectory> estimates;
  std::vector<Judgement> judgements;
  ReportOptions report;
  Json json;
};

void print_notes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) std::cerr << "rover: note: " << note << '\n';
}

NamedTrajectory read_peer(const std::string& text) {
  const auto equals = text.find('=');
  require(equals != std::string::npos && equals > 0,
          "--peer {}: not NAME=FILE, where FILE is a trajectory in TUM format", text);
  return {text.substr(0, equals), read_tum_trajectory(text.substr(equals + 1))};
}

// The ground truth of the frame that the run's poses are of.
Trajectory read_reference(const EvaluateOptions& options, const RunFolder& run) {
  DatasetOptions dataset_options;
  dataset_options.path = options.dataset;
  dataset_options.format = parse_dataset_format(options.format);
  if (!options.calibration.empty()) dataset_options.calibration = options.calibration;
  dataset_options.inertial = run.inertial();
  const auto dataset = open_dataset(dataset_options);
  print_notes(dataset->notes());
  require(!dataset->ground_truth().empty(),
          "{}: has no ground truth; use --estimate and --reference with one in TUM format",
          options.dataset);
  if (run.pose_frame != "cam0") return dataset->ground_truth();
  return move_frame(dataset->ground_truth(), dataset->rig().body_from_camera[0]);
}

// Only the part in the time of the frames offered: the run may have been given a piece.
NamedTrajectory cut_to(const std::optional<Offered>& offered, double slack, NamedTrajectory named) {
  if (!offered) return named;
  std::erase_if(named.trajectory, [&](const StampedPose& stamped) {
    return seconds_between(stamped.time, offered->first) > slack ||
           seconds_between(offered->last, stamped.time) > slack;
  });
  require(!named.trajectory.empty(), "{}: has no pose in the time of the run", named.name);
  return named;
}

void judge_all(const EvaluateOptions& options, const std::optional<Offered>& offered,
               Evaluation& evaluation) {
  for (const std::string& peer : options.peers) {
    evaluation.estimates.push_back(cut_to(offered, options.live.max_difference, read_peer(peer)));
  }
  Json& list = evaluation.json["trajectories"] = Json::object();
  for (const auto& [name, trajectory] : evaluation.estimates) {
    evaluation.judgements.push_back(
        judge(name, trajectory, evaluation.reference, options.live.max_difference, offered));
    list[name] = to_json(evaluation.judgements.back());
  }
}

ReportOptions report_for(const RunFolder& run) {
  ReportOptions report;
  report.rigid = !run.monocular();
  report.gravity = run.inertial();
  report.headline = run.monocular() ? AlignmentKind::kSimilarity : AlignmentKind::kRigid;
  return report;
}

fs::path output_folder(const EvaluateOptions& options) {
  return options.output.empty() ? options.run : options.output;
}

// The name of the sequence: the dataset's folder.
std::string title_of(const EvaluateOptions& options, const RunFolder& run) {
  fs::path dataset = options.dataset.empty() ? fs::path(run.summary.value("dataset", "a run"))
                                             : fs::absolute(options.dataset).lexically_normal();
  if (dataset.filename().empty()) dataset = dataset.parent_path();
  return dataset.filename().string();
}

void write_report(const EvaluateOptions& options, const RunFolder& run,
                  const Evaluation& evaluation) {
  std::vector<Trajectory> estimates;
  for (const auto& estimate : evaluation.estimates) estimates.push_back(estimate.trajectory);
  const RunReport report{title_of(options, run),
                         run,
                         evaluation.judgements,
                         estimates,
                         evaluation.reference,
                         evaluation.report,
                         fs::path(options.run) / "map.ply"};
  write_file_atomically(output_folder(options) / "report.html", run_report_html(report));
}

Json describe(const RunFolder& run) {
  Json json = {{"mode", run.mode},
               {"pose_frame", run.pose_frame},
               {"headline", run.monocular() ? "sim3" : "se3"},
               {"frames", run.offered.frames},
               {"states", run.states}};
  for (const char* key : {"frame_ms", "keyframes", "landmarks", "maps", "lost_events",
                          "loops_closed", "dropped_frames", "realtime_factor", "peak_rss_mb"}) {
    if (run.summary.contains(key)) json[key] = run.summary[key];
  }
  if (const auto after = run.initialised_after()) json["initialised_after_s"] = *after;
  Json& stages = json["stages"] = Json::object();
  for (const StageTiming& timing : run.stages) {
    stages[timing.stage] = {{"count", timing.count},
                            {"median", timing.median},
                            {"p95", timing.p95},
                            {"max", timing.max}};
  }
  return json;
}

// Only the part of the reference in the time of the estimates.
Trajectory crop(const Trajectory& reference, const std::vector<NamedTrajectory>& estimates) {
  Timestamp first = estimates[0].trajectory.front().time;
  Timestamp last = estimates[0].trajectory.back().time;
  for (const auto& estimate : estimates) {
    first = std::min(first, estimate.trajectory.front().time);
    last = std::max(last, estimate.trajectory.back().time);
  }
  Trajectory cropped;
  std::copy_if(
      reference.begin(), reference.end(), std::back_inserter(cropped),
      [&](const StampedPose& stamped) { return stamped.time >= first && stamped.time <= last; });
  return cropped;
}

std::string draw(const Evaluation& evaluation) {
  std::vector<DrawnTrajectory> drawn;
  for (std::size_t i = 0; i < evaluation.estimates.size(); ++i) {
    const auto& errors = errors_under(evaluation.judgements[i], evaluation.report.headline);
    if (!errors) continue;  // nothing says where it would lie
    drawn.push_back(
        {fmt::format("{} (ATE {:.4f} m)", evaluation.estimates[i].name, errors->position.rmse),
         move_world(errors->reference_from_estimate, evaluation.estimates[i].trajectory)});
  }
  return draw_trajectories({"reference", crop(evaluation.reference, evaluation.estimates)}, drawn);
}

std::string to_text(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

// The final trajectory where it lies over the reference, and that: for other programs' plots.
void write_aligned(const fs::path& folder, const Evaluation& evaluation) {
  const auto& errors = errors_under(evaluation.judgements[0], evaluation.report.headline);
  if (!errors) return;
  write_tum_trajectory(folder / "trajectory_reference.txt", evaluation.reference);
  write_tum_trajectory(
      folder / "trajectory_aligned.txt",
      move_world(errors->reference_from_estimate, evaluation.estimates[0].trajectory));
}

void write_results(const fs::path& folder, const Evaluation& evaluation) {
  write_file_atomically(folder / "evaluation.json", to_text(evaluation.json));
  write_file_atomically(folder / "trajectory.svg", standalone_svg(draw(evaluation)));
}

std::string format_timing(const RunFolder& run) {
  std::string text = "frames       ";
  for (const auto& [state, count] : run.states) text += fmt::format(" {} {}", count, state);
  text += fmt::format("\n\n{:<28}{:>8}{:>10}{:>10}{:>10}\n", "stage [ms]", "count", "median", "95%",
                      "max");
  for (const StageTiming& timing : run.stages) {
    text += fmt::format("{:<28}{:>8}{:>10.2f}{:>10.2f}{:>10.2f}\n", timing.stage, timing.count,
                        timing.median, timing.p95, timing.max);
  }
  return text;
}

// Of modes that know scale: how good the poses were when they came. Text for people.
std::string judge_live_poses(const EvaluateOptions& options, const RunFolder& run,
                             Evaluation& evaluation) {
  if (run.monocular()) return "";
  const LiveJudgement live = judge_live(run, evaluation.reference, options.live);
  evaluation.json["live"] = to_json(live, options.live);
  return format_rows(live_rows(live, options.live)) + "\n";
}

void evaluate_run(const EvaluateOptions& options) {
  const RunFolder run = read_run_folder(options.run);
  print_notes(run.notes);
  Evaluation evaluation;
  evaluation.reference = read_reference(options, run);
  evaluation.report = report_for(run);
  evaluation.json = describe(run);
  evaluation.estimates.push_back({"final", run.final});
  if (!run.causal.empty()) evaluation.estimates.push_back({"causal", run.causal});
  judge_all(options, run.offered, evaluation);
  const std::string live = judge_live_poses(options, run, evaluation);
  evaluation.reference = crop(evaluation.reference, evaluation.estimates);
  write_results(output_folder(options), evaluation);
  write_aligned(output_folder(options), evaluation);
  write_report(options, run, evaluation);
  if (options.json) {
    std::cout << to_text(evaluation.json);
    return;
  }
  std::cout << fmt::format("mode {}, poses of {}\n\n", run.mode, run.pose_frame)
            << format_table(evaluation.judgements, evaluation.report) << '\n'
            << live << format_timing(run);
}

// A run without ground truth: what it says of itself.
void report_run(const EvaluateOptions& options) {
  const RunFolder run = read_run_folder(options.run);
  print_notes(run.notes);
  Evaluation evaluation;
  evaluation.report = report_for(run);
  write_report(options, run, evaluation);
  std::cout << fmt::format("mode {}, poses of {}\n\n", run.mode, run.pose_frame)
            << format_timing(run) << "\nwritten to "
            << (output_folder(options) / "report.html").string() << '\n';
}

void evaluate_files(const EvaluateOptions& options) {
  std::vector<std::string> notes;
  Evaluation evaluation;
  evaluation.reference = read_tum_trajectory(options.reference, &notes);
  evaluation.estimates.push_back({"estimate", read_tum_trajectory(options.estimate, &notes)});
  print_notes(notes);
  evaluation.report.gravity = true;
  judge_all(options, std::nullopt, evaluation);
  if (!options.output.empty()) write_results(options.output, evaluation);
  std::cout << (options.json ? to_text(evaluation.json)
                             : format_table(evaluation.judgements, evaluation.report));
}

void evaluate(const EvaluateOptions& options) {
  const bool run = !options.run.empty() && !options.dataset.empty();
  if (options.report && !options.run.empty() && options.dataset.empty()) {
    return report_run(options);
  }
  const bool files = !options.estimate.empty() && !options.reference.empty();
  require(run != files && (run || options.run.empty()) && (files || options.estimate.empty()),
          "evaluate needs either --run DIR and --dataset DIR, or --estimate FILE and --reference "
          "FILE");
  options.live.check();
  if (run) {
    evaluate_run(options);
  } else {
    evaluate_files(options);
  }
}

}  // namespace

void add_evaluate(CLI::App& program) {
  const auto options = std::make_shared<EvaluateOptions>();
  CLI::App* command = program.add_subcommand("evaluate", "Judge a finished run or a trajectory");
  command->add_option("--run", options->run, "output folder of a rover run");
  command->add_option("--dataset", options->dataset, "the dataset it ran on");
  command->add_option("--format", options->format, "auto, euroc, tum, kitti, folder, video");
  command->add_option("--calibration", options->calibration, "the calibration it ran with");
  command->add_option("--estimate", options->estimate, "trajectory in TUM format");
  command->add_option("--reference", options->reference, "true trajectory in TUM format");
  command->add_option("--peer", options->peers, "NAME=FILE: another trajectory to compare with");
  command->add_option("--max-difference", options->live.max_difference,
                      "seconds between poses that belong together (0.02)");
  command->add_option("--from", options->live.from,
                      "s into the run from which causal poses are judged apart (20)");
  command->add_option(
      "--output", options->output,
      "folder for evaluation.json, trajectory.svg and report.html (the run folder)");
  command->add_flag("--report", options->report,
                    "without --dataset: write report.html of a run that has no ground truth");
  command->add_flag("--json", options->json, "print JSON instead of a table");
  command->callback([options] { evaluate(*options); });
}

}  // namespace rover
