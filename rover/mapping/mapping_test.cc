// Mapping on small made worlds.
#include <gtest/gtest.h>

#include "rover/map/test_map.h"
#include "rover/mapping/keyframe_culling.h"
#include "rover/mapping/local_mapper.h"
#include "rover/mapping/reprojection_check.h"
#include "rover/matching/test_matcher.h"

namespace rover {
namespace {

constexpr KeyframeId kFirst{0}, kSecond{1};

double mean_error(const Map& map) {
  double sum = 0;
  int count = 0;
  for (const Landmark& landmark : map.landmarks()) {
    for (const auto& [keyframe, feature] : landmark.observations) {
      sum += std::sqrt(reprojection_chi2(map, landmark.position, keyframe, feature, {}));
      ++count;
    }
  }
  return sum / count;
}

// Two or more keyframes `step` apart that share no landmark yet.
Map blank_views(const std::vector<Eigen::Vector3d>& points, double step, int keyframes = 2,
                double baseline = 0) {
  auto rig = std::make_shared<const Rig>(test_rig(baseline));
  Map map({0}, rig, std::make_shared<IdSource>());
  for (int k = 0; k < keyframes; ++k) {
    const SE3 pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(step * k, 0, 0));
    map.add_keyframe(test_frame(*rig, points, pose, k));
  }
  return map;
}

TriangulationCounts match_views(Map& map, std::vector<Match> matches,
                                const LandmarkCreationOptions& options = {}) {
  std::vector<LandmarkId> created;
  const auto counts = apply_matches(map, kSecond, {kFirst, std::move(matches)}, options, created);
  EXPECT_EQ(created.size(), static_cast<std::size_t>(counts.created));
  EXPECT_TRUE(is_consistent(map));
  return counts;
}

TEST(ApplyMatches, CreatesLandmarksWhereTheyAre) {
  const auto points = test_points(40, 1);
  Map map = blank_views(points, 0.3);
  std::vector<Match> matches;
  for (int i = 0; i < 40; ++i) matches.push_back({i, i, 1});
  const auto counts = match_views(map, matches);
  EXPECT_EQ(counts.created, 40);
  EXPECT_EQ(counts.joined + counts.fused, 0);
  ASSERT_EQ(map.landmarks().size(), 40u);
  for (const Landmark& landmark : map.landmarks()) {
    ASSERT_EQ(landmark.observations.size(), 2u);
    const auto index = static_cast<std::size_t>(landmark.observations.front().feature);
    EXPECT_LT((landmark.position - points[index]).norm(), 1e-3);
  }
}

TEST(ApplyMatches, RefusesRaysThatAreNearlyParallel) {
  const auto points = test_points(40, 1);
  std::vector<Match> matches;
  for (int i = 0; i < 40; ++i) matches.push_back({i, i, 1});
  Map near = blank_views(points, 0.03);  // 0.6 degrees or less
  EXPECT_EQ(match_views(near, matches).created, 0);
  LandmarkCreationOptions lenient;
  lenient.min_parallax = 0.1;
  EXPECT_EQ(match_views(near, matches, lenient).created, 40);
}

TEST(ApplyMatches, TakesDepthFromStereoWhereThereIsNoParallax) {
  const auto points = test_points(40, 1);
  std::vector<Match> matches;
  for (int i = 0; i < 40; ++i) matches.push_back({i, i, 1});
  Map map = blank_views(points, 0.03, 2, 0.2);
  EXPECT_EQ(match_views(map, matches).created, 40);
  for (const Landmark& landmark : map.landmarks()) {
    const auto index = static_cast<std::size_t>(landmark.observations.front().feature);
    EXPECT_LT((landmark.position - points[index]).norm(), 1e-3);
  }
}

TEST(ApplyMatches, RefusesRaysThatDoNotMeet) {
  const std::vector<Eigen::Vector3d> points = {{0, 0, 4}, {0, 0.5, 4}, {0.4, -0.3, 3}};
  Map map = blank_views(points, 0.3);
  const auto counts = match_views(map, {{0, 1, 1}, {1, 0, 1}, {2, 2, 1}});
  EXPECT_EQ(counts.created, 1);
  EXPECT_TRUE(map.at(kFirst).frame[2].landmark.valid());
}

TEST(ApplyMatches, RefusesPointsBehindTheCameras) {
  const std::vector<Eigen::Vector3d> points = {{0, 0, 4}, {0.9, 0, 4}};
  Map map = blank_views(points, 0.3);
  // Feature 0 of the right view with feature 1 of the left one: the rays part in front.
  EXPECT_EQ(match_views(map, {{1, 0, 1}}).created, 0);
}

TEST(ApplyMatches, JoinsALandmarkToWhatSeesItToo) {
  const auto points = test_points(20, 1);
  Map map = blank_views(points, 0.3);
  const LandmarkId left = map.add_landmark(points[3], kFirst, 3);
  const LandmarkId right = map.add_landmark(points[4], kSecond, 4);
  const LandmarkId wrong = map.add_landmark(points[5] + Eigen::Vector3d(0, 0.3, 0), kFirst, 5);
  const auto counts = match_views(map, {{3, 3, 1}, {4, 4, 1}, {5, 5, 1}});
  EXPECT_EQ(counts.joined, 2);
  EXPECT_EQ(counts.created, 0);
  EXPECT_TRUE(map.at(left).has_observation(kSecond));
  EXPECT_TRUE(map.at(right).has_observation(kFirst));
  EXPECT_FALSE(map.at(wrong).has_observation(kSecond));
}

TEST(ApplyMatches, FusesTwoLandmarksThatAreOne) {
  const auto points = test_points(20, 1);
  Map map = blank_views(points, 0.3, 3);
  const LandmarkId often = map.add_landmark(points[3], kFirst, 3);
  ASSERT_TRUE(map.observe(often, {2}, 3));
  const LandmarkId seldom = map.add_landmark(points[3], kSecond, 3);
  const LandmarkId here = map.add_landmark(points[4], kFirst, 4);
  const LandmarkId elsewhere = map.add_landmark(points[9], kSecond, 9);
  const auto counts = match_views(map, {{3, 3, 1}, {9, 4, 1}});
  EXPECT_EQ(counts.fused, 1);
  EXPECT_EQ(map.find(seldom), nullptr);
  EXPECT_EQ(map.at(often).observations.size(), 3u);
  EXPECT_TRUE(map.find(here) && map.find(elsewhere));
}

TEST(ApplyMatches, KeyframesThatAreGoneSayNothing) {
  Map map = test_map(3, 30);
  map.retire(kSecond);
  EXPECT_EQ(match_views(map, {{0, 0, 1}}).created, 0);
}

TEST(ChooseNeighbours, TakesFewWithBaselineAndLandmarksInCommon) {
  const Map map = test_map(6, 60);
  LandmarkCreationOptions options;
  options.neighbours = 2;
  const auto chosen = choose_neighbours(map, {5}, options);
  ASSERT_EQ(chosen.size(), 2u);
  for (const KeyframeId id : chosen) EXPECT_NE(id, KeyframeId{5});
  options.neighbours = 20;
  EXPECT_EQ(choose_neighbours(map, {5}, options).size(), 5u);
  options.min_baseline = 0.06;  // of a depth of about 4: the two nearest are too near
  EXPECT_EQ(choose_neighbours(map, {5}, options).size(), 3u);
}

// A body that looks elsewhere soon shares nothing with what it saw, but for the keyframes on the
// way.
TEST(ChooseNeighbours, TakesThoseBeforeInTimeWhereFewLandmarksAreShared) {
  Map map = test_map(6, 40);
  for (int i = 5; i < 40; ++i) map.forget({i}, {5});
  EXPECT_EQ(choose_neighbours(map, {5}, {}),
            (std::vector<KeyframeId>{KeyframeId{4}, KeyframeId{3}, KeyframeId{2}}));
  LandmarkCreationOptions far;
  far.min_baseline = 0.06;  // of a depth of about 4
  EXPECT_EQ(choose_neighbours(map, {5}, far),
            (std::vector<KeyframeId>{KeyframeId{2}, KeyframeId{1}, KeyframeId{0}}));
}

TEST(IsRedundant, WhenThreeOthersSeeTheSame) {
  Map map = test_map(6, 40);
  EXPECT_TRUE(is_redundant(map, {2}, {5}, 0.9));
  EXPECT_FALSE(is_redundant(map, {0}, {5}, 0.9));  // the first of the map
  EXPECT_FALSE(is_redundant(map, {5}, {5}, 0.9));  // the newest
  EXPECT_FALSE(is_redundant(map, map.at(KeyframeId{5}).parent, {5}, 0.9));
  for (int i = 0; i < 10; ++i) {  // a quarter is seen by two others only
    for (const KeyframeId id : {KeyframeId{3}, KeyframeId{4}, KeyframeId{5}}) map.forget({i}, id);
  }
  EXPECT_FALSE(is_redundant(map, {2}, {5}, 0.9));
  EXPECT_TRUE(is_redundant(map, {2}, {5}, 0.7));
}

// A world whose last keyframe lies at an error, with half of its landmarks not made yet.
Map disturbed_world(double baseline) {
  Map map = test_map(6, 120, baseline);
  for (int i = 60; i < 120; ++i) map.remove(LandmarkId{i});
  Random random(4);
  for (int k = 2; k < 6; ++k) {
    Vector6d noise;
    for (int i = 0; i < 6; ++i) noise[i] = (i < 3 ? 0.004 : 0.001) * random.gaussian();
    map.set_pose({k}, map.at(KeyframeId{k}).world_from_body() * se3_exp(noise));
  }
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d noise(random.gaussian(), random.gaussian(), random.gaussian());
    map.set_position({i}, map.at(LandmarkId{i}).position + 0.01 * noise);
  }
  return map;
}

TEST(LocalMapper, LowersTheErrorAndKeepsTheMapWhole) {
  for (const double baseline : {0.0, 0.15}) {
    SharedMap map(disturbed_world(baseline));
    const double before = mean_error(*map.view());
    LocalMapper mapper(test_family(), {});
    for (const std::int64_t keyframe : {3, 4, 5}) {
      mapper.process(map, {keyframe});
      EXPECT_TRUE(is_consistent(*map.view()));
    }
    EXPECT_LT(mean_error(*map.view()), 0.3 * before) << baseline;
  }
}

TEST(LocalMapper, MakesTheLandmarksThatAreMissing) {
  Map world = test_map(6, 120);
  for (int i = 60; i < 120; ++i) world.remove(LandmarkId{i});
  SharedMap map(std::move(world));
  LocalMapper mapper(test_family(), {});
  const MappingReport report = mapper.process(map, {5});
  EXPECT_EQ(report.triangulation.created, 60);
  EXPECT_EQ(map.view()->landmarks().size(), 120u);
  EXPECT_FALSE(report.times.empty());
}

// Matches nothing, and counts how often it was asked.
class CountingMatcher : public Matcher {
 public:
  std::vector<Match> match(const MatchInput&, const MatchInput&) const override {
    ++calls;
    return {};
  }
  mutable int calls = 0;
};

TEST(LocalMapper, AsksTheLearnedMatcherForTheBestNeighboursOnly) {
  for (const bool in_a_hurry : {false, true}) {
    for (const int wanted : {0, 1, 2, 9}) {
      const auto learned = std::make_shared<CountingMatcher>();
      const auto classical = std::make_shared<CountingMatcher>();
      FeatureFamily family;
      family.matcher = learned;
      family.classical = classical;
      LocalMapperOptions options;
      options.creation.learned_neighbours = wanted;
      SharedMap map(test_map(6, 120));
      LocalMapper(family, options).process(map, {5}, [&] { return in_a_hurry; });
      EXPECT_EQ(learned->calls, std::min(wanted, in_a_hurry ? 1 : options.creation.neighbours));
      EXPECT_EQ(learned->calls + classical->calls, options.creation.neighbours);
    }
  }
}

TEST(LocalMapper, FusesWhatWasMadeTwice) {
  Map world = test_map(4, 80);
  const auto points = test_points(80, 1);
  for (int i = 0; i < 10; ++i) {
    world.forget({i}, {3});
    world.add_landmark(points[static_cast<std::size_t>(i)], {3}, i);
  }
  SharedMap map(std::move(world));
  LocalMapper mapper(test_family(), {});
  const MappingReport report = mapper.process(map, {3});
  EXPECT_EQ(report.fused + report.triangulation.fused, 10);
  EXPECT_EQ(map.view()->landmarks().size(), 80u);
  EXPECT_TRUE(is_consistent(*map.view()));
}

TEST(LocalMapper, CullsLandmarksThatAreNotFoundAgain) {
  Map world = test_map(3, 60);
  const auto fresh = world.add_keyframe(
      test_frame(world.rig(), test_points(60, 1), SE3(), 3));  // sees none of them yet
  const LandmarkId weak = world.add_landmark(test_points(60, 1)[0], fresh, 0);
  world.count_sighting(weak, 8, 1);
  SharedMap map(std::move(world));
  LocalMapper mapper(test_family(), {});
  const MappingReport report = mapper.process(map, fresh);
  EXPECT_EQ(report.culled_landmarks, 1);
  EXPECT_EQ(map.view()->find(weak), nullptr);
}

TEST(LocalMapper, DoesTheSameTwice) {
  SharedMap maps[2]{SharedMap(disturbed_world(0)), SharedMap(disturbed_world(0))};
  for (SharedMap& map : maps) LocalMapper(test_family(), {}).process(map, {5});
  ASSERT_EQ(maps[0].view()->landmarks().size(), maps[1].view()->landmarks().size());
  for (const Landmark& landmark : maps[0].view()->landmarks()) {
    EXPECT_EQ(landmark.position, maps[1].view()->at(landmark.id).position);
  }
}

TEST(LocalMapper, StillMakesLandmarksInAHurry) {
  Map world = test_map(6, 120);
  for (int i = 60; i < 120; ++i) world.remove(LandmarkId{i});
  SharedMap map(std::move(world));
  LocalMapper mapper(test_family(), {});
  const MappingReport report = mapper.process(map, {5}, [] { return true; });
  EXPECT_EQ(report.triangulation.created, 60);
  EXPECT_TRUE(is_consistent(*map.view()));
}

}  // namespace
}  // namespace rover
