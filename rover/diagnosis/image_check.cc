#include "rover/diagnosis/image_check.h"

#include <algorithm>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "rover/base/quantile.h"
#include "rover/matching/epipolar.h"

namespace rover {
namespace {

// How much of the variation between neighbours along one direction is left after a strong low-pass
// in it: little in a sharp image, most in a blurred one.
double blur_along(const cv::Mat& image, bool horizontal) {
  const cv::Size size = horizontal ? cv::Size(9, 1) : cv::Size(1, 9);
  const cv::Rect first(0, 0, image.cols - horizontal, image.rows - !horizontal);
  const cv::Rect second(horizontal, !horizontal, first.width, first.height);
  cv::Mat smooth, steps, smooth_steps;
  cv::blur(image, smooth, size);
  cv::absdiff(image(first), image(second), steps);
  cv::absdiff(smooth(first), smooth(second), smooth_steps);
  const double all = cv::sum(steps)[0];
  const cv::Mat lost = steps - smooth_steps;  // saturates at 0
  return all > 0 ? 1 - cv::sum(lost)[0] / all : 1;
}

double share_of(const cv::Mat& mask) {
  return cv::countNonZero(mask) / static_cast<double>(mask.total());
}

struct CameraFigures {
  std::vector<double> brightness, dark, bright, blur;
  std::vector<int> features;
};

CameraFigures collect(const std::vector<SampledFrame>& samples, const SampledFeatures& features,
                      std::size_t camera) {
  CameraFigures all;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples[i].images[camera].empty()) continue;
    const ImageFigures figures = figures_of(samples[i].images[camera]);
    all.brightness.push_back(figures.brightness);
    all.dark.push_back(figures.dark);
    all.bright.push_back(figures.bright);
    all.blur.push_back(figures.blur);
    all.features.push_back(features[i][camera].candidates);
  }
  return all;
}

void judge_exposure(const CameraFigures& figures, std::size_t camera, Topic& topic) {
  const double brightness = median(figures.brightness);
  const double dark = median(figures.dark), bright = median(figures.bright);
  Severity severity = std::max(judge_above(dark, 0.3, 0.6), judge_above(bright, 0.15, 0.35));
  if (brightness < 25) severity = std::max(severity, Severity::kNote);
  if (brightness < 8) severity = Severity::kWarning;
  topic.add(severity, fmt::format("exposure_{}", camera),
            fmt::format("camera {}: mean gray level {:.0f} ({:.0f} to {:.0f}); {:.1f}% black, "
                        "{:.1f}% saturated",
                        camera, brightness, quantile(figures.brightness, 0.0),
                        quantile(figures.brightness, 1.0), 100 * dark, 100 * bright),
            "nothing is seen where pixels are black or saturated: set exposure and gain",
            brightness);
}

void judge_sharpness(const CameraFigures& figures, std::size_t camera, Topic& topic) {
  const double blur = median(figures.blur);
  topic.add(judge_above(blur, 0.75, 0.9), fmt::format("blur_{}", camera),
            fmt::format("camera {}: blur {:.2f} (0 sharp, 1 none is left), worst of the sampled "
                        "frames {:.2f}",
                        camera, blur, quantile(figures.blur, 1.0)),
            "focus the lens, shorten the exposure", blur);
}

void judge_features(const CameraFigures& figures, std::size_t camera, Topic& topic) {
  const int usual = median(figures.features), least = quantile(figures.features, 0.0);
  const Severity severity = usual < 100                  ? Severity::kWarning
                            : usual < 250 || least < 100 ? Severity::kNote
                                                         : Severity::kOk;
  topic.add(
      severity, fmt::format("features_{}", camera),
      fmt::format(
          "camera {}: {} corners to choose from per image, at least {} in the {} sampled frames",
          camera, usual, least, figures.features.size()),
      "there is little to track: more light, more texture, or a wider lens", usual);
}

// Distances of matches from their epipolar lines, px.
struct EpipolarErrors {
  std::vector<double> all;
  int near = 0;      // within 3 px
  int in_front = 0;  // and with the point in front of both cameras
  int pairs = 0;
};

void add_pair(const Rig& rig, const FeatureSet& left, const FeatureSet& right,
              std::span<const Match> matches, EpipolarErrors& errors) {
  constexpr double kNear = 3;
  const SE3 right_from_left = rig.body_from_camera[1].inverse() * rig.body_from_camera[0];
  const auto a = observe_rays(rig.cameras[0], left.positions);
  const auto b = observe_rays(rig.cameras[1], right.positions);
  for (const Match& match : matches) {
    const double distance = epipolar_distance(a[match.a], b[match.b], right_from_left);
    errors.all.push_back(distance);
    errors.near += distance <= kNear;
  }
  const auto inliers = epipolar_inliers(matches, a, b, right_from_left, kNear);
  errors.in_front += static_cast<int>(inliers.size());
  ++errors.pairs;
}

void judge_stereo(const EpipolarErrors& errors, Topic& topic) {
  const double usual = median(errors.all);
  topic.add(judge_above(usual, 1.2, 2.5), "epipolar_error",
            fmt::format("stereo: matches lie {:.2f} px (median) from their epipolar lines, {} "
                        "matches in {} pairs",
                        usual, errors.all.size(), errors.pairs),
            "extrinsics or intrinsics are not those of these cameras, or the images of a pair are "
            "not of one instant: calibrate anew",
            usual);
  if (errors.in_front >= 0.6 * errors.near) return;
  topic.add(Severity::kWarning, "stereo_order",
            fmt::format("stereo: {:.0f}% of the points lie behind the cameras",
                        100 * (1 - errors.in_front / static_cast<double>(errors.near))),
            "the left and right images are swapped, or the baseline has the wrong sign",
            errors.in_front / static_cast<double>(errors.near));
}

}  // namespace

ImageFigures figures_of(const cv::Mat& image) {
  return {cv::mean(image)[0], share_of(image <= 5), share_of(image >= 250),
          std::max(blur_along(image, true), blur_along(image, false))};
}

SampledFeatures extract_samples(const std::vector<SampledFrame>& samples,
                                const FeatureFamily& family, int budget) {
  ExtractionRequest request;
  request.budget = budget;
  SampledFeatures features(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (const cv::Mat& image : samples[i].images)
      features[i].push_back(image.empty() ? FeatureSet()
                                          : family.extractor->extract(image, request));
  }
  return features;
}

void check_images(const std::vector<SampledFrame>& samples, const SampledFeatures& features,
                  Findings& findings) {
  Topic topic("images", findings);
  for (std::size_t camera = 0; camera < samples.front().images.size(); ++camera) {
    const CameraFigures figures = collect(samples, features, camera);
    if (figures.blur.empty()) continue;
    judge_exposure(figures, camera, topic);
    judge_sharpness(figures, camera, topic);
    judge_features(figures, camera, topic);
  }
}

void check_stereo(const Rig& rig, const std::vector<SampledFrame>& samples,
                  const SampledFeatures& features, const FeatureFamily& family,
                  Findings& findings) {
  Topic topic("calibration", findings);
  EpipolarErrors errors;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const cv::Mat &left = samples[i].images[0], &right = samples[i].images[1];
    if (left.empty() || right.empty()) continue;
    const auto matches = family.matcher->match({features[i][0], &left}, {features[i][1], &right});
    add_pair(rig, features[i][0], features[i][1], matches, errors);
  }
  if (errors.all.size() >= 50) return judge_stereo(errors, topic);
  topic.add(Severity::kWarning, "epipolar_error",
            fmt::format("stereo: only {} matches in {} pairs", errors.all.size(), errors.pairs),
            "the cameras hardly see the same: look at the images of one pair side by side");
}

}  // namespace rover
