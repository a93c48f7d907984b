// Matching of real images, judged by their ground truth: thresholds a little below what was
// measured (docs/matching.md), so that a regression fails.

#include "rover/matching/real_pairs.h"

#include <memory>
#include <optional>

#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/matching/epipolar.h"
#include "rover/matching/feature_family.h"
#include "rover/matching/lightglue_matcher.h"
#include "rover/matching/mutual_nearest_neighbour.h"
#include "rover/matching/stereo_matching.h"

namespace rover {
namespace {

std::shared_ptr<Runtime> runtime() {
  static const auto shared = std::make_shared<Runtime>(RuntimeOptions{});
  return shared;
}

// The family, or why the test has to be skipped.
struct Available {
  std::optional<FeatureFamily> family;
  std::string missing;
};

Available find_family(const real_pairs::Sequence& sequence, const std::string& name) {
  if (sequence.frames.empty()) return {std::nullopt, "no real images in ../shared/data"};
  try {
    return {make_feature_family(name, *runtime()), ""};
  } catch (const InputError& error) {
    return {std::nullopt, error.what()};
  }
}

struct WideResult {
  int matches = 0, correct = 0;
  double precision() const { return static_cast<double>(correct) / matches; }
};

// Matches of pairs 12 to 45 degrees and 0.4 to 2 m apart, 600 features each.
template <class MatchPair>
WideResult match_wide(const real_pairs::Sequence& sequence, const Extractor& extractor,
                      const MatchPair& match_pair) {
  WideResult result;
  ExtractionRequest request;
  request.budget = 600;
  for (const auto& [i, j] : real_pairs::wide_pairs(sequence, 12)) {
    const FeatureSet a = extractor.extract(sequence.frames[i].left_image(), request);
    const FeatureSet b = extractor.extract(sequence.frames[j].left_image(), request);
    const auto rays_a = observe_rays(sequence.rig.cameras[0], a.positions);
    const auto rays_b = observe_rays(sequence.rig.cameras[0], b.positions);
    const SE3 truth = sequence.relative_pose(i, j);
    for (const Match& match : match_pair(a, b)) {
      ++result.matches;
      if (epipolar_distance(rays_a[match.a], rays_b[match.b], truth) < 3) ++result.correct;
    }
  }
  return result;
}

struct Expected {
  const char* family;
  int correct;
  double precision;
};

class WideBaseline : public testing::TestWithParam<Expected> {};

INSTANTIATE_TEST_SUITE_P(
    Families, WideBaseline,
    testing::Values(Expected{"xfeat-corner", 1070, 0.72}, Expected{"xfeat", 740, 0.64},
                    Expected{"aliked-t16", 1100, 0.80}, Expected{"aliked-n16", 1400, 0.82},
                    Expected{"superpoint", 890, 0.60}, Expected{"orb", 170, 0.66}),
    [](const auto& tested) {
      std::string name = tested.param.family;
      std::erase(name, '-');
      return name;
    });

TEST_P(WideBaseline, FamilysMatcherFindsTrueMatches) {
  const auto sequence = real_pairs::euroc();
  const Available found = find_family(sequence, GetParam().family);
  if (!found.family) GTEST_SKIP() << found.missing;
  const FeatureFamily& family = *found.family;
  const auto result = match_wide(
      sequence, *family.extractor,
      [&](const FeatureSet& a, const FeatureSet& b) { return family.matcher->match({a}, {b}); });
  RecordProperty("correct", result.correct);
  RecordProperty("precision", std::to_string(result.precision()));
  EXPECT_GE(result.correct, GetParam().correct);
  EXPECT_GE(result.precision(), GetParam().precision);
}

TEST(LightGlue, BeatsNearestNeighboursAndGainsFromDepth) {
  const auto sequence = real_pairs::euroc();
  const Available found = find_family(sequence, "xfeat-corner");
  if (!found.family) GTEST_SKIP() << found.missing;
  const FeatureFamily& family = *found.family;
  const auto with = [&](const Matcher& matcher) {
    return match_wide(sequence, *family.extractor, [&](const FeatureSet& a, const FeatureSet& b) {
      return matcher.match({a}, {b});
    });
  };
  LightGlueOptions shallow = lighterglue_options();
  shallow.max_layers = 1;
  const double full = with(*family.matcher).precision();
  EXPECT_GT(full, with(LightGlueMatcher(*runtime(), shallow)).precision() + 0.02);
  EXPECT_GT(full, with(MutualNearestNeighbourMatcher()).precision() + 0.1);
}

// Early exit and pruning save layers and points; nearly all matches are those of the full depth.
TEST(LightGlue, LeavesEarlyOnEasyPairsWithTheSameMatches) {
  const auto sequence = real_pairs::euroc();
  const Available found = find_family(sequence, "xfeat-corner");
  if (!found.family) GTEST_SKIP() << found.missing;
  const FeatureFamily& family = *found.family;
  ExtractionRequest request;
  request.budget = 500;
  const FeatureSet a = family.extractor->extract(sequence.frames[1].left_image(), request);
  const FeatureSet b = family.extractor->extract(sequence.frames[2].left_image(), request);
  LightGlueOptions full = lighterglue_options();
  full.exit_share = 2;
  full.prune_matchability = 0;
  const auto deep = LightGlueMatcher(*runtime(), full).run({a}, {b});
  const auto fast = LightGlueMatcher(*runtime(), lighterglue_options()).run({a}, {b});
  EXPECT_EQ(deep.layers, 6);
  EXPECT_EQ(deep.pruned, 0);
  EXPECT_LT(fast.layers, 6);
  int same = 0;
  for (const Match& m : fast.matches) {
    same +=
        std::ranges::any_of(deep.matches, [&](const Match& d) { return d.a == m.a && d.b == m.b; });
  }
  EXPECT_GT(same, 0.93 * static_cast<double>(fast.matches.size()));
  EXPECT_GT(fast.matches.size(), 0.9 * static_cast<double>(deep.matches.size()));
}

TEST(LightGlue, MatchesAreOneToOneOrderedAndReproducible) {
  const auto sequence = real_pairs::euroc();
  const Available found = find_family(sequence, "xfeat-corner");
  if (!found.family) GTEST_SKIP() << found.missing;
  const FeatureFamily& family = *found.family;
  const FeatureSet a = family.extractor->extract(sequence.frames[5].left_image(), {});
  const FeatureSet b = family.extractor->extract(sequence.frames[6].left_image(), {});
  const auto first = family.matcher->match({a}, {b}), second = family.matcher->match({a}, {b});
  ASSERT_EQ(first.size(), second.size());
  std::vector<char> taken(b.size(), 0);
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].a, second[i].a);
    EXPECT_EQ(first[i].b, second[i].b);
    EXPECT_EQ(first[i].score, second[i].score);
    EXPECT_FALSE(taken[first[i].b]++);
    EXPECT_TRUE(i == 0 || first[i].a > first[i - 1].a);
    EXPECT_TRUE(first[i].score > 0.1f && first[i].score <= 1);
  }
}

TEST(LightGlue, TakesAnyNumberOfPoints) {
  const auto sequence = real_pairs::euroc();
  const Available found = find_family(sequence, "xfeat-corner");
  if (!found.family) GTEST_SKIP() << found.missing;
  const FeatureFamily& family = *found.family;
  const FeatureSet a = family.extractor->extract(sequence.frames[5].left_image(), {});
  const auto first = [&](int count) {
    FeatureSet few = a;
    few.positions.resize(count);
    few.descriptors.conservativeResize(count, few.descriptors.cols());
    return few;
  };
  for (const int m : {0, 1, 2, 50}) {
    for (const int n : {0, 1, 2, 50}) {
      const auto matches = family.matcher->match({first(m)}, {first(n)});
      EXPECT_LE(static_cast<int>(matches.size()), std::min(m, n));
    }
  }
  EXPECT_GT(family.matcher->match({first(50)}, {first(50)}).size(), 45u);
}

TEST(FeatureFamilies, HaveMatcherAndThresholds) {
  EXPECT_THROW(make_feature_family("no-such", *runtime()), InputError);
  const FeatureFamily orb = make_feature_family("orb", *runtime());
  EXPECT_EQ(with_matcher(orb, "learned").matcher, orb.matcher);
  EXPECT_EQ(with_matcher(orb, "classical").matcher, orb.classical);
  EXPECT_THROW(with_matcher(orb, "no-such"), InputError);
  EXPECT_EQ(orb.name, "orb");
  EXPECT_NO_THROW(orb.guided.check());
  EXPECT_EQ(feature_family_names().front(), "xfeat-corner");
}

struct StereoResult {
  int features = 0, aligned = 0, near_line = 0;
};

// A search in a band ten times as wide as needed: wrong matches spread over it, so the share close
// to the true line says how many are right.
StereoResult match_stereo_pairs(const real_pairs::Sequence& sequence, const Extractor& extractor,
                                int step) {
  StereoResult result;
  StereoMatchingOptions options;
  options.epipolar_gate = 16;
  const SE3 right_from_left =
      sequence.rig.body_from_camera[1].inverse() * sequence.rig.body_from_camera[0];
  for (std::size_t i = 0; i < sequence.frames.size(); i += step) {
    const cv::Mat left = sequence.frames[i].left_image(), right = sequence.frames[i].right_image();
    if (right.empty()) continue;
    const FeatureSet a = extractor.extract(left, {}), b = extractor.extract(right, {});
    const auto rays = observe_rays(sequence.rig.cameras[0], a.positions);
    result.features += a.size();
    for (const StereoMatch& match : match_stereo(a, left, b, right, sequence.rig, options)) {
      if (match.sigma >= 1) continue;
      const std::vector<Eigen::Vector2f> position = {match.position};
      const auto ray = observe_rays(sequence.rig.cameras[1], position);
      ++result.aligned;
      result.near_line += epipolar_distance(rays[match.left], ray[0], right_from_left) < 1.5;
    }
  }
  return result;
}

TEST(RealStereo, KittiMatchesLieOnTheirLines) {
  const auto sequence = real_pairs::kitti();
  const Available found = find_family(sequence, "xfeat-corner");
  if (!found.family) GTEST_SKIP() << found.missing;
  const FeatureFamily& family = *found.family;
  const auto result = match_stereo_pairs(sequence, *family.extractor, 40);
  EXPECT_GT(result.aligned, 0.45 * result.features);
  EXPECT_GT(result.near_line, 0.95 * result.aligned);
}

TEST(RealStereo, EurocMatchesLieOnTheirLines) {
  const auto sequence = real_pairs::euroc();
  const Available found = find_family(sequence, "xfeat-corner");
  if (!found.family) GTEST_SKIP() << found.missing;
  const FeatureFamily& family = *found.family;
  const auto result = match_stereo_pairs(sequence, *family.extractor, 20);
  EXPECT_GT(result.aligned, 0.55 * result.features);
  EXPECT_GT(result.near_line, 0.97 * result.aligned);
}

}  // namespace
}  // namespace rover
