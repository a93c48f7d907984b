#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace rover {

// What a patch is made of. Each is painted anew for every patch: nothing repeats.
enum class Surface {
  kPlaster,
  kBrick,
  kWood,
  kConcrete,
  kCarpet,
  kTiles,
  kFabric,
  kMetal,
  kPoster,
  kPlayMat,
  kBoard,  // white board or notice board with papers
  kCardboard,
  kBook,
  kStripes,  // dark tape with light marks
  kAsphalt,
  kFacade,
  kShop,
  kClouds,
  kLamp,   // white all over
  kPlain,  // one tone with hardly a mark: for `low` texture
};

struct SurfacePaint {
  Surface surface = Surface::kPlaster;
  cv::Size2d size;       // m, of the patch
  double texel = 0.003;  // m
  double tone = 0.6;     // of the ground
  std::uint64_t seed = 0;
};

// The albedo, 8 bit. With photographs (8 bit, gray), walls, floors, posters and boards show parts
// of them instead.
cv::Mat paint_surface(const SurfacePaint& paint, const std::vector<cv::Mat>& photographs = {});

}  // namespace rover
