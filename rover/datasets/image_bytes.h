#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <opencv2/core.hpp>

namespace rover {

// What the structure of an encoded image says, without decoding it: decoders fill what is missing
// from a cut file with gray and report success.
struct ImageStructure {
  cv::Size size;          // px as declared; empty if the file ends before
  bool complete = false;  // whether the end marker is there
};

// Nothing for bytes that begin like neither a PNG nor a JPEG file.
std::optional<ImageStructure> inspect_image(std::span<const std::uint8_t> bytes);

}  // namespace rover
