#include "rover/mapping/keyframe_culling.h"

#include <gtest/gtest.h>

#include "rover/base/error.h"
#include "rover/map/test_map.h"

namespace rover {
namespace {

// Keyframes 50 ms apart.
TEST(KeyframeCulling, LeavesNoLongGapInTime) {
  Map map = test_map(30, 10, 0.1);
  map.set_inertial({.aligned = true});
  const KeyframeId newest{29};
  const CullingGaps gaps{
      .close = 0.06, .sparse_landmarks = 10, .recent = 0.12, .old = 0.22, .window = 5};
  EXPECT_FALSE(leaves_gap(map, {27}, newest, gaps));
  map.retire({27});
  EXPECT_TRUE(leaves_gap(map, {28}, newest, gaps));  // 0.15 s among the recent ones
  EXPECT_FALSE(leaves_gap(map, {11}, newest, gaps));
  for (const int culled : {11, 12}) map.retire({culled});
  EXPECT_FALSE(leaves_gap(map, {13}, newest, gaps));  // 0.2 s among the old ones
  map.retire({13});
  EXPECT_TRUE(leaves_gap(map, {14}, newest, gaps));
  map.set_inertial({});
  EXPECT_TRUE(leaves_gap(map, {10}, newest, gaps));  // not aligned yet: all are recent
}

TEST(KeyframeCulling, KeepsKeyframesCloseWhereMuchHangsOnInertialData) {
  Map stereo = test_map(30, 10, 0.1), mono = test_map(30, 10);
  stereo.set_inertial({.aligned = true});
  mono.set_inertial({.aligned = true});
  CullingGaps gaps{.close = 0.06, .sparse_landmarks = 10};
  EXPECT_FALSE(leaves_gap(stereo, {11}, {29}, gaps));
  EXPECT_TRUE(leaves_gap(mono, {11}, {29}, gaps));
  gaps.sparse_landmarks = 11;
  EXPECT_TRUE(leaves_gap(stereo, {11}, {29}, gaps));
  gaps.settled = 0.5;  // so long ago nothing does
  EXPECT_FALSE(leaves_gap(stereo, {11}, {29}, gaps));
  EXPECT_FALSE(leaves_gap(mono, {11}, {29}, gaps));
}

TEST(KeyframeCulling, LetsVisionHoldWhatIsLongAgo) {
  Map map = test_map(30, 10);
  map.set_inertial({.aligned = true});
  const CullingGaps gaps{.close = 0.05, .recent = 0.05, .old = 0.05, .settled = 1};
  EXPECT_FALSE(leaves_gap(map, {5}, {29}, gaps));
  EXPECT_TRUE(leaves_gap(map, {15}, {29}, gaps));
  EXPECT_TRUE(leaves_gap(map, {0}, {29}, gaps));  // the map's begin stays
}

TEST(KeyframeCulling, KeepsBothEnds) {
  const Map map = test_map(5, 10);
  EXPECT_TRUE(leaves_gap(map, {0}, {4}, {}));
  EXPECT_TRUE(leaves_gap(map, {4}, {4}, {}));
}

TEST(KeyframeCulling, RefusesGapsThatMakeNoSense) {
  EXPECT_THROW((CullingGaps{.close = 0}.check()), InputError);
  EXPECT_THROW((CullingGaps{.recent = 0.1}.check()), InputError);  // less than `close`
  EXPECT_THROW((CullingGaps{.recent = 2, .old = 1}.check()), InputError);
  EXPECT_THROW((CullingGaps{.settled = 0}.check()), InputError);
}

}  // namespace
}  // namespace rover
