#pragma once

#include <memory>
#include <optional>
#include <string>

#include <opencv2/core.hpp>

#include "rover/features/feature_set.h"

namespace rover {

// How many features are wanted from one image.
struct ExtractionRequest {
  int budget = 800;                // at most this many
  int last_matches = 0;            // matches of the last tracked frame, for the adaptive threshold;
                                   // 0 when lost: the lowest threshold
  std::optional<float> threshold;  // given for the right image: that of the left one
  const cv::Mat* mask = nullptr;   // 8 bit, of the image's size: no features where it is 0
};

// Finds features in images. extract() is const and may be called from several threads at once; the
// same image and request give the same bytes.
class Extractor {
 public:
  virtual ~Extractor() = default;

  // image: 8 bit, one channel, at least 32x32. Throws InputError for other images.
  virtual FeatureSet extract(const cv::Mat& image, const ExtractionRequest& request) const = 0;

  virtual int descriptor_size() const = 0;
};

}  // namespace rover
