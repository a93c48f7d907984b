#include "rover/evaluation/run_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rover/datasets/test_folder.h"

namespace rover {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::SizeIs;

class RunFolderTest : public ::testing::Test {
 protected:
  RunFolderTest() {
    folder_.write("summary.json", R"({"mode": "mono", "pose_frame": "cam0", "keyframes": 3})");
    folder_.write("trajectory_final.txt", "1.0 0 0 0 0 0 0 1\n2.0 1 0 0 0 0 0 1\n");
    folder_.write("trajectory_causal.txt", "2.0 1 0 0 0 0 0 1\n");
    folder_.write("frames.csv",
                  "frame,time,state,map,epoch\n0,1.0,lost,-1,0\n1,2.0,ok,0,0\n2,3.5,ok,0,0\n");
    folder_.write("timing.csv",
                  "frame,stage,ms\n0,extract,5\n1,extract,7\n2,extract,30\n1,pose,1\n");
  }

  std::string error() {
    return input_error_of([&] { read_run_folder(folder_.path()); });
  }

  TestFolder folder_;
};

TEST_F(RunFolderTest, HoldsWhatTheFilesSay) {
  const RunFolder run = read_run_folder(folder_.path());
  EXPECT_TRUE(run.monocular());
  EXPECT_FALSE(run.inertial());
  EXPECT_EQ(run.pose_frame, "cam0");
  EXPECT_THAT(run.final, SizeIs(2));
  EXPECT_THAT(run.causal, SizeIs(1));
  EXPECT_EQ(run.offered.frames, 3u);
  EXPECT_EQ(run.offered.first, 1'000'000'000);
  EXPECT_EQ(run.offered.last, 3'500'000'000);
  EXPECT_EQ(run.states.at("ok"), 2);
  EXPECT_EQ(run.frames[0].map, -1);
  EXPECT_EQ(run.states.at("lost"), 1);
  ASSERT_THAT(run.stages, SizeIs(2));
  EXPECT_EQ(run.stages[0].stage, "extract");
  EXPECT_EQ(run.stages[0].count, 3u);
  EXPECT_EQ(run.stages[0].median, 7);
  EXPECT_EQ(run.stages[0].max, 30);
}

TEST_F(RunFolderTest, HasFramesKeyframesAndPictures) {
  folder_.write("keyframes.txt", "2.0 1 0 0 0 0 0 1\n");
  folder_.write("frames.csv",
                "frame,time,state,features,matches,inliers,frame_ms,rss_mb\n"
                "0,1.0,waiting,500,0,0,20,90.5\n1,2.5,ok,400,90,80,10,91\n");
  folder_.write("samples/2.5.jpg", "");
  folder_.write("samples/1.000000000.jpg", "");
  folder_.write("samples/notes.txt", "");
  folder_.write("samples/cat.jpg", "");
  const RunFolder run = read_run_folder(folder_.path());
  EXPECT_THAT(run.keyframes, SizeIs(1));
  ASSERT_THAT(run.frames, SizeIs(2));
  EXPECT_EQ(run.frames[1].inliers, 80);
  EXPECT_EQ(run.frames[0].rss_mb, 90.5);
  EXPECT_EQ(run.initialised_after(), 1.5);
  ASSERT_THAT(run.samples, SizeIs(2));
  EXPECT_EQ(run.samples[1].file, folder_ / "samples/2.5.jpg");
  EXPECT_THAT(run.notes, Contains(HasSubstr("cat.jpg")));
}

TEST_F(RunFolderTest, HasInertialStates) {
  EXPECT_TRUE(read_run_folder(folder_.path()).motion.empty());
  folder_.write("states.csv",
                "time,vx,vy,vz,bgx,bgy,bgz,bax,bay,baz,sigma_vx,sigma_vy,sigma_vz,sigma_bgx,"
                "sigma_bgy,sigma_bgz,sigma_bax,sigma_bay,sigma_baz\n"
                "2.0,1,2,3,4,5,6,7,8,9,.1,.2,.3,.4,.5,.6,.7,.8,.9\n");
  const RunFolder run = read_run_folder(folder_.path());
  ASSERT_THAT(run.motion, SizeIs(1));
  EXPECT_EQ(run.motion[0].time, 2'000'000'000);
  EXPECT_EQ(run.motion[0].values[3], 4);
  EXPECT_EQ(run.motion[0].sigmas[8], 0.9);
}

TEST_F(RunFolderTest, NamesWhatIsMissing) {
  for (const char* file : {"summary.json", "frames.csv", "timing.csv"}) {
    const std::string content = folder_.read(file);
    std::filesystem::remove(folder_ / file);
    EXPECT_THAT(error(), HasSubstr(file));
    folder_.write(file, content);
  }
  EXPECT_THAT(input_error_of([&] { read_run_folder(folder_ / "no"); }), HasSubstr("no such"));
}

TEST_F(RunFolderTest, SaysThatNothingWasTracked) {
  folder_.write("trajectory_final.txt", "");
  EXPECT_THAT(error(), HasSubstr("tracked no frame"));
}

TEST_F(RunFolderTest, RefusesBrokenFiles) {
  const std::string summary = folder_.read("summary.json");
  for (const char* broken : {"", "{", "[1]", "{}", R"({"mode": 3, "pose_frame": "cam0"})",
                             R"({"mode": "mono", "pose_frame": "moon"})"}) {
    folder_.write("summary.json", broken);
    EXPECT_THAT(error(), HasSubstr("summary.json"));
  }
  folder_.write("summary.json", summary);
  folder_.write("frames.csv", "frame,stamp\n0,1\n");
  EXPECT_THAT(error(), AllOf(HasSubstr("frames.csv"), HasSubstr("'time'")));
}

TEST_F(RunFolderTest, LeavesBrokenLinesOut) {
  folder_.write("timing.csv", folder_.read("timing.csv") + "3,extract,nan\n3,extr");
  const RunFolder run = read_run_folder(folder_.path());
  EXPECT_EQ(run.stages[0].count, 3u);
  EXPECT_THAT(run.notes, Contains(HasSubstr("2 of 6")));
}

}  // namespace
}  // namespace rover
