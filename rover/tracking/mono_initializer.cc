#include "rover/tracking/mono_initializer.h"

#include <algorithm>

#include "rover/base/error.h"
#include "rover/base/random.h"

namespace rover {
namespace {

double median_motion(const Frame& first, const Frame& second, const std::vector<Match>& matches) {
  std::vector<float> motions;
  for (const Match& match : matches) {
    motions.push_back((first[match.a].pixel - second[match.b].pixel).norm());
  }
  const auto middle = motions.begin() + static_cast<std::ptrdiff_t>(motions.size() / 2);
  std::nth_element(motions.begin(), middle, motions.end());
  return *middle;
}

}  // namespace

void MonoInitializerOptions::check() const {
  require(min_features > 8 && min_matches > 8,
          "initialization.min_features and min_matches must be above 8");
  require(max_pending >= 0 && max_reference_age > 0,
          "initialization.max_pending and max_reference_age must not be negative");
  two_view.check();
}

MonoInitializer::MonoInitializer(std::shared_ptr<const Rig> rig,
                                 std::shared_ptr<const Matcher> matcher,
                                 const MonoInitializerOptions& options, std::uint64_t seed)
    : rig_(std::move(rig)), matcher_(std::move(matcher)), options_(options), seed_(seed) {
  options_.check();
}

std::optional<InitialViews> MonoInitializer::offer(Frame frame) {
  const bool rich = frame.size() >= options_.min_features;
  const bool stale =
      reference_ && frame.id.value - reference_->id.value > options_.max_reference_age;
  if (reference_ && !stale) {
    const auto matches = matcher_->match({*reference_->features, &reference_->image},
                                         {*frame.features, &frame.image});
    if (static_cast<int>(matches.size()) >= options_.min_matches) {
      auto views = solve(frame, matches);
      if (views) {
        reference_.reset();
      } else {
        keep(std::move(frame));
      }
      return views;
    }
  }
  if (reference_) keep(std::move(*reference_));
  reference_.reset();
  if (rich) {
    reference_ = std::move(frame);
  } else {
    keep(std::move(frame));
  }
  return std::nullopt;
}

std::optional<InitialViews> MonoInitializer::solve(const Frame& frame,
                                                   const std::vector<Match>& matches) const {
  const Camera& camera = rig_->cameras[0];
  if (median_motion(*reference_, frame, matches) < options_.min_motion * camera.width() / 640) {
    return std::nullopt;
  }
  std::vector<BearingPair> pairs;
  std::vector<Match> used;
  for (const Match& match : matches) {
    const auto first = camera.unproject((*reference_)[match.a].pixel.cast<double>());
    const auto second = camera.unproject(frame[match.b].pixel.cast<double>());
    if (!first || !second) continue;
    pairs.push_back({*first, *second});
    used.push_back(match);
  }
  TwoViewOptions options = options_.two_view;
  options.focal_length = camera.focal_length();
  options.ransac.seed = hash_seed(seed_, static_cast<std::uint64_t>(frame.id.value));
  const auto solution = estimate_two_view(pairs, options).result;
  if (!solution) return std::nullopt;
  InitialViews views{*reference_, frame, {}};
  const SE3 camera_from_body = rig_->body_from_camera[0].inverse();
  views.first.world_from_body = camera_from_body;
  views.second.world_from_body = solution->second_from_first.inverse() * camera_from_body;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (const auto& point = solution->points[i]) {
      views.points.push_back({*point, used[i].a, used[i].b});
    }
  }
  return views;
}

void MonoInitializer::keep(Frame frame) {
  pending_.push_back(std::move(frame));
  while (static_cast<int>(pending_.size()) > options_.max_pending) pending_.pop_front();
}

std::vector<Frame> MonoInitializer::take_pending() {
  std::vector<Frame> frames(std::make_move_iterator(pending_.begin()),
                            std::make_move_iterator(pending_.end()));
  pending_.clear();
  std::sort(frames.begin(), frames.end(),
            [](const Frame& a, const Frame& b) { return a.time < b.time; });
  return frames;
}

void MonoInitializer::reset() {
  reference_.reset();
  pending_.clear();
}

}  // namespace rover
