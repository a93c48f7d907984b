#include "rover/tracking/mono_initializer.h"

#include <algorithm>
#include <cmath>

#include "rover/base/error.h"
#include "rover/base/quantile.h"
#include "rover/base/random.h"
#include "rover/matching/partial_matching.h"

namespace rover {
namespace {

// Px in an image 640 wide.
double median_motion(const Frame& first, const Frame& second, const std::vector<Match>& matches) {
  std::vector<float> motions;
  for (const Match& match : matches) {
    motions.push_back((first[match.a].pixel - second[match.b].pixel).norm());
  }
  return 640.0 * median(std::move(motions)) / first.features->image_size.width;
}

}  // namespace

void MonoInitializerOptions::check() const {
  require(min_features > 8 && min_matches > 8,
          "initialization.min_features and min_matches must be above 8");
  require(max_pending >= 0 && max_reference_age > 0,
          "initialization.max_pending and max_reference_age must not be negative");
  require(preview_share > 0 && preview_share <= 1,
          "initialization.preview_share is {}; use a share up to 1", preview_share);
  two_view.check();
}

MonoInitializer::MonoInitializer(std::shared_ptr<const Rig> rig,
                                 std::shared_ptr<const Matcher> matcher,
                                 const MonoInitializerOptions& options, std::uint64_t seed)
    : rig_(std::move(rig)), matcher_(std::move(matcher)), options_(options), seed_(seed) {
  options_.check();
}

std::optional<InitialViews> MonoInitializer::offer(Frame frame) {
  const auto few = join(frame, options_.preview_share);
  if (!few) {
    replace_reference(std::move(frame));
    return std::nullopt;
  }
  auto views = try_views(frame, *few);
  if (views) {
    reference_.reset();
  } else {
    keep(std::move(frame));
  }
  return views;
}

// The matches of the best features tell at a fraction of the time whether there is a solution.
std::optional<InitialViews> MonoInitializer::try_views(const Frame& frame,
                                                       const std::vector<Match>& few) const {
  if (median_motion(*reference_, frame, few) < options_.min_motion) return std::nullopt;
  if (!solve(frame, few, options_.preview_share)) return std::nullopt;
  const auto all = join(frame, 1);
  return all ? solve(frame, *all, 1) : std::nullopt;
}

// Matches with the reference; nothing where there is no reference, or none that serves.
std::optional<std::vector<Match>> MonoInitializer::join(const Frame& frame, double share) const {
  if (!reference_ || frame.id.value - reference_->id.value > options_.max_reference_age) {
    return std::nullopt;
  }
  auto matches = match_best(*matcher_, {*reference_->features, &reference_->image},
                            {*frame.features, &frame.image}, share);
  if (static_cast<double>(matches.size()) < share * options_.min_matches) return std::nullopt;
  return matches;
}

void MonoInitializer::replace_reference(Frame frame) {
  if (reference_) keep(std::move(*reference_));
  reference_.reset();
  if (frame.size() >= options_.min_features) {
    reference_ = std::move(frame);
  } else {
    keep(std::move(frame));
  }
}

std::optional<InitialViews> MonoInitializer::solve(const Frame& frame,
                                                   const std::vector<Match>& matches,
                                                   double share) const {
  const Camera& camera = rig_->cameras[0];
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
  options.min_points = static_cast<int>(std::ceil(share * options.min_points));
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
