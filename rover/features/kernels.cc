#include "rover/features/kernels.h"

namespace rover::kernels {

extern const Kernels baseline_kernels;
#if defined(__x86_64__)
extern const Kernels avx2_kernels;
extern const Kernels avx512_kernels;
#endif

// Rows of scratch with room to read beyond their ends; see Scratch in kernels_impl.h.
int corner_scratch_size(int width) { return 25 * (width + 32); }

bool supported(InstructionSet set) {
#if defined(__x86_64__)
  if (set == InstructionSet::kAvx2) {
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  }
  if (set == InstructionSet::kAvx512) {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
  }
#endif
  return set == InstructionSet::kBaseline;
}

const Kernels& kernels(InstructionSet set) {
#if defined(__x86_64__)
  if (set == InstructionSet::kAvx2) return avx2_kernels;
  if (set == InstructionSet::kAvx512) return avx512_kernels;
#endif
  (void)set;
  return baseline_kernels;
}

const Kernels& best_kernels() {
  static const Kernels& best =
      kernels(supported(InstructionSet::kAvx512) ? InstructionSet::kAvx512
              : supported(InstructionSet::kAvx2) ? InstructionSet::kAvx2
                                                 : InstructionSet::kBaseline);
  return best;
}

}  // namespace rover::kernels
