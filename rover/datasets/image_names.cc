#include "rover/datasets/image_names.h"

#include <algorithm>
#include <cctype>
#include <string>

namespace rover {
namespace {

std::string lower_extension(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

template <std::size_t n>
bool is_one_of(const std::string& extension, const char* const (&known)[n]) {
  return std::find(std::begin(known), std::end(known), extension) != std::end(known);
}

}  // namespace

bool has_image_name(const std::filesystem::path& file) {
  return is_one_of(lower_extension(file),
                   {".png", ".jpg", ".jpeg", ".pgm", ".ppm", ".bmp", ".tif", ".tiff"});
}

bool has_video_name(const std::filesystem::path& file) {
  return is_one_of(lower_extension(file),
                   {".mp4", ".avi", ".mov", ".mkv", ".webm", ".m4v", ".mpg", ".mpeg"});
}

}  // namespace rover
