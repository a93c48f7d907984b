// The loops of kernels.h. Included once per instruction set, with ROVER_KERNELS the name of the
// table to define; everything else has internal linkage. Written so that GCC vectorises them: unit
// strides, no aliases, no calls. No include but kernels.h (and <math.h> for sqrtf, an instruction).

#include <math.h>

#include "rover/features/kernels.h"

namespace rover::kernels {
namespace {

constexpr int kPad = 16;  // floats before and after each row of scratch

inline int clamp_index(int i, int count) { return i < 0 ? 0 : (i >= count ? count - 1 : i); }

inline void replicate_ends(float* row, int width, int count) {
  for (int i = 1; i <= count; ++i) {
    row[-i] = row[0];
    row[width - 1 + i] = row[width - 1];
  }
}

// Gaussian of sigma 1 over seven taps, in 1/256: exact in 16 bits.
constexpr int kTap0 = 102, kTap1 = 62, kTap2 = 14, kTap3 = 1;

void blur_columns(const ImageView& image, int y, std::uint16_t* __restrict out) {
  const std::uint8_t* rows[7];
  for (int k = 0; k < 7; ++k) {
    rows[k] = image.data + clamp_index(y + k - 3, image.height) * image.stride;
  }
  const std::uint8_t* __restrict a = rows[0], * __restrict b = rows[1], * __restrict c = rows[2], * __restrict d = rows[3], * __restrict e = rows[4], * __restrict f = rows[5], * __restrict g = rows[6];
  for (int x = 0; x < image.width; ++x) {
    out[x] = static_cast<std::uint16_t>(kTap0 * d[x] + kTap1 * (c[x] + e[x]) +
                                        kTap2 * (b[x] + f[x]) + kTap3 * (a[x] + g[x]));
  }
}

void blur_row(const std::uint16_t* __restrict columns, int width, float* __restrict wide,
              float* __restrict out) {
  for (int x = 0; x < width; ++x) wide[x] = static_cast<float>(columns[x]);
  replicate_ends(wide, width, 4);
  constexpr float kScale = 1.0f / 65536;
  for (int x = -1; x <= width; ++x) {
    out[x] = kScale * (kTap0 * wide[x] + kTap1 * (wide[x - 1] + wide[x + 1]) +
                       kTap2 * (wide[x - 2] + wide[x + 2]) + kTap3 * (wide[x - 3] + wide[x + 3]));
  }
}

struct Products {
  float *xx, *xy, *yy;
};

// Products of the gradient (central differences) at one row, from the smoothed rows around it.
void gradient_products(const float* __restrict above, const float* __restrict at,
                       const float* __restrict below, int width, Products out) {
  float* __restrict xx = out.xx, * __restrict xy = out.xy, * __restrict yy = out.yy;
  for (int x = 0; x < width; ++x) {
    const float gx = 0.5f * (at[x + 1] - at[x - 1]);
    const float gy = 0.5f * (below[x] - above[x]);
    xx[x] = gx * gx;
    xy[x] = gx * gy;
    yy[x] = gy * gy;
  }
}

void sum_rows(float* const* rows, int width, float* __restrict out) {
  const float* __restrict a = rows[0], * __restrict b = rows[1], * __restrict c = rows[2], * __restrict d = rows[3], * __restrict e = rows[4];
  for (int x = 0; x < width; ++x) out[x] = (a[x] + e[x]) + (b[x] + d[x]) + c[x];
  replicate_ends(out, width, 2);
}

inline float sum5(const float* __restrict p) { return (p[-2] + p[2]) + (p[-1] + p[1]) + p[0]; }

// The smaller eigenvalue (a + c) / 2 - sqrt(((a - c) / 2)^2 + b^2) of [a b; b c].
void eigenvalue_row(const float* __restrict xx, const float* __restrict xy,
                    const float* __restrict yy, const float* __restrict weight, int width,
                    float* __restrict out) {
  for (int x = 0; x < width; ++x) {
    const float a = sum5(xx + x), b = sum5(xy + x), c = sum5(yy + x);
    const float half = 0.5f * (a - c);
    const float smaller = 0.5f * (a + c) - sqrtf(half * half + b * b);
    out[x] = sqrtf((smaller > 0 ? smaller : 0) * (1.0f / 25)) * weight[x];
  }
}

// One row of the coarse map enlarged eight times. `out` has kPad floats around it.
void enlarge_row(const CoarseMap& map, int y, int width, float* __restrict coarse,
                 float* __restrict out) {
  const float v = (static_cast<float>(y) - 3.5f) / 8;
  const int j = static_cast<int>(floorf(v));
  const float t = v - static_cast<float>(j);
  const float* __restrict a = map.data + clamp_index(j, map.height) * map.width;
  const float* __restrict b = map.data + clamp_index(j + 1, map.height) * map.width;
  for (int i = 0; i < map.width; ++i) coarse[i] = a[i] + t * (b[i] - a[i]);
  replicate_ends(coarse, map.width, 1);
  for (int i = -1; i < map.width && 8 * i + 4 < width; ++i) {
    const float low = coarse[i], step = (coarse[i + 1] - coarse[i]) / 8;
    float* __restrict cell = out + 8 * i + 4;
    for (int k = 0; k < 8; ++k) cell[k] = low + step * (static_cast<float>(k) + 0.5f);
  }
}

// Rows of scratch: the ring of smoothed rows, the rings of products, and what one row needs.
struct Scratch {
  Scratch(float* memory, int width) {
    const int stride = width + 2 * kPad;
    float* next = memory + kPad;
    const auto take = [&] {
      float* row = next;
      next += stride;
      return row;
    };
    for (auto& row : smooth) row = take();
    for (auto& ring : products) {
      for (auto& row : ring) row = take();
    }
    for (auto& row : sums) row = take();
    columns = reinterpret_cast<std::uint16_t*>(take());
    wide = take();
    coarse = take();
    weight = take();
  }

  float* smooth[3];
  float* products[3][5];
  float* sums[3];
  std::uint16_t* columns;
  float *wide, *coarse, *weight;
};

inline int ring_index(int y, int size) { return (y + 4 * size) % size; }

void push_smooth(const ImageView& image, int y, Scratch& s) {
  blur_columns(image, y, s.columns);
  blur_row(s.columns, image.width, s.wide, s.smooth[ring_index(y, 3)]);
}

void push_products(const ImageView& image, int y, Scratch& s) {
  push_smooth(image, y + 1, s);
  const int slot = ring_index(y, 5);
  gradient_products(s.smooth[ring_index(y - 1, 3)], s.smooth[ring_index(y, 3)],
                    s.smooth[ring_index(y + 1, 3)], image.width,
                    {s.products[0][slot], s.products[1][slot], s.products[2][slot]});
}

void corner_response(const ImageView& image, const CoarseMap& weight, int begin, int end,
                     float* response, float* scratch) {
  Scratch s(scratch, image.width);
  push_smooth(image, begin - 3, s);
  push_smooth(image, begin - 2, s);
  for (int y = begin - 2; y < begin + 2; ++y) push_products(image, y, s);
  for (int y = begin; y < end; ++y) {
    push_products(image, y + 2, s);
    for (int k = 0; k < 3; ++k) sum_rows(s.products[k], image.width, s.sums[k]);
    enlarge_row(weight, y, image.width, s.coarse, s.weight);
    eigenvalue_row(s.sums[0], s.sums[1], s.sums[2], s.weight, image.width,
                   response + static_cast<std::ptrdiff_t>(y) * image.width);
  }
}

// Doubles the window until it is more than half of the wanted one, then joins two of them.
void row_maximum(const float* row, int width, int radius, float* out, float* scratch) {
  const int window = 2 * radius + 1, length = width + 2 * radius;
  float *in = scratch, *next = scratch + length;
  for (int i = 0; i < radius; ++i) in[i] = in[radius + width + i] = -INFINITY;
  for (int x = 0; x < width; ++x) in[radius + x] = row[x];
  int size = 1;
  for (; 2 * size <= window; size *= 2) {
    const float* __restrict a = in, * __restrict b = in + size;
    float* __restrict c = next;
    for (int x = 0; x + 2 * size <= length; ++x) c[x] = a[x] > b[x] ? a[x] : b[x];
    float* swapped = in;
    in = next;
    next = swapped;
  }
  const float* __restrict a = in, * __restrict b = in + window - size;
  for (int x = 0; x < width; ++x) out[x] = a[x] > b[x] ? a[x] : b[x];
}

int find_maxima(const float* __restrict row, const float* const* rows, int row_count, int width,
                float floor, int* out, float* __restrict scratch) {
  for (int x = 0; x < width; ++x) scratch[x] = floor;
  for (int k = 0; k < row_count; ++k) {
    const float* __restrict other = rows[k];
    for (int x = 0; x < width; ++x) scratch[x] = other[x] > scratch[x] ? other[x] : scratch[x];
  }
  auto* __restrict flags = reinterpret_cast<std::uint8_t*>(scratch + width);
  for (int x = 0; x < width; ++x) flags[x] = row[x] > floor && row[x] >= scratch[x];
  for (int i = 0; i < 8; ++i) flags[width + i] = 0;
  int count = 0;
  for (int x = 0; x < width; x += 8) {
    std::uint64_t eight;
    __builtin_memcpy(&eight, flags + x, 8);
    for (; eight != 0; eight &= eight - 1) out[count++] = x + __builtin_ctzll(eight) / 8;
  }
  return count;
}

void to_float(const std::uint8_t* __restrict in, int width, float scale, float* __restrict out,
              int padded_width) {
  for (int x = 0; x < width; ++x) out[x] = scale * static_cast<float>(in[x]);
  for (int x = width; x < padded_width; ++x) out[x] = out[width - 1];
}

void normalize_cells(const float* planes, int channels, int cells, int begin, int end, float* out) {
  constexpr int kBlock = 16;
  for (int first = begin; first < end; first += kBlock) {
    const int count = end - first < kBlock ? end - first : kBlock;
    float inverse[kBlock] = {};
    for (int c = 0; c < channels; ++c) {
      const float* __restrict in = planes + static_cast<std::ptrdiff_t>(c) * cells + first;
      for (int i = 0; i < count; ++i) inverse[i] += in[i] * in[i];
    }
    for (int i = 0; i < kBlock; ++i) inverse[i] = 1 / sqrtf(inverse[i] + 1e-20f);
    for (int c = 0; c < channels; ++c) {
      const float* __restrict in = planes + static_cast<std::ptrdiff_t>(c) * cells + first;
      float* __restrict to = out + static_cast<std::ptrdiff_t>(first) * channels + c;
      for (int i = 0; i < count; ++i) to[i * channels] = in[i] * inverse[i];
    }
  }
}

void blend(const float* const* vectors, const float* weights, int count, int channels,
           float* __restrict out) {
  for (int c = 0; c < channels; ++c) out[c] = 0;
  for (int i = 0; i < count; ++i) {
    const float* __restrict in = vectors[i];
    const float weight = weights[i];
    for (int c = 0; c < channels; ++c) out[c] += weight * in[c];
  }
}

void normalize(float* values, int count) {
  float parts[16] = {};
  for (int i = 0; i + 16 <= count; i += 16) {
    for (int k = 0; k < 16; ++k) parts[k] += values[i + k] * values[i + k];
  }
  float square = 0;
  for (int k = 0; k < 16; ++k) square += parts[k];
  const float inverse = 1 / sqrtf(square + 1e-20f);
  for (int i = 0; i < count; ++i) values[i] *= inverse;
}

// exp(x) for x <= 0, to 2e-7 of its value: 2^k by the exponent's bits, the rest by its series.
inline float exponential(float x) {
  const float scaled = (x < -87.0f ? -87.0f : x) * 1.44269504f;
  const int whole = static_cast<int>(scaled - 0.5f);
  const float r = (scaled - static_cast<float>(whole)) * 0.693147181f;
  const float series =
      1 + r * (1 + r * (0.5f + r * (1.0f / 6 + r * (1.0f / 24 + r * (1.0f / 120 + r / 720)))));
  const std::int32_t bits = (whole + 127) << 23;
  float power;
  __builtin_memcpy(&power, &bits, 4);
  return series * power;
}

void softmax_row(const float* logits, int plane, int width, float* scratch) {
  float* __restrict largest = scratch, * __restrict sum = scratch + width;
  for (int x = 0; x < width; ++x) largest[x] = logits[x];
  for (int c = 1; c < 65; ++c) {
    const float* __restrict in = logits + static_cast<std::ptrdiff_t>(c) * plane;
    for (int x = 0; x < width; ++x) largest[x] = in[x] > largest[x] ? in[x] : largest[x];
  }
  for (int x = 0; x < width; ++x) sum[x] = 0;
  for (int c = 64; c >= 0; --c) {  // the last channel's powers are not kept
    const float* __restrict in = logits + static_cast<std::ptrdiff_t>(c) * plane;
    float* __restrict powers = scratch + (c == 64 ? 2 : 2 + c) * width;
    for (int x = 0; x < width; ++x) powers[x] = exponential(in[x] - largest[x]);
    for (int x = 0; x < width; ++x) sum[x] += powers[x];
  }
}

void softmax_cells(const float* logits, int width, int height, int begin, int end, float* heat,
                   float* scratch) {
  const float *sum = scratch + width, *powers = scratch + 2 * width;
  for (int y = begin; y < end; ++y) {
    softmax_row(logits + static_cast<std::ptrdiff_t>(y) * width, width * height, width, scratch);
    for (int j = 0; j < 8; ++j) {
      float* __restrict row = heat + (static_cast<std::ptrdiff_t>(y) * 8 + j) * 8 * width;
      for (int x = 0; x < width; ++x) {
        for (int i = 0; i < 8; ++i) row[8 * x + i] = powers[(8 * j + i) * width + x] / sum[x];
      }
    }
  }
}

}  // namespace

extern const Kernels ROVER_KERNELS;
const Kernels ROVER_KERNELS = {corner_response, row_maximum, find_maxima, to_float,
                               normalize_cells, blend,       normalize,   softmax_cells};

}  // namespace rover::kernels
