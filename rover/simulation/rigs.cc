#include "rover/simulation/rigs.h"

#include <array>
#include <cmath>
#include <filesystem>
#include <vector>

#include "rover/base/error.h"
#include "rover/base/random.h"
#include "rover/datasets/calibration.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

// How inertial sensors are mounted: the camera's x, y and z axes in the body frame. As on EuRoC's
// and TUM-VI's rigs, so that the built-in rigs can fly along those ground truths.
Eigen::Matrix3d euroc_axes() {
  Eigen::Matrix3d axes;
  axes << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  return axes;
}

Eigen::Matrix3d tumvi_axes() {
  Eigen::Matrix3d axes;
  axes << -1, 0, 0, 0, 0, -1, 0, -1, 0;
  return axes;
}

// position: of the camera along its own axes, m. Turned by small angles (rad) about its own x and
// z.
SE3 mounted(const Eigen::Matrix3d& axes, const Eigen::Vector3d& position, double tilt,
            double roll) {
  const Eigen::Quaterniond small = so3_exp({tilt, 0, 0}) * so3_exp({0, 0, roll});
  return {Eigen::Matrix3d(axes * small.toRotationMatrix()), axes * position};
}

Rig euroc_rig() {
  const Camera left(CameraModel::kPinhole, 752, 480, {459.1, 457.8, 366.4, 247.9},
                    {-0.2829, 0.0731, 0.00021, 0.00003});
  const Camera right(CameraModel::kPinhole, 752, 480, {457.9, 456.3, 378.7, 255.6},
                     {-0.2836, 0.0745, -0.00012, -0.00004});
  return {{left, right},
          {mounted(euroc_axes(), {-0.055, 0.01, 0.02}, 0.012, 0.004),
           mounted(euroc_axes(), {0.055, 0.011, 0.021}, 0.008, -0.006)}};
}

Rig tumvi_rig() {
  const Camera left(CameraModel::kFisheye, 512, 512, {190.9, 190.9, 254.8, 256.9},
                    {0.0034, 0.0007, -0.0020, 0.0002});
  const Camera right(CameraModel::kFisheye, 512, 512, {190.4, 190.4, 252.6, 255.1},
                     {0.0033, 0.0009, -0.0021, 0.0003});
  return {{left, right},
          {mounted(tumvi_axes(), {-0.0505, 0.02, 0.04}, 0.02, 0.01),
           mounted(tumvi_axes(), {0.0505, 0.02, 0.04}, 0.015, -0.01)}};
}

Rig mono_rig() {
  const Camera camera(CameraModel::kPinhole, 640, 480, {460, 460, 319.2, 240.6},
                      {-0.05, 0.03, 0.0003, -0.0002});
  return {{camera}, {mounted(euroc_axes(), {0, 0.01, 0.03}, 0.01, 0)}};
}

Rig paper_rig() {
  const Camera camera(CameraModel::kPinhole, 1440, 1080, {1170, 1170, 719.3, 541.2},
                      {-0.11, 0.08, 0.0002, -0.0001});
  return {{camera}, {mounted(euroc_axes(), {0.01, 0.02, 0.03}, 0.01, 0)}};
}

void append(const fs::path& file, Rig& rig) {
  const Rig more = read_rig_calibration(file).rig;
  rig.cameras.insert(rig.cameras.end(), more.cameras.begin(), more.cameras.end());
  rig.body_from_camera.insert(rig.body_from_camera.end(), more.body_from_camera.begin(),
                              more.body_from_camera.end());
}

Rig read_folder(const fs::path& folder) {
  const fs::path root = fs::is_directory(folder / "mav0") ? folder / "mav0" : folder;
  Rig rig;
  if (fs::exists(root / "sensor.yaml")) append(root / "sensor.yaml", rig);
  for (const char* camera : {"cam0", "cam1"}) {
    if (fs::exists(root / camera / "sensor.yaml")) append(root / camera / "sensor.yaml", rig);
  }
  require(rig.size() > 0, "--rig {}: has no cam0/sensor.yaml", folder.string());
  return rig;
}

Rig read_path(const fs::path& path) {
  if (fs::is_directory(path)) return read_folder(path);
  require(fs::exists(path),
          "--rig '{}' is not known; use euroc, tumvi, mono, paper, a sensor.yaml or its folder",
          path.string());
  Rig rig;
  append(path, rig);
  return rig;
}

void check_size(const Camera& camera, const std::string& name) {
  const auto usable = [](int size) { return size % 2 == 0 && size >= 32 && size <= 8192; };
  require(usable(camera.width()) && usable(camera.height()),
          "--rig {}: images of {} x {} px cannot be rendered; width and height must be even and "
          "between 32 and 8192",
          name, camera.width(), camera.height());
}

using Disturbance = std::array<double, 6>;  // of fx fy cx cy k1 k2

Camera changed(const Camera& camera, const Disturbance& change, double scale) {
  std::array<double, 4> k = camera.intrinsics();
  const auto& d = camera.distortion();
  for (std::size_t i = 0; i < 4; ++i) k[i] += scale * change[i];
  std::vector<double> distortion(d.begin(), d.begin() + (d[4] != 0 ? 5 : 4));
  distortion[0] += scale * change[4];
  distortion[1] += scale * change[5];
  return {camera.model(), camera.width(), camera.height(), k, distortion};
}

// Root mean square of how far pixels move, px.
double difference(const Camera& a, const Camera& b) {
  constexpr int kSteps = 16;
  double sum = 0;
  int count = 0;
  for (int i = 0; i < kSteps * kSteps; ++i) {
    const Eigen::Vector2d pixel((i % kSteps + 0.5) / kSteps * a.width(),
                                (i / kSteps + 0.5) / kSteps * a.height());
    const auto ray = a.unproject(pixel);
    const auto moved = ray ? b.project(*ray) : std::nullopt;
    if (!moved) continue;
    sum += (*moved - pixel).squaredNorm();
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

}  // namespace

Camera disturbed_camera(const Camera& calibrated, double error, std::uint64_t seed) {
  if (error == 0) return calibrated;
  Random random(seed);
  const double f = 0.002 * calibrated.focal_length();
  const Disturbance change = {f * random.gaussian(),     f * random.gaussian(),
                              random.gaussian(),         random.gaussian(),
                              0.003 * random.gaussian(), 0.003 * random.gaussian()};
  double scale = 0.1;
  for (int i = 0; i < 4; ++i) {  // nearly linear
    scale *= error / difference(calibrated, changed(calibrated, change, scale));
  }
  return changed(calibrated, change, scale);
}

Rig make_rig(const std::string& name) {
  Rig rig = name == "euroc"   ? euroc_rig()
            : name == "tumvi" ? tumvi_rig()
            : name == "mono"  ? mono_rig()
            : name == "paper" ? paper_rig()
                              : read_path(name);
  for (const Camera& camera : rig.cameras) check_size(camera, name);
  return rig;
}

}  // namespace rover
