#include "rover/simulation/texture_canvas.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace rover {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_DUPLEX;
constexpr double kCapitalHeight = 21;  // px of this font at scale 1

cv::Mat random_field(cv::Size size, Random& random) {
  cv::Mat field(size, CV_32F);
  for (int y = 0; y < size.height; ++y) {
    float* row = field.ptr<float>(y);
    for (int x = 0; x < size.width; ++x) row[x] = static_cast<float>(random.uniform(-1, 1));
  }
  return field;
}

}  // namespace

Canvas::Canvas(cv::Size2d size, double texel, double tone, std::uint64_t seed)
    : size_(size),
      texel_(texel),
      image_(std::max(2, static_cast<int>(std::ceil(size.height / texel))),
             std::max(2, static_cast<int>(std::ceil(size.width / texel))), CV_32F,
             cv::Scalar(tone)),
      random_(seed) {}

int Canvas::pixels(double length) const { return static_cast<int>(std::lround(length / texel_)); }

cv::Point Canvas::pixel(cv::Point2d p) const { return {pixels(p.x), pixels(p.y)}; }

cv::Rect Canvas::pixels(cv::Rect2d area) const { return {pixel(area.tl()), pixel(area.br())}; }

void Canvas::add_noise(double wavelength, double amplitude, double stretch) {
  const auto cells = [&](int pixels_along, double period) {
    return std::clamp(static_cast<int>(pixels_along * texel_ / period) + 3, 3, pixels_along + 3);
  };
  const cv::Size coarse(cells(image_.cols, wavelength / 2),
                        cells(image_.rows, wavelength * stretch / 2));
  cv::Mat fine;
  cv::resize(random_field(coarse, random_), fine, image_.size(), 0, 0, cv::INTER_CUBIC);
  cv::scaleAdd(fine, 1.7 * amplitude, image_, image_);  // uniform noise to its deviation
}

void Canvas::add_noise_at_many_scales(double coarsest, double amplitude, double decay) {
  for (double wavelength = coarsest; wavelength > 1.5 * texel_; wavelength /= 2) {
    add_noise(wavelength, amplitude);
    amplitude *= decay;
  }
}

void Canvas::add_blob(cv::Point2d centre, double radius, double amplitude) {
  const cv::Rect area =
      pixels(cv::Rect2d(centre.x - radius, centre.y - radius, 2 * radius, 2 * radius)) &
      cv::Rect({0, 0}, image_.size());
  const double scale = texel_ / radius;
  for (int y = area.y; y < area.br().y; ++y) {
    float* row = image_.ptr<float>(y);
    const double dy = y * scale - centre.y / radius;
    for (int x = area.x; x < area.br().x; ++x) {
      const double dx = x * scale - centre.x / radius;
      const double inside = std::max(0.0, 1 - dx * dx - dy * dy);
      row[x] += static_cast<float>(amplitude * inside * inside);
    }
  }
}

void Canvas::add_stains(int count, double largest, double amplitude) {
  for (int i = 0; i < count; ++i) {
    const cv::Point2d centre = somewhere();
    const double size = largest * pick(0.15, 1);
    const double strength = amplitude * pick(-1, 0.4);
    for (int k = 0; k < 6; ++k) {  // a ragged one
      const cv::Point2d offset(pick(-0.6, 0.6) * size, pick(-0.6, 0.6) * size);
      add_blob(centre + offset, size * pick(0.2, 0.8), strength * pick(0.3, 1));
    }
  }
}

void Canvas::add_marks(double density) {
  const int count = static_cast<int>(density * width() * height() + random_.uniform());
  for (int i = 0; i < count; ++i) {
    const cv::Point2d at = somewhere();
    const double tone = chance(0.5) ? pick(0.03, 0.2) : pick(0.75, 0.95);
    const double angle = pick(0, 2 * CV_PI);
    const cv::Point2d along(std::cos(angle), std::sin(angle));
    const double kind = random_.uniform();
    if (kind < 0.3) {
      fill_disc(at, pick(0.004, 0.02), tone);
    } else if (kind < 0.7) {
      draw_line({at, at + pick(0.02, 0.12) * along}, pick(0.008, 0.035), tone);
    } else if (kind < 0.9) {
      const cv::Point2d mid = at + pick(0.1, 0.5) * along;
      draw_line({at, mid, mid + cv::Point2d(pick(-0.2, 0.2), pick(-0.2, 0.2))}, 0.004, tone);
    } else {
      const double edge = pick(0.03, 0.1);
      fill_rectangle({at.x, at.y, edge, edge * pick(0.5, 2)}, tone);
    }
  }
}

void Canvas::fill_rectangle(cv::Rect2d area, double tone) {
  const cv::Rect inside = pixels(area) & cv::Rect({0, 0}, image_.size());
  if (!inside.empty()) image_(inside).setTo(tone);
}

void Canvas::frame_rectangle(cv::Rect2d area, double thickness, double tone) {
  fill_rectangle({area.x, area.y, area.width, thickness}, tone);
  fill_rectangle({area.x, area.br().y - thickness, area.width, thickness}, tone);
  fill_rectangle({area.x, area.y, thickness, area.height}, tone);
  fill_rectangle({area.br().x - thickness, area.y, thickness, area.height}, tone);
}

void Canvas::fill_polygon(const std::vector<cv::Point2d>& corners, double tone) {
  std::vector<cv::Point> points;
  for (const cv::Point2d& corner : corners) points.push_back(pixel(corner));
  cv::fillPoly(image_, std::vector<std::vector<cv::Point>>{points}, cv::Scalar(tone));
}

void Canvas::fill_disc(cv::Point2d centre, double radius, double tone) {
  cv::circle(image_, pixel(centre), std::max(1, pixels(radius)), cv::Scalar(tone), cv::FILLED);
}

void Canvas::draw_ring(cv::Point2d centre, double radius, double thickness, double tone) {
  cv::circle(image_, pixel(centre), std::max(1, pixels(radius)), cv::Scalar(tone),
             std::max(1, pixels(thickness)));
}

void Canvas::draw_line(const std::vector<cv::Point2d>& points, double thickness, double tone) {
  std::vector<cv::Point> line;
  for (const cv::Point2d& point : points) line.push_back(pixel(point));
  cv::polylines(image_, line, false, cv::Scalar(tone), std::clamp(pixels(thickness), 1, 1000));
}

void Canvas::write(const std::string& text, cv::Point2d baseline, double height, double tone) {
  const double scale = height / texel_ / kCapitalHeight;
  const int thickness = std::max(1, pixels(0.14 * height));
  cv::putText(image_, text, pixel(baseline), kFont, scale, cv::Scalar(tone), thickness);
}

double Canvas::text_width(const std::string& text, double height) const {
  const double scale = height / texel_ / kCapitalHeight;
  int below = 0;
  return texel_ * cv::getTextSize(text, kFont, scale, 1, &below).width;
}

void Canvas::paste(const cv::Mat& gray, cv::Rect2d area) {
  const cv::Rect inside = pixels(area) & cv::Rect({0, 0}, image_.size());
  if (inside.empty()) return;
  cv::Mat sized;
  cv::resize(gray, sized, inside.size(), 0, 0,
             gray.cols > inside.width ? cv::INTER_AREA : cv::INTER_CUBIC);
  sized.convertTo(image_(inside), CV_32F, 1 / 255.0);
}

std::string Canvas::random_word(int shortest, int longest) {
  static const std::string kLetters = "ABCDEFGHIKLMNOPRSTUVWXYZabcdefghiklmnoprstuvwxyz0123456789";
  std::string word;
  const int length = shortest + random_.index(longest - shortest + 1);
  for (int i = 0; i < length; ++i) {
    word += kLetters[random_.index(static_cast<int>(kLetters.size()))];
  }
  return word;
}

cv::Mat Canvas::finish() const {
  cv::Mat bytes;
  const cv::Mat floored = cv::max(image_, 0.02);  // nothing is quite black
  floored.convertTo(bytes, CV_8U, 255);
  return bytes;
}

}  // namespace rover
