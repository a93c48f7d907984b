#include "rover/matching/kernels.h"

#if defined(__x86_64__)
#include "rover/matching/kernels_loops.inc"

namespace rover {

extern const MatchingKernels avx2_matching_kernels;
const MatchingKernels avx2_matching_kernels = {"avx2",      similarities,  product,
                                               row_maximum, column_maxima, align};

}  // namespace rover
#endif
