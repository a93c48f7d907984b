#define ROVER_KERNELS baseline_kernels
#include "rover/features/kernels_impl.h"
