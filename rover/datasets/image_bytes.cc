#include "rover/datasets/image_bytes.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace rover {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::array<std::uint8_t, 8> kPngSignature = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
constexpr std::size_t kMaxSide = 65535;

bool starts_with(Bytes bytes, Bytes prefix) {
  return bytes.size() >= prefix.size() && std::equal(prefix.begin(), prefix.end(), bytes.begin());
}

// `count` bytes, most significant first; 0 beyond the end.
std::size_t big_endian(Bytes bytes, std::size_t at, std::size_t count) {
  if (at > bytes.size() || bytes.size() - at < count) return 0;
  std::size_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = (value << 8) | bytes[at + i];
  return value;
}

cv::Size make_size(std::size_t width, std::size_t height) {
  if (width > kMaxSide || height > kMaxSide) return {};
  return {static_cast<int>(width), static_cast<int>(height)};
}

// A PNG file is a chain of chunks (length, type, data, checksum) from IHDR to IEND.
ImageStructure inspect_png(Bytes bytes) {
  ImageStructure structure;
  std::size_t at = kPngSignature.size();
  structure.size = make_size(big_endian(bytes, at + 8, 4), big_endian(bytes, at + 12, 4));
  constexpr std::size_t kFrame = 12;
  constexpr std::size_t kEnd = 0x49454e44;  // "IEND"
  while (at <= bytes.size() && bytes.size() - at >= kFrame) {
    const std::size_t length = big_endian(bytes, at, 4);
    if (bytes.size() - at - kFrame < length) break;
    if (big_endian(bytes, at + 4, 4) == kEnd) {
      structure.complete = true;
      break;
    }
    at += kFrame + length;
  }
  return structure;
}

bool is_frame_header(std::uint8_t marker) {
  return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

bool has_no_length(std::uint8_t marker) {
  return marker == 0x01 || (marker >= 0xd0 && marker <= 0xd8);
}

// A JPEG file is a chain of markers, most with a length; between them lies entropy-coded data, in
// which 0xff is followed by 0 (ITU-T T.81, annex B).
ImageStructure inspect_jpeg(Bytes bytes) {
  ImageStructure structure;
  std::size_t at = 2;
  while (at + 1 < bytes.size()) {
    const std::uint8_t marker = bytes[at + 1];
    if (bytes[at] != 0xff || marker == 0xff || marker == 0x00) {
      ++at;
    } else if (marker == 0xd9) {
      structure.complete = true;
      break;
    } else if (has_no_length(marker)) {
      at += 2;
    } else {
      if (is_frame_header(marker)) {
        structure.size = make_size(big_endian(bytes, at + 7, 2), big_endian(bytes, at + 5, 2));
      }
      at += 2 + std::max<std::size_t>(2, big_endian(bytes, at + 2, 2));
    }
  }
  return structure;
}

}  // namespace

std::optional<ImageStructure> inspect_image(Bytes bytes) {
  if (starts_with(bytes, kPngSignature)) return inspect_png(bytes);
  constexpr std::array<std::uint8_t, 3> kJpegSignature = {0xff, 0xd8, 0xff};
  if (starts_with(bytes, kJpegSignature)) return inspect_jpeg(bytes);
  return std::nullopt;
}

}  // namespace rover
