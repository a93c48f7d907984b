#pragma once

#include <cmath>

#include "rover/base/random.h"
#include "rover/features/feature_set.h"

namespace rover {

// Features at random places with random unit descriptors, for tests.
inline FeatureSet random_features(int count, int descriptor_size, std::uint64_t seed,
                                  cv::Size image_size = {640, 480}) {
  Random random(seed);
  FeatureSet features;
  features.image_size = image_size;
  features.descriptors.resize(count, descriptor_size);
  for (int i = 0; i < count; ++i) {
    features.positions.emplace_back(static_cast<float>(random.uniform(0, image_size.width - 1)),
                                    static_cast<float>(random.uniform(0, image_size.height - 1)));
    features.scores.push_back(1.0f - static_cast<float>(i) / static_cast<float>(count));
    features.sigmas.push_back(0.3f);
    for (int k = 0; k < descriptor_size; ++k) {
      features.descriptors(i, k) = static_cast<float>(random.gaussian());
    }
    features.descriptors.row(i).normalize();
  }
  return features;
}

// The same features in another order with noise on their descriptors: feature i becomes
// (i * 7 + 3) modulo the count, which must not be a multiple of 7.
inline FeatureSet shuffled_features(const FeatureSet& features, float noise, std::uint64_t seed) {
  Random random(seed);
  FeatureSet shuffled = features;
  for (int i = 0; i < features.size(); ++i) {
    const int to = (i * 7 + 3) % features.size();
    shuffled.positions[to] = features.positions[i];
    shuffled.descriptors.row(to) = features.descriptors.row(i);
    for (auto& value : shuffled.descriptors.row(to)) {
      value += noise * static_cast<float>(random.gaussian());
    }
    shuffled.descriptors.row(to).normalize();
  }
  return shuffled;
}

}  // namespace rover
