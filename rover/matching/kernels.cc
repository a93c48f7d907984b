#include "rover/matching/kernels.h"

namespace rover {

extern const MatchingKernels baseline_matching_kernels;
#if defined(__x86_64__)
extern const MatchingKernels avx2_matching_kernels;
extern const MatchingKernels avx512_matching_kernels;
#endif

std::vector<const MatchingKernels*> available_matching_kernels() {
  std::vector<const MatchingKernels*> available = {&baseline_matching_kernels};
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    available.push_back(&avx2_matching_kernels);
  }
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq")) {
    available.push_back(&avx512_matching_kernels);
  }
#endif
  return available;
}

const MatchingKernels& matching_kernels() {
  static const MatchingKernels& fastest = *available_matching_kernels().back();
  return fastest;
}

std::vector<float> pack_transposed(const float* matrix, int rows, int size) {
  constexpr int kWidth = MatchingKernels::kPackWidth;
  const int panels = (rows + kWidth - 1) / kWidth;
  std::vector<float> packed(static_cast<std::size_t>(panels) * kWidth * size, 0.0f);
  for (int row = 0; row < rows; ++row) {
    const float* source = matrix + static_cast<std::ptrdiff_t>(row) * size;
    float* panel = packed.data() + static_cast<std::ptrdiff_t>(row / kWidth) * kWidth * size;
    for (int k = 0; k < size; ++k) panel[k * kWidth + row % kWidth] = source[k];
  }
  return packed;
}

}  // namespace rover
