#include "rover/simulation/sequence_writer.h"

#include <unistd.h>

#include <fmt/format.h>

#include "rover/base/error.h"
#include "rover/datasets/atomic_file.h"
#include "rover/simulation/sequence_image.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

std::string camera_name(int camera) { return fmt::format("cam{}", camera); }

std::string matrix_rows(const Eigen::Matrix4d& m) {
  std::string text;
  for (int r = 0; r < 4; ++r) {
    text += r == 0 ? "[" : ",\n         ";
    for (int c = 0; c < 4; ++c) text += fmt::format("{}{}", c == 0 ? "" : ", ", m(r, c));
  }
  return text + "]";
}

std::string sensor_yaml(const Camera& camera, const SE3& body_from_camera, double rate) {
  const auto& k = camera.intrinsics();
  const auto& d = camera.distortion();
  const bool fisheye = camera.model() == CameraModel::kFisheye;
  std::string distortion = fmt::format("{}, {}, {}, {}", d[0], d[1], d[2], d[3]);
  if (d[4] != 0) distortion += fmt::format(", {}", d[4]);
  return fmt::format(
      "%YAML:1.0\nsensor_type: camera\ncomment: simulated\n\n"
      "T_BS:\n  cols: 4\n  rows: 4\n  data: {}\n\n"
      "rate_hz: {}\nresolution: [{}, {}]\ncamera_model: pinhole\n"
      "intrinsics: [{}, {}, {}, {}]\ndistortion_model: {}\ndistortion_coefficients: [{}]\n",
      matrix_rows(body_from_camera.matrix()), rate, camera.width(), camera.height(), k[0], k[1],
      k[2], k[3], fisheye ? "equidistant" : "radial-tangential", distortion);
}

}  // namespace

SequenceWriter::SequenceWriter(fs::path output, bool overwrite)
    : output_(fs::absolute(output).lexically_normal()) {
  if (!output_.has_filename()) output_ = output_.parent_path();  // "DIR/"
  require(overwrite || !fs::exists(output_),
          "--output {}: exists already; choose another folder or give --overwrite",
          output.string());
  require(!fs::exists(output_) || fs::is_directory(output_), "--output {}: is not a folder",
          output.string());
  partial_ = output_;
  partial_ += ".partial";
  std::error_code error;
  fs::remove_all(partial_, error);  // of an interrupted run
  fs::create_directories(partial_, error);
  require(!error && access(partial_.c_str(), W_OK) == 0,
          "--output {}: cannot be written; choose a folder that you may write to", output.string());
}

SequenceWriter::~SequenceWriter() {
  std::error_code ignored;
  if (!finished_) fs::remove_all(partial_, ignored);
}

fs::path SequenceWriter::add_folder(const std::string& name) {
  const fs::path folder = partial_ / "mav0" / name;
  std::error_code error;
  fs::create_directories(folder, error);
  require(!error, "{}: cannot be made ({}); check permissions and space", folder.string(),
          error.message());
  return folder;
}

void SequenceWriter::add_cameras(const Rig& rig, double rate, const std::vector<Timestamp>& times) {
  std::string list = "#timestamp [ns],filename\n";
  for (const Timestamp time : times) list += fmt::format("{0},{0}.png\n", time);
  for (int i = 0; i < rig.size(); ++i) {
    add_folder(camera_name(i) + "/data");
    const fs::path folder = add_folder(camera_name(i));
    write_file_atomically(folder / "sensor.yaml",
                          sensor_yaml(rig.cameras[i], rig.body_from_camera[i], rate));
    write_file_atomically(folder / "data.csv", list);
  }
}

void SequenceWriter::add_image(int camera, Timestamp time, const cv::Mat& image) const {
  const std::string name = fmt::format("{}.png", time);
  write_png(partial_ / "mav0" / camera_name(camera) / "data" / name, image);
}

void SequenceWriter::finish() {
  std::error_code error;
  fs::remove_all(output_, error);
  if (!error) fs::rename(partial_, output_, error);
  require(!error, "{}: cannot be put in place ({})", output_.string(), error.message());
  finished_ = true;
}

}  // namespace rover
