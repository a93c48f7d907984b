#include "rover/datasets/trajectory.h"

#include <zlib.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/base/random.h"
#include "rover/datasets/test_folder.h"

namespace rover {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

void pack(const std::string& text, const std::filesystem::path& file) {
  const gzFile stream = gzopen(file.c_str(), "wb");
  ASSERT_EQ(gzwrite(stream, text.data(), static_cast<unsigned>(text.size())),
            static_cast<int>(text.size()));
  ASSERT_EQ(gzclose(stream), Z_OK);
}

TEST(Trajectory, WritesWhatItReads) {
  Random random(1);
  Trajectory trajectory;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d t(random.gaussian() * 1000, random.gaussian(), random.gaussian() * 1e-3);
    const Eigen::Vector3d turn(random.gaussian(), random.gaussian(), random.gaussian());
    trajectory.push_back({1403715285262142976 + Timestamp{i} * 33333333, SE3(so3_exp(turn), t)});
  }
  const TestFolder folder;
  write_tum_trajectory(folder / "t.txt", trajectory);
  EXPECT_EQ(folder.read("t.txt"), format_tum_trajectory(trajectory));
  EXPECT_FALSE(std::filesystem::exists(folder / "t.txt.part"));
  const Trajectory read = read_tum_trajectory(folder / "t.txt");
  ASSERT_THAT(read, SizeIs(100));
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].time, trajectory[i].time);
    EXPECT_LT((read[i].pose.matrix() - trajectory[i].pose.matrix()).norm(), 1e-7);
  }
}

TEST(Trajectory, PrintsNineDecimals) {
  const Trajectory trajectory = {{1305031102175304000, SE3()}};
  EXPECT_EQ(format_tum_trajectory(trajectory),
            "1305031102.175304000 0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 "
            "0.000000000 1.000000000\n");
}

TEST(Trajectory, LeavesBrokenLinesOut) {
  const TestFolder folder;
  folder.write("t.txt",
               "\xef\xbb\xbf# stamps\r\n"
               "1.0 0 0 0 0 0 0 1\r\n"
               "  2.0\t1 0 0 0 0 0 1  extra\r\n"
               "\r\n"
               "1.5 5 0 0 0 0 0 1\n"
               "3.0 0 0 nan 0 0 0 1\n"
               "4.0 0 0 0 0 0 0 0\n"
               "5.0 2 0 0 0 0 0 1\n"
               "6.0 3 0 0 0 0 0 -1\n"
               "7.0 4 0");
  std::vector<std::string> notes;
  EXPECT_THAT(input_error_of([&] { read_tum_trajectory(folder / "t.txt", &notes); }),
              HasSubstr("4 of 8"));
  folder.write("t.txt", folder.read("t.txt") + " 0 0 0 0 1");
  EXPECT_THAT(read_tum_trajectory(folder / "t.txt", &notes), SizeIs(5));
  EXPECT_THAT(notes,
              ElementsAre(AllOf(HasSubstr("3 of 8"), HasSubstr("line 5"), HasSubstr("line 3"))));
}

TEST(Trajectory, RefusesOtherFiles) {
  const TestFolder folder;
  EXPECT_THAT(input_error_of([&] { read_tum_trajectory(folder / "t.txt"); }),
              HasSubstr("no such file"));
  EXPECT_THAT(input_error_of([&] { read_tum_trajectory(folder.path()); }),
              HasSubstr("no such file"));
  folder.write("t.txt", "");
  EXPECT_THAT(input_error_of([&] { read_tum_trajectory(folder / "t.txt"); }), HasSubstr("no data"));
  folder.write("t.txt", "a,b,c\n");
  EXPECT_THAT(input_error_of([&] { read_tum_trajectory(folder / "t.txt"); }), HasSubstr("line 1"));
  EXPECT_THAT(input_error_of([&] { write_tum_trajectory(folder / "no/t.txt", {}); }),
              HasSubstr("cannot be written"));
}

TEST(Trajectory, ReadsGroundTruthsPackedOrNot) {
  const TestFolder folder;
  folder.write("t.csv",
               "#timestamp, p, q\n1500000000,1,2,3,0,1,0,0,9,9,9\n1600000000,4,5,6,1,0,0,0");
  folder.write("t.txt", "1.5 1 2 3 1 0 0 0\n1.6 4 5 6 0 0 0 1\n");
  const Trajectory expected = read_trajectory(folder / "t.txt");
  ASSERT_THAT(expected, SizeIs(2));
  for (const char* name : {"t.csv", "t.txt"}) {
    const std::string packed = std::string(name) + ".gz";
    pack(folder.read(name), folder / packed);
    EXPECT_LT(std::filesystem::file_size(folder / packed), 100U);
    for (const auto& file : {folder / name, folder / packed}) {
      const Trajectory read = read_trajectory(file);
      EXPECT_EQ(format_tum_trajectory(read), format_tum_trajectory(expected)) << file;
    }
  }
}

TEST(Trajectory, RefusesPackedFilesThatAreCutOff) {
  const TestFolder folder;
  pack("1.5 1 2 3 1 0 0 0\n1.6 4 5 6 0 0 0 1\n", folder / "whole.txt.gz");
  const std::string whole = folder.read("whole.txt.gz");
  folder.write("cut.txt.gz", whole.substr(0, whole.size() - 12));
  EXPECT_THAT(input_error_of([&] { read_trajectory(folder / "cut.txt.gz"); }), HasSubstr("whole"));
  folder.write("damaged.txt.gz", std::string(whole).replace(20, 3, "???"));
  EXPECT_THAT(input_error_of([&] { read_trajectory(folder / "damaged.txt.gz"); }),
              HasSubstr("whole"));
}

TEST(Trajectory, MovesToAnotherFrame) {
  const SE3 turned(so3_exp({0, 0, M_PI / 2}), Eigen::Vector3d(1, 0, 0));
  const SE3 ahead(Eigen::Quaterniond::Identity(), Eigen::Vector3d(2, 0, 0));
  const Trajectory moved = move_frame({{5, turned}}, ahead);
  EXPECT_EQ(moved[0].time, 5);
  EXPECT_LT((moved[0].pose.translation - Eigen::Vector3d(1, 2, 0)).norm(), 1e-12);
}

}  // namespace
}  // namespace rover
