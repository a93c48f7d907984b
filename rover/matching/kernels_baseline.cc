#include "rover/matching/kernels.h"

#include "rover/matching/kernels_loops.inc"

namespace rover {

extern const MatchingKernels baseline_matching_kernels;
const MatchingKernels baseline_matching_kernels = {"baseline",  similarities,  product,
                                                   row_maximum, column_maxima, align};

}  // namespace rover
