// The figures agree with other implementations: evo (tools/evo_reference.py), and those published
// with the trajectories of other systems beside a developer's checkout.
#include <cctype>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "rover/datasets/dataset.h"
#include "rover/datasets/test_folder.h"
#include "rover/evaluation/judgement.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

void expect_same(const ErrorStatistics& own, const nlohmann::json& evo) {
  EXPECT_NEAR(own.rmse, evo["rmse"].get<double>(), 1e-6);
  EXPECT_NEAR(own.mean, evo["mean"].get<double>(), 1e-6);
  EXPECT_NEAR(own.median, evo["median"].get<double>(), 1e-6);
  EXPECT_NEAR(own.max, evo["max"].get<double>(), 1e-6);
  EXPECT_NEAR(own.min, evo["min"].get<double>(), 1e-6);
  EXPECT_NEAR(own.std, evo["std"].get<double>(), 1e-6);
}

TEST(Evo, AgreesToAMillionth) {
  const fs::path folder = fs::path(ROVER_SOURCE_DIR) / "rover/evaluation/testdata";
  const auto evo = nlohmann::json::parse(std::ifstream(folder / "evo.json"));
  const Judgement judgement =
      judge("estimate", read_tum_trajectory(folder / "estimate.txt"),
            read_tum_trajectory(folder / "reference.txt"), 0.02, std::nullopt);
  ASSERT_TRUE(judgement.rigid && judgement.similarity);
  for (const auto& [errors, answer] :
       {std::pair{*judgement.rigid, evo["se3"]}, std::pair{*judgement.similarity, evo["sim3"]}}) {
    EXPECT_EQ(judgement.associated, answer["associated"].get<std::size_t>());
    EXPECT_NEAR(errors.reference_from_estimate.scale, answer["scale"].get<double>(), 1e-6);
    EXPECT_NEAR(judgement.path, answer["path"].get<double>(), 1e-6);
    expect_same(errors.position, answer["ate"]);
    expect_same(errors.relative_translation, answer["rpe_translation"]);
    expect_same(errors.relative_rotation, answer["rpe_rotation"]);
  }
}

// Its alignment of the first n poses, as the measure of drift does it.
TEST(Evo, AgreesOnDrift) {
  const fs::path folder = fs::path(ROVER_SOURCE_DIR) / "rover/evaluation/testdata";
  const auto evo = nlohmann::json::parse(std::ifstream(folder / "evo.json"));
  const Trajectory estimate = read_tum_trajectory(folder / "estimate.txt");
  const auto pairs = associate(estimate, read_tum_trajectory(folder / "reference.txt"), 0.02);
  const Timestamp middle =
      estimate.front().time / kNanosecondsPerSecond * kNanosecondsPerSecond + from_seconds(3.3);
  const BlindStretch stretch{middle, middle};
  const auto rigid = measure_drift(estimate, pairs, stretch, AlignmentKind::kRigid);
  const auto similarity = measure_drift(estimate, pairs, stretch, AlignmentKind::kSimilarity);
  ASSERT_TRUE(rigid && similarity);
  expect_same(rigid->position, evo["se3"]["drift"]);
  expect_same(similarity->position, evo["sim3"]["drift"]);
}

struct Peer {
  const char* file;
  const char* dataset;
  bool inertial;
  double rigid;  // m; negative: not published
  double similarity;
  double coverage;
};

class Peers : public ::testing::TestWithParam<Peer> {};

TEST_P(Peers, HaveTheirPublishedErrors) {
  const Peer& peer = GetParam();
  const fs::path file = shared_folder() / "peers/orbslam3" / peer.file;
  DatasetOptions options;
  options.path = shared_folder() / "data" / peer.dataset;
  if (!fs::exists(file) || !fs::exists(options.path)) GTEST_SKIP() << file << " is not here";
  options.inertial = peer.inertial;
  const auto dataset = open_dataset(options);
  const Trajectory reference =
      peer.inertial ? dataset->ground_truth()
                    : move_frame(dataset->ground_truth(), dataset->rig().body_from_camera[0]);
  const Judgement judgement =
      judge(peer.file, read_tum_trajectory(file), reference, 0.02, Offered{dataset->size(), 0, 0});
  ASSERT_TRUE(judgement.rigid && judgement.similarity);
  EXPECT_NEAR(judgement.similarity->position.rmse, peer.similarity, 0.006 * peer.similarity + 5e-5);
  if (peer.rigid > 0) {
    EXPECT_NEAR(judgement.rigid->position.rmse, peer.rigid, 5.1e-4);
  }
  EXPECT_NEAR(*judgement.coverage, peer.coverage, 6e-4);
}

INSTANTIATE_TEST_SUITE_P(
    OrbSlam3, Peers,
    ::testing::Values(
        Peer{"tum_freiburg1_xyz.mono.txt", "tum_rgbd/freiburg1_xyz", false, -1, 0.0093, 0.994},
        Peer{"kitti_00_first201.stereo.txt", "kitti/00_first201", false, 0.374, 0.215, 1},
        Peer{"kitti_00_first201.mono.txt", "kitti/00_first201", false, -1, 0.933, 0.995},
        Peer{"euroc_V1_01_clip.mono.txt", "euroc/V1_01_clip", false, -1, 0.0034, 0.956},
        Peer{"euroc_V1_01_clip.mono-inertial.txt", "euroc/V1_01_clip", true, 0.0239, 0.0077,
             0.956}),
    [](const auto& instance) {
      std::string name = instance.param.file;  // test names are letters, digits and underscores
      std::erase_if(name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); });
      return name;
    });

}  // namespace
}  // namespace rover
