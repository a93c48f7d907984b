#pragma once

#include <filesystem>

namespace rover {

// Whether the extension, in any case, is one of an image (or video) file that can be read.
bool has_image_name(const std::filesystem::path& file);
bool has_video_name(const std::filesystem::path& file);

}  // namespace rover
