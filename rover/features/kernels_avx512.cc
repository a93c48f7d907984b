#define ROVER_KERNELS avx512_kernels
#include "rover/features/kernels_impl.h"
