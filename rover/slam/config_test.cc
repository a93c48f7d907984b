#include "rover/slam/config.h"

#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/datasets/test_folder.h"

namespace rover {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

using Settings = std::vector<std::pair<std::string, std::string>>;

// A config after reading one file.
Config loaded(const std::string& text) {
  const TestFolder folder;
  folder.write("rover.yaml", text);
  Config config;
  load_config(folder / "rover.yaml", config);
  return config;
}

// What is said of a file, and proof that such a file changes nothing.
std::string refusal(const std::string& text) {
  const TestFolder folder;
  folder.write("rover.yaml", text);
  Config config;
  config.frame.features = 777;
  const Settings before = list_config(config);
  const auto message = input_error_of([&] { load_config(folder / "rover.yaml", config); });
  EXPECT_EQ(list_config(config), before) << "a refused file left traces";
  EXPECT_THAT(message, HasSubstr("rover.yaml"));
  return message;
}

std::string value_of(const Config& config, const std::string& wanted) {
  for (const auto& [key, value] : list_config(config)) {
    if (key == wanted) return value;
  }
  ADD_FAILURE() << wanted << " is not listed";
  return "";
}

TEST(Config, DefaultsMakeSense) {
  const Config config;
  EXPECT_NO_THROW(config.check());
  EXPECT_GT(list_config(config).size(), 50u);
}

TEST(Config, EveryKeyIsListedOnce) {
  std::set<std::string> keys;
  for (const auto& [key, value] : list_config(Config())) {
    EXPECT_TRUE(keys.insert(key).second) << key;
    EXPECT_FALSE(value.empty()) << key;
  }
}

TEST(Config, WhatIsListedCanBeReadBack) {
  Config changed;
  changed.seed = 99;
  changed.family = "orb";
  changed.frame.features = 612;
  changed.extraction.adaptive = false;
  changed.weighting.model_sigma = 0.75;
  changed.weighting.disparity_sigma = 0.25;
  changed.tracking.keyframe.max_parallax = 33.25;
  changed.tracking.stereo.max_baselines = 35;
  changed.mapping.creation.chi2 = 7.5;
  changed.refinement.min_correlation = 0.625f;
  std::string text;
  for (const auto& [key, value] : list_config(changed)) text += key + ": " + value + "\n";
  EXPECT_EQ(list_config(loaded(text)), list_config(changed));
  EXPECT_NE(list_config(changed), list_config(Config()));
}

// Each number alone can be moved, and moves no other.
TEST(Config, KeysStandForThemselvesOnly) {
  const Settings before = list_config(Config());
  for (const std::string key : {"seed", "features", "mapping.window", "tracking.confident_inliers",
                                "stereo.min_landmarks", "tracking.motion_radius"}) {
    const Settings after = list_config(loaded(key + ": 60\n"));
    ASSERT_EQ(after.size(), before.size());
    for (std::size_t i = 0; i < after.size(); ++i) {
      EXPECT_EQ(after[i].second, after[i].first == key ? "60" : before[i].second) << key;
    }
  }
}

TEST(Config, KeysMayBeNested) {
  const Config nested = loaded(
      "# a comment\nkeyframe:\n  max_parallax: 44.5\n  min_gap: 3\n"
      "tracking:\n  learned: true\nseed: 7\n");
  EXPECT_EQ(nested.tracking.keyframe.max_parallax, 44.5);
  EXPECT_EQ(nested.tracking.keyframe.min_gap, 3);
  EXPECT_TRUE(nested.tracking.learned_tracking);
  EXPECT_EQ(nested.seed, 7u);
  EXPECT_EQ(list_config(nested),
            list_config(loaded("keyframe.max_parallax: 44.5\nkeyframe.min_gap: 3\n"
                               "tracking.learned: true\nseed: 7\n")));
}

TEST(Config, ReadsOnTopOfWhatIsSet) {
  const TestFolder folder;
  folder.write("rover.yaml", "seed: 5\n");
  Config config;
  config.frame.features = 640;
  load_config(folder / "rover.yaml", config);
  EXPECT_EQ(value_of(config, "features"), "640");
  EXPECT_EQ(value_of(config, "seed"), "5");
}

TEST(Config, AnEmptyFileSaysNothing) {
  EXPECT_EQ(list_config(loaded("")), list_config(Config()));
  EXPECT_EQ(list_config(loaded("# nothing\n")), list_config(Config()));
}

TEST(Config, UnknownKeysAreNamedWithTheirLine) {
  EXPECT_THAT(refusal("seed: 3\nfeaturs: 5\n"), AllOf(HasSubstr(":2:"), HasSubstr("'featurs'")));
  EXPECT_THAT(refusal("seed: 3\nkeyframe:\n  min_gap: 2\n  max_parallx: 5\n"),
              AllOf(HasSubstr(":4:"), HasSubstr("'keyframe.max_parallx'")));
  EXPECT_THAT(refusal("min_gap: 2\n"), HasSubstr("'min_gap'"));
}

TEST(Config, ValuesOfTheWrongKindAreNamedWithTheirLine) {
  EXPECT_THAT(refusal("\nfeatures: many\n"),
              AllOf(HasSubstr(":2:"), HasSubstr("features"), HasSubstr("many")));
  EXPECT_THAT(refusal("features: 3.5\n"), HasSubstr("whole number"));
  EXPECT_THAT(refusal("seed: -1\n"), HasSubstr("seed"));
  EXPECT_THAT(refusal("seed: 3\nkeyframe.max_parallax: wide\n"), HasSubstr(":2:"));
  EXPECT_THAT(refusal("tracking.learned: 5\n"), HasSubstr("true or false"));
  EXPECT_THAT(refusal("features: [1, 2]\n"), HasSubstr("features"));
  EXPECT_THAT(refusal("features:\n"), HasSubstr("features"));
  EXPECT_THAT(refusal("features: 99999999999\n"), HasSubstr("features"));
}

TEST(Config, NumbersMustBeFinite) {
  for (const std::string value : {".nan", ".inf", "-.inf"}) {
    EXPECT_THAT(refusal("model_sigma: " + value + "\n"), HasSubstr("model_sigma"));
    EXPECT_THAT(refusal("mapping:\n  chi2: " + value + "\n"), HasSubstr("mapping.chi2"));
    EXPECT_THAT(refusal("refinement.max_shift: " + value + "\n"),
                HasSubstr("refinement.max_shift"));
  }
}

TEST(Config, ValuesThatMakeNoSenseAreRefused) {
  EXPECT_THAT(refusal("threads: 0\n"), HasSubstr("threads"));
  EXPECT_THAT(refusal("mapping_queue: 0\n"), HasSubstr("mapping_queue"));
  EXPECT_THAT(refusal("seed: 8\nmodel_sigma: -1\n"), HasSubstr("model_sigma"));
  EXPECT_THAT(refusal("detection_sigma: -1\n"), HasSubstr("detection_sigma"));
  EXPECT_THAT(refusal("disparity_sigma: -1\n"), HasSubstr("disparity_sigma"));
  EXPECT_THAT(refusal("inertial.max_tension: 0\n"), HasSubstr("max_tension"));
  EXPECT_THAT(refusal("live.settling_time: -1\n"), HasSubstr("live.settling_time"));
  EXPECT_THAT(refusal("inertial.stereo_huber: 0\n"), HasSubstr("stereo_huber"));
  EXPECT_THAT(refusal("inertial.stereo_model_sigma: -1\n"), HasSubstr("stereo_model_sigma"));
  EXPECT_THAT(refusal("final.max_inertial_keyframes: 1\n"), HasSubstr("max_inertial_keyframes"));
  EXPECT_THAT(refusal("mapping.window: 1\n"), HasSubstr("mapping.window"));
  EXPECT_THAT(refusal("keyframe.min_tracked_share: 1.5\n"), HasSubstr("min_tracked_share"));
  EXPECT_THAT(refusal("relocalization.ransac_sigma: 0\n"), HasSubstr("ransac_sigma"));
  EXPECT_THAT(refusal("mapping.matched_share: 1.5\n"), HasSubstr("matched_share"));
  EXPECT_THAT(refusal("mapping.matcher: guessed\n"), HasSubstr("learned or classical"));
  EXPECT_THAT(refusal("inertial.prior_time_offset: 0\n"), HasSubstr("prior sigmas"));
  EXPECT_THAT(refusal("inertial.calibration_interval: 0\n"), HasSubstr("calibration_interval"));
  EXPECT_THAT(refusal("extraction.precision: int4\n"), HasSubstr("automatic, float or int8"));
}

TEST(Config, FilesThatAreNoSettingsAreRefused) {
  EXPECT_THAT(refusal("- 1\n- 2\n"), HasSubstr("key: value"));
  EXPECT_THAT(refusal("just words"), HasSubstr("key: value"));
  EXPECT_THAT(refusal("seed: 3\nkeyframe: {min_gap: 2, max_par"), HasSubstr("YAML"));
  Config config;
  EXPECT_THAT(input_error_of([&] { load_config("/nothing/here.yaml", config); }),
              HasSubstr("/nothing/here.yaml"));
}

TEST(Config, StereoInertialHasItsOwnWeighting) {
  Config config;
  config.stereo_inertial.model_sigma = 0.375;
  config.stereo_inertial.huber = 1.5;
  const auto given = list_config(config);
  config.distribute({}, true);
  EXPECT_EQ(list_config(config), given) << "for another mode";
  EXPECT_EQ(config.tracking.weighting.model_sigma, 0.375);
  EXPECT_EQ(config.mapping.creation.weighting.detection_sigma,
            config.stereo_inertial.detection_sigma);
  EXPECT_EQ(config.mapping.inertial.adjustment.huber, 1.5);
  EXPECT_EQ(config.final_adjustment.huber, 1.5);
}

TEST(Config, HandsSharedOptionsToTheStages) {
  Config config;
  config.weighting.model_sigma = 0.875;
  config.refinement.half_window = 4;
  GuidedMatchingOptions guided;
  guided.min_similarity = 0.625f;
  config.distribute(guided, false);
  EXPECT_EQ(config.tracking.weighting.model_sigma, 0.875);
  EXPECT_EQ(config.mapping.creation.weighting.model_sigma, 0.875);
  EXPECT_EQ(config.tracking.refinement.half_window, 4);
  EXPECT_EQ(config.mapping.creation.refinement.half_window, 4);
  EXPECT_EQ(config.tracking.search.guided.min_similarity, 0.625f);
}

}  // namespace
}  // namespace rover
