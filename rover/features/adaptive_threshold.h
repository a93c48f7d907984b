#pragma once

#include <span>

namespace rover {

// The score threshold that follows the scene and the tracker (the paper's rule; DESIGN, section 4):
//
//   T = E + sigma / 2 + mu1 sigma / (1 + exp(-mu2 m))
//
// with E and sigma the mean and standard deviation of the scores of this image's candidates (all
// maxima left by non-maximum suppression), and m the matches of the last tracked frame. Few matches
// lower the threshold, many raise it; the last term lies in [mu1 / 2, mu1) sigma.
//
// The paper adds mu1 itself to scores in [0, 1]. Families score in different units (a probability,
// gray levels per pixel), and contrast scales them from frame to frame; so scores are first divided
// by their sigma, which makes mu1 a number of standard deviations and the choice of features
// independent of the contrast.
struct AdaptiveThresholdOptions {
  bool enabled = true;     // else T = low
  float mu1 = 0.25f;       // standard deviations
  float mu2 = 0.02f;       // per match
  int min_features = 500;  // this many best candidates pass, however high T is
  float low = 0;           // T is clamped to [low, high], units of the score; also the floor
  float high = 1e9f;       // of what is a candidate at all

  void check() const;
};

// T of the rule; `low` if there are no scores. matches >= 0.
float adaptive_threshold(std::span<const float> scores, int matches,
                         const AdaptiveThresholdOptions& options);

}  // namespace rover
