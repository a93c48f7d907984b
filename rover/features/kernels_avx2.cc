#define ROVER_KERNELS avx2_kernels
#include "rover/features/kernels_impl.h"
