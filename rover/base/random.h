#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace rover {

// One step of SplitMix64 (Steele et al. 2014): a good hash of 64 bits.
constexpr std::uint64_t mix_bits(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

// The seed of one random decision: hash(seed, what it is about, what for), so that decisions do
// not depend on the order in which they are taken.
constexpr std::uint64_t hash_seed(std::uint64_t seed, std::uint64_t about,
                                  std::uint64_t purpose = 0) {
  return mix_bits(mix_bits(mix_bits(seed) ^ about) ^ purpose);
}

// Seeded random numbers that are the same on every platform (those of <random>'s distributions are
// not). Satisfies UniformRandomBitGenerator.
class Random {
 public:
  using result_type = std::uint64_t;
  explicit Random(std::uint64_t seed) : state_(mix_bits(seed)) {}

  static constexpr result_type min() { return 0; }
  static constexpr result_type max() { return ~result_type{0}; }
  result_type operator()() { return bits(); }

  std::uint64_t bits() {
    const auto value = mix_bits(state_);
    state_ += 0x9e3779b97f4a7c15ULL;
    return value;
  }

  // In [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

  // In [0, count); count must be positive.
  int index(int count) { return static_cast<int>(uniform() * count); }

  // Mean 0, standard deviation 1 (Box and Muller).
  double gaussian() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  std::uint64_t state_;
};

}  // namespace rover
