#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <opencv2/core.hpp>

#include "rover/simulation/renderer.h"
#include "rover/simulation/scene_factory.h"

namespace rover {

// Images of radiance in a folder, as 16-bit PNG of the root of the radiance, so that another seed
// of noise needs no rendering again, and an interrupted run goes on where it stopped. Each file's
// name is a hash of all that determines it. Nothing is ever removed: that is the user's to do.
// Thread-safe for images of different names.
class RadianceCache {
 public:
  // Makes the folder. Throws InputError if it cannot be written.
  explicit RadianceCache(std::filesystem::path folder);

  // Nothing if it is not there or cannot be read.
  std::optional<cv::Mat> load(const std::string& name) const;
  // Throws InputError if it cannot be written.
  void store(const std::string& name, const cv::Mat& radiance) const;

 private:
  std::filesystem::path file(const std::string& name) const;
  std::filesystem::path folder_;
};

// What a scene and its rendering are determined by, hashed: the part of a name that all images of a
// sequence share.
std::uint64_t hash_of(const SceneOptions& scene, const RenderOptions& render);
// The name of one image.
std::string image_name(std::uint64_t common, const Camera& camera, const Shot& shot);

}  // namespace rover
