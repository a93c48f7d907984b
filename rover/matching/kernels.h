#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace rover {

// Sums over a window of image samples I and the planes of a template (see AlignmentTemplate).
struct AlignmentSums {
  float image = 0;             // sum of I
  float image_square = 0;      // sum of I * I
  float image_template = 0;    // sum of I * intensity
  float image_gradient_x = 0;  // sum of I * gradient_x
  float image_gradient_y = 0;  // sum of I * gradient_y
};

// What a window of an image is compared with. Rows are padded to kStride with zeros, so that the
// loops over them have a fixed length. `inside` is 1 in the window and 0 in the padding.
struct AlignmentTemplate {
  static constexpr int kStride = 16;
  static constexpr int kMaxWindow = 15;
  int window = 0;  // px, rows and columns in use
  float inside[kStride] = {};
  alignas(64) float intensity[kStride * kMaxWindow] = {};
  alignas(64) float gradient_x[kStride * kMaxWindow] = {};
  alignas(64) float gradient_y[kStride * kMaxWindow] = {};
};

// The hot loops of matching, built once for each instruction set and chosen at run time. All
// matrices are row-major floats. Results of two sets differ by rounding only.
struct MatchingKernels {
  static constexpr int kPackWidth = 16;  // columns of a packed panel
  const char* name;

  // out[i] = dot product of `query` and row indices[i] of `rows`; `size` floats each.
  void (*similarities)(const float* query, const float* rows, int size, const int* indices,
                       int count, float* out);

  // out (count x stride) = a (count x size) times the packed matrix (size x stride); see
  // pack_transposed. `stride` is a multiple of kPackWidth.
  void (*product)(const float* a, int count, const float* packed, int stride, int size, float* out);

  // The largest value of a row, its (first) index and the largest of the others.
  void (*row_maximum)(const float* row, int count, float* best, int* index, float* second);

  // best[j], index[j] = row[j], `row_index` wherever row[j] > best[j].
  void (*column_maxima)(const float* row, int count, int row_index, float* best, int* index);

  // Bilinear samples of the window whose upper left corner is (x + fraction_x, y + fraction_y),
  // `pixels` pointing at (x, y), minus `offset`, summed with the template's planes. Reads
  // kStride + 1 pixels of each of window + 1 rows, whatever the window.
  AlignmentSums (*align)(const std::uint8_t* pixels, std::ptrdiff_t stride, float fraction_x,
                         float fraction_y, float offset, const AlignmentTemplate& reference);
};

// The fastest set that this machine can run.
const MatchingKernels& matching_kernels();

// All sets that this machine can run, the portable baseline first; for tests.
std::vector<const MatchingKernels*> available_matching_kernels();

// Packs a row-major matrix (rows x size) transposed, in panels of kPackWidth rows each: the right
// side of MatchingKernels::product. Padded with zeros.
std::vector<float> pack_transposed(const float* matrix, int rows, int size);

}  // namespace rover
