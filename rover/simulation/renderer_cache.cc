#include "rover/simulation/renderer_cache.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <opencv2/imgcodecs.hpp>

#include "rover/base/error.h"
#include "rover/base/random.h"
#include "rover/simulation/sequence_image.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

// Changes with whatever changes the images: scenes, textures, light, rendering.
constexpr std::uint64_t kGeneration = 4;
constexpr double kBrightest = 16;  // radiance

class Hash {
 public:
  explicit Hash(std::uint64_t seed) : value_(seed) {}

  void add(std::uint64_t bits) { value_ = hash_seed(value_, bits); }
  void add(double number) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    add(bits);
  }
  void add(const std::string& text) {
    add(static_cast<std::uint64_t>(text.size()));
    for (const char c : text) add(static_cast<std::uint64_t>(static_cast<unsigned char>(c)));
  }
  void add(const Eigen::Vector3d& vector) {
    for (int i = 0; i < 3; ++i) add(vector[i]);
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_;
};

void add_folder(const fs::path& folder, Hash& hash) {
  std::vector<std::string> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const auto changed = entry.last_write_time(error).time_since_epoch().count();
    files.push_back(
        fmt::format("{} {} {}", entry.path().string(), entry.file_size(error), changed));
  }
  std::sort(files.begin(), files.end());
  for (const std::string& file : files) hash.add(file);
}

}  // namespace

RadianceCache::RadianceCache(fs::path folder) : folder_(std::move(folder)) {
  std::error_code error;
  fs::create_directories(folder_, error);
  require(!error, "--cache {}: cannot be made ({}); choose a folder that you may write to",
          folder_.string(), error.message());
}

fs::path RadianceCache::file(const std::string& name) const { return folder_ / (name + ".png"); }

std::optional<cv::Mat> RadianceCache::load(const std::string& name) const {
  if (!fs::exists(file(name))) return std::nullopt;
  const cv::Mat stored = cv::imread(file(name).string(), cv::IMREAD_UNCHANGED);
  if (stored.type() != CV_16UC1) return std::nullopt;
  cv::Mat root;
  stored.convertTo(root, CV_32F, std::sqrt(kBrightest) / 65535);
  return root.mul(root);
}

void RadianceCache::store(const std::string& name, const cv::Mat& radiance) const {
  cv::Mat root, stored;
  cv::sqrt(radiance, root);
  root.convertTo(stored, CV_16U, 65535 / std::sqrt(kBrightest));
  write_png(file(name), stored);
}

std::uint64_t hash_of(const SceneOptions& scene, const RenderOptions& render) {
  Hash hash(kGeneration);
  hash.add(static_cast<std::uint64_t>(scene.kind));
  hash.add(scene.seed);
  hash.add(static_cast<std::uint64_t>(scene.low_texture));
  hash.add(static_cast<std::uint64_t>(scene.plain_leg));
  hash.add(static_cast<std::uint64_t>(scene.moving_objects));
  if (scene.photographs) add_folder(*scene.photographs, hash);
  for (const Eigen::Vector3d& point : scene.around) hash.add(point);
  hash.add(static_cast<std::uint64_t>(render.samples));
  hash.add(render.exposure);
  hash.add(render.readout);
  return hash.value();
}

std::string image_name(std::uint64_t common, const Camera& camera, const Shot& shot) {
  Hash hash(common);
  hash.add(static_cast<std::uint64_t>(camera.model()));
  hash.add(static_cast<std::uint64_t>(camera.width()));
  hash.add(static_cast<std::uint64_t>(camera.height()));
  for (const double value : camera.intrinsics()) hash.add(value);
  for (const double value : camera.distortion()) hash.add(value);
  for (const SE3& pose : shot.world_from_camera) {
    hash.add(pose.translation);
    hash.add(Eigen::Vector3d(pose.rotation.vec()));
    hash.add(pose.rotation.w());
  }
  hash.add(shot.seconds);
  for (const float weight : shot.lamps) hash.add(static_cast<double>(weight));
  hash.add(shot.seed);
  return fmt::format("{:016x}", hash.value());
}

}  // namespace rover
