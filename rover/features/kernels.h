#pragma once

#include <cstddef>
#include <cstdint>

// The hot loops of the extractors, built once per instruction set (kernels_impl.h) and chosen at
// run time. Plain pointers only: a template instantiated with wider vectors must not be shared with
// code for the baseline (DESIGN, section 3, machine code).
namespace rover::kernels {

enum class InstructionSet { kBaseline, kAvx2, kAvx512 };

// An 8-bit image; stride in bytes.
struct ImageView {
  const std::uint8_t* data;
  std::ptrdiff_t stride;
  int width, height;
};

// A map at 1/8 of an image's size: its cell (i, j) is the mean of pixels 8i..8i+7, 8j..8j+7.
struct CoarseMap {
  const float* data;
  int width, height;
};

struct Kernels {
  // Rows [begin, end) of the corner response times the coarse map, bilinearly enlarged: the square
  // root of the smaller eigenvalue of the structure tensor, averaged over 5x5, of the image
  // smoothed with sigma 1; in gray levels per px. `response` has the image's width as its stride
  // and starts at row 0. `scratch` has corner_scratch_size(width) floats.
  void (*corner_response)(const ImageView& image, const CoarseMap& weight, int begin, int end,
                          float* response, float* scratch);

  // out[x] = max of row[x-radius..x+radius], clipped to the row. `scratch`: 2 (width + 2 radius).
  void (*row_maximum)(const float* row, int width, int radius, float* out, float* scratch);

  // Writes the x at which row[x] > floor and no rows[k][x] is larger; returns how many. The result
  // is in ascending order; `out` has room for `width`; `scratch`: 2 width + 2.
  int (*find_maxima)(const float* row, const float* const* rows, int row_count, int width,
                     float floor, int* out, float* scratch);

  // out[x] = scale * in[x] for x < width, then the last value up to padded_width.
  void (*to_float)(const std::uint8_t* in, int width, float scale, float* out, int padded_width);

  // Cells [begin, end) of planes[channels][cells] as unit vectors out[cells][channels].
  void (*normalize_cells)(const float* planes, int channels, int cells, int begin, int end,
                          float* out);

  // out = sum of weights[i] * vectors[i].
  void (*blend)(const float* const* vectors, const float* weights, int count, int channels,
                float* out);

  // Scales to unit length. The count is a multiple of 16.
  void (*normalize)(float* values, int count);

  // Rows of cells [begin, end) of logits[65][height][width]: softmax over the channels, of which
  // channel 8 j + i (not the last) goes to pixel (8 x + i, 8 y + j) of heat, whose width is
  // 8 width. `scratch`: 66 width.
  void (*softmax_cells)(const float* logits, int width, int height, int begin, int end, float* heat,
                        float* scratch);
};

int corner_scratch_size(int width);

// The loops for one instruction set; supported() must hold for it.
const Kernels& kernels(InstructionSet set);
bool supported(InstructionSet set);

// The widest that this machine supports.
const Kernels& best_kernels();

}  // namespace rover::kernels
