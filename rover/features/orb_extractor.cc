#include "rover/features/orb_extractor.h"

#include <opencv2/features2d.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "rover/base/error.h"
#include "rover/features/image_input.h"
#include "rover/features/selection.h"

namespace rover {
namespace {

constexpr int kBits = 256;
constexpr float kElement = 1.0f / 16;  // 256 of them make a unit vector
constexpr int kBorder = 31;            // px: patch of the descriptor, turned any way
constexpr int kSelectionRadius = 0;    // levels overlap on purpose: no suppression across them
constexpr float kSigma = 0.22f;        // px at the finest level, see docs/features.md

void unpack_bits(const std::uint8_t* bytes, float* out) {
  for (int i = 0; i < kBits; ++i) {
    out[i] = (bytes[i / 8] >> (i % 8)) & 1 ? kElement : -kElement;
  }
}

std::vector<Candidate> candidates_of(const std::vector<cv::KeyPoint>& found) {
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const float score = std::sqrt(std::sqrt(std::max(found[i].response, 0.0f)));
    candidates.push_back(
        {cvRound(found[i].pt.x), cvRound(found[i].pt.y), score, static_cast<int>(i)});
  }
  return candidates;
}

// Those chosen, each carrying its place in the selection: OpenCV sorts them by level.
std::vector<cv::KeyPoint> keypoints_of(const Selection& selection,
                                       const std::vector<cv::KeyPoint>& found) {
  std::vector<cv::KeyPoint> chosen;
  for (const auto& candidate : selection.chosen) {
    chosen.push_back(found[static_cast<std::size_t>(candidate.index)]);
    chosen.back().class_id = static_cast<int>(chosen.size()) - 1;
  }
  return chosen;
}

class OrbExtractor final : public Extractor {
 public:
  explicit OrbExtractor(const OrbOptions& options) : options_(options) {}

  FeatureSet extract(const cv::Mat& image, const ExtractionRequest& request) const override {
    check_request(image, request);
    const auto orb = make_orb(request.budget);
    std::vector<cv::KeyPoint> found;
    orb->detect(image, found, request.mask ? *request.mask : cv::Mat());
    const auto selection =
        select_candidates(candidates_of(found), request, options_.selection, kSelectionRadius);
    auto described = keypoints_of(selection, found);
    cv::Mat bits;
    orb->compute(image, described, bits);
    FeatureSet features = assemble(selection, described, bits);
    features.image_size = image.size();
    return features;
  }

  int descriptor_size() const override { return kBits; }

 private:
  cv::Ptr<cv::ORB> make_orb(int budget) const {
    // Many more than wanted, so that there is something to choose from.
    return cv::ORB::create(4 * budget, options_.scale, options_.levels, kBorder, 0, 2,
                           cv::ORB::HARRIS_SCORE, kBorder, options_.fast_threshold);
  }

  FeatureSet assemble(const Selection& selection, const std::vector<cv::KeyPoint>& described,
                      const cv::Mat& bits) const {
    std::vector<int> order(described.size());
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(),
              [&](int a, int b) { return described[a].class_id < described[b].class_id; });
    FeatureSet features;
    features.threshold = selection.threshold;
    features.candidates = selection.candidates;
    features.descriptors.resize(std::ssize(order), kBits);
    for (const int i : order) {
      const auto& keypoint = described[i];
      unpack_bits(bits.ptr(i), features.descriptors.row(features.size()).data());
      features.positions.emplace_back(keypoint.pt.x, keypoint.pt.y);
      features.scores.push_back(selection.chosen[keypoint.class_id].score);
      features.sigmas.push_back(kSigma *
                                std::pow(options_.scale, static_cast<float>(keypoint.octave)));
    }
    return features;
  }

  OrbOptions options_;
};

}  // namespace

void OrbOptions::check() const {
  require(levels >= 1 && levels <= 16, "orb: levels must be 1 to 16, not {}", levels);
  require(scale > 1 && scale <= 2, "orb: scale must be in (1, 2], not {}", scale);
  require(fast_threshold >= 1 && fast_threshold <= 255,
          "orb: fast_threshold must be 1 to 255, not {}", fast_threshold);
  selection.check();
}

std::unique_ptr<Extractor> make_orb_extractor(const OrbOptions& options) {
  options.check();
  return std::make_unique<OrbExtractor>(options);
}

}  // namespace rover
