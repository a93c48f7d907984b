#include "rover/evaluation/verdict.h"

#include <algorithm>

#include <fmt/format.h>

namespace rover {
namespace {

double share_tracked(const RunFolder& run) {
  return static_cast<double>(run.final.size()) /
         static_cast<double>(std::max<std::size_t>(1, run.offered.frames));
}

int events(const RunFolder& run) {
  int lost = 0;
  bool tracked = false;
  for (const FrameLine& frame : run.frames) {
    lost += tracked && frame.state == "lost";
    if (frame.state == "ok" || frame.state == "lost") tracked = frame.state == "ok";
  }
  return lost;
}

std::string tracking_words(const RunFolder& run) {
  std::string text = fmt::format("{} of {} frames have a pose ({:.1f}%).", run.final.size(),
                                 run.offered.frames, 100 * share_tracked(run));
  if (const auto after = run.initialised_after()) {
    text += fmt::format(" The first pose came {:.2f} s after the first frame", *after);
  }
  const int lost = events(run);
  text += lost == 0 ? "; tracking was never lost."
                    : fmt::format("; tracking was lost {} time{}.", lost, lost == 1 ? "" : "s");
  const auto dropped = run.states.find("dropped");
  if (dropped != run.states.end()) {
    text += fmt::format(" {} frames came too fast and were dropped.", dropped->second);
  }
  return text;
}

const char* freedom(AlignmentKind kind) {
  switch (kind) {
    case AlignmentKind::kSimilarity:
      return "the best rotation, translation and scale (one camera alone does not know its scale)";
    case AlignmentKind::kUpright:
      return "the best translation and turn about the vertical";
    case AlignmentKind::kRigid:
      return "the best rotation and translation";
  }
  return "";
}

std::string accuracy_words(const Judgement& judgement, const ReportOptions& options) {
  const auto& errors = errors_under(judgement, options.headline);
  if (!errors) {
    return "The poses do not suffice to lay the trajectory over the ground truth: it stays "
           "unjudged.";
  }
  std::string text = fmt::format(
      "Laid over the ground truth by {}, the final trajectory is off by {} (root mean square; at "
      "most {}) on a way of {}",
      freedom(options.headline), length_words(errors->position.rmse),
      length_words(errors->position.max), length_words(judgement.path));
  text += judgement.path > 0
              ? fmt::format(": {:.2f}% of it.", 100 * errors->position.rmse / judgement.path)
              : ".";
  if (errors->drift) {
    text += fmt::format(
        " For {:.0f} s in between there is no ground truth; laid over its beginning only, the end "
        "is off by {}, {:.2f}% of the way.",
        errors->drift->blind, length_words(errors->drift->position.rmse), errors->drift->percent);
  }
  return text;
}

// ms between frames; 0 if there are too few.
double frame_interval(const RunFolder& run) {
  if (run.offered.frames < 2) return 0;
  return 1000 * seconds_between(run.offered.first, run.offered.last) /
         static_cast<double>(run.offered.frames - 1);
}

std::string speed_words(const RunFolder& run) {
  std::vector<double> times;
  for (const FrameLine& frame : run.frames) {
    if (frame.frame_ms > 0) times.push_back(frame.frame_ms);
  }
  if (times.empty()) return "";
  std::sort(times.begin(), times.end());
  const double p95 = times[static_cast<std::size_t>(0.95 * static_cast<double>(times.size() - 1))];
  const double median = times[times.size() / 2];
  const double interval = frame_interval(run);
  const bool inline_mapping = !run.summary.value("realtime", false);
  std::string text = fmt::format("A frame took {:.1f} ms{} (median; 95% within {:.1f} ms)", median,
                                 inline_mapping ? ", a keyframe's mapping included" : "", p95);
  if (interval <= 0) return text + ".";
  return text + fmt::format("; a new one came every {:.1f} ms: {}.", interval,
                            p95 <= interval      ? "that keeps up with the camera"
                            : median <= interval ? "that keeps up with the camera most of the time"
                                                 : "that is slower than the camera");
}

}  // namespace

std::string length_words(double metres) {
  if (metres < 0.1) return fmt::format("{:.1f} mm", 1000 * metres);
  if (metres < 1) return fmt::format("{:.1f} cm", 100 * metres);
  return fmt::format("{:.2f} m", metres);
}

std::vector<std::string> verdict(const RunFolder& run, const std::vector<Judgement>& judgements,
                                 const ReportOptions& options) {
  std::vector<std::string> sentences = {tracking_words(run)};
  sentences.push_back(judgements.empty() ? "There is no ground truth to compare with."
                                         : accuracy_words(judgements.front(), options));
  if (const std::string speed = speed_words(run); !speed.empty()) sentences.push_back(speed);
  return sentences;
}

}  // namespace rover
