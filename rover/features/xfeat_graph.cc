#include "rover/features/xfeat_graph.h"

#if defined(__x86_64__)
#include <cpuid.h>
#endif

namespace rover {
namespace {

// VNNI, with 512-bit registers or (CPUID leaf 7, subleaf 1) with 256-bit ones.
bool adds_products_of_bytes() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512vnni") && __builtin_cpu_supports("avx512bw")) return true;
  unsigned eax = 0, ebx = 0, ecx = 0, edx = 0;
  constexpr unsigned kAvxVnni = 1u << 4;
  return __builtin_cpu_supports("avx2") && __get_cpuid_count(7, 1, &eax, &ebx, &ecx, &edx) &&
         (eax & kAvxVnni);
#else
  return false;
#endif
}

}  // namespace

std::string xfeat_graph(Precision precision, Device device) {
  const bool automatic = device == Device::kCpu && adds_products_of_bytes();
  const bool int8 =
      precision == Precision::kInt8 || (precision == Precision::kAutomatic && automatic);
  return int8 ? "xfeat_int8.onnx" : "xfeat.onnx";
}

}  // namespace rover
