#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "rover/base/random.h"

namespace rover {

// What textures are painted on. Lengths are metres on the surface, from its upper left corner;
// tones are albedos from 0 to 1. Everything that is left to chance comes from the seed.
class Canvas {
 public:
  // size: of the surface, metres. texel: edge of a pixel, metres.
  Canvas(cv::Size2d size, double texel, double tone, std::uint64_t seed);

  double width() const { return size_.width; }
  double height() const { return size_.height; }
  double texel() const { return texel_; }
  Random& random() { return random_; }
  double pick(double low, double high) { return random_.uniform(low, high); }
  bool chance(double probability) { return random_.uniform() < probability; }
  cv::Point2d somewhere() { return {pick(0, width()), pick(0, height())}; }

  // Adds smooth noise of one size of grain, stretched along y by `stretch`.
  void add_noise(double wavelength, double amplitude, double stretch = 1);
  // The sum of such, from the surface's own size down to its texels, each half as coarse as the
  // one before and `decay` times as strong.
  void add_noise_at_many_scales(double coarsest, double amplitude, double decay = 0.75);
  // Soft dark or light blobs.
  void add_stains(int count, double largest, double amplitude);
  // Bits of tape, dots, screws, scratches: `density` per square metre.
  void add_marks(double density);

  void fill_rectangle(cv::Rect2d area, double tone);
  void frame_rectangle(cv::Rect2d area, double thickness, double tone);
  void fill_polygon(const std::vector<cv::Point2d>& corners, double tone);
  void fill_disc(cv::Point2d centre, double radius, double tone);
  void draw_ring(cv::Point2d centre, double radius, double thickness, double tone);
  void draw_line(const std::vector<cv::Point2d>& points, double thickness, double tone);
  // baseline: the lower left corner of the text. height: of capital letters.
  void write(const std::string& text, cv::Point2d baseline, double height, double tone);
  // The width that `write` needs.
  double text_width(const std::string& text, double height) const;
  void paste(const cv::Mat& gray, cv::Rect2d area);

  // Words that nobody has used.
  std::string random_word(int shortest = 3, int longest = 9);

  // 8 bit.
  cv::Mat finish() const;

 private:
  cv::Point pixel(cv::Point2d p) const;
  int pixels(double length) const;
  cv::Rect pixels(cv::Rect2d area) const;
  void add_blob(cv::Point2d centre, double radius, double amplitude);

  cv::Size2d size_;
  double texel_;
  cv::Mat image_;  // 32-bit float
  Random random_;
};

}  // namespace rover
