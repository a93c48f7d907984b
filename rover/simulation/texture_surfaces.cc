#include "rover/simulation/texture_surfaces.h"

#include <algorithm>
#include <cmath>

#include "rover/simulation/texture_canvas.h"
#include "rover/simulation/texture_prints.h"

namespace rover {
namespace {

void paint_plaster(Canvas& canvas) {
  canvas.add_noise_at_many_scales(1.5, 0.025, 0.8);
  canvas.add_stains(static_cast<int>(canvas.width() * canvas.height()), 0.4, 0.08);
  canvas.add_marks(2.5);
}

void paint_plain(Canvas& canvas) {
  canvas.add_noise(2.0, 0.012);
  canvas.add_noise(0.01, 0.004);
  canvas.add_marks(0.12);
}

// One brick with corners that are a little off and a tone of its own.
void paint_brick(Canvas& canvas, cv::Point2d corner, cv::Size2d size, double tone) {
  std::vector<cv::Point2d> corners = {corner, corner + cv::Point2d(size.width, 0),
                                      corner + cv::Point2d(size.width, size.height),
                                      corner + cv::Point2d(0, size.height)};
  for (cv::Point2d& c : corners) c += cv::Point2d(canvas.pick(-4, 4), canvas.pick(-3, 3)) * 1e-3;
  canvas.fill_polygon(corners, tone + canvas.pick(-0.13, 0.13));
}

void paint_bricks(Canvas& canvas, double tone) {
  canvas.fill_rectangle({0, 0, canvas.width(), canvas.height()}, 0.62);
  const double row_height = 0.085, joint = 0.012;
  for (double y = 0; y < canvas.height(); y += row_height) {
    for (double x = -canvas.pick(0, 0.25); x < canvas.width();) {
      const double length = canvas.pick(0.2, 0.27);
      paint_brick(canvas, {x, y}, {length - joint, row_height - joint}, tone);
      x += length;
    }
  }
  canvas.add_noise_at_many_scales(1.0, 0.02, 0.95);
  canvas.add_stains(static_cast<int>(2 * canvas.width() * canvas.height()), 0.5, 0.1);
  canvas.add_marks(1);
}

void paint_plank(Canvas& canvas, cv::Rect2d area, double tone) {
  canvas.fill_rectangle(area, tone);
  const int grains = static_cast<int>(area.width / 0.012);
  for (int i = 0; i < grains; ++i) {
    std::vector<cv::Point2d> grain;
    double x = area.x + canvas.pick(0.005, area.width - 0.005);
    for (double y = area.y; y < area.br().y + 0.1; y += 0.1) {
      grain.push_back({x, std::min(y, area.br().y)});
      x = std::clamp(x + canvas.pick(-0.004, 0.004), area.x, area.br().x);
    }
    canvas.draw_line(grain, 0.002, tone - canvas.pick(0.02, 0.14));
  }
  while (canvas.chance(0.5)) {  // knots
    const cv::Point2d at(area.x + canvas.pick(0.2, 0.8) * area.width,
                         area.y + canvas.pick(0, 1) * area.height);
    const double radius = canvas.pick(0.008, 0.02);
    canvas.fill_disc(at, radius, tone - 0.22);
    canvas.draw_ring(at, 1.5 * radius, 0.003, tone - 0.12);
  }
  canvas.frame_rectangle(area, 0.003, 0.4 * tone);
}

void paint_wood(Canvas& canvas, double tone) {
  for (double x = 0; x < canvas.width();) {
    const double width = canvas.pick(0.09, 0.2);
    for (double y = -canvas.pick(0, 1.5); y < canvas.height();) {
      const double length = canvas.pick(0.8, 2.2);
      paint_plank(canvas, {x, y, width, length}, tone + canvas.pick(-0.1, 0.1));
      y += length;
    }
    x += width;
  }
  canvas.add_noise(0.02, 0.02, 12);
  canvas.add_noise(0.15, 0.02, 4);
  canvas.add_marks(0.8);
}

void paint_crack(Canvas& canvas) {
  std::vector<cv::Point2d> crack = {canvas.somewhere()};
  double direction = canvas.pick(0, 2 * CV_PI);
  for (int i = 0; i < 30; ++i) {
    direction += canvas.pick(-0.6, 0.6);
    const double step = canvas.pick(0.01, 0.06);
    crack.push_back(crack.back() + step * cv::Point2d(std::cos(direction), std::sin(direction)));
  }
  canvas.draw_line(crack, 0.003, 0.15);
}

void paint_concrete(Canvas& canvas) {
  canvas.add_noise_at_many_scales(1.2, 0.03, 0.85);
  const int area = static_cast<int>(canvas.width() * canvas.height()) + 1;
  canvas.add_stains(2 * area, 0.35, 0.1);
  for (int i = 0; i < area / 2; ++i) paint_crack(canvas);
  for (double x = 0.6; x < canvas.width(); x += 1.2) {
    for (double y = 0.5; y < canvas.height(); y += 1.0) {
      const cv::Point2d hole(x + canvas.pick(-0.05, 0.05), y + canvas.pick(-0.05, 0.05));
      canvas.fill_disc(hole, 0.012, 0.12);
    }
  }
  canvas.add_marks(2);
}

void paint_carpet(Canvas& canvas) {
  canvas.add_noise_at_many_scales(2.0, 0.015, 0.8);
  canvas.add_noise(0.012, 0.03);
  canvas.add_noise(2 * canvas.texel(), 0.05);
  canvas.add_stains(static_cast<int>(1.5 * canvas.width() * canvas.height()), 0.3, 0.08);
  canvas.add_marks(7);
}

void paint_tiles(Canvas& canvas, double tone) {
  const double edge = canvas.pick(0.25, 0.45);
  for (double y = -canvas.pick(0, edge); y < canvas.height(); y += edge) {
    for (double x = -canvas.pick(0, edge); x < canvas.width(); x += edge) {
      canvas.fill_rectangle({x, y, edge, edge}, tone + canvas.pick(-0.09, 0.09));
      canvas.frame_rectangle({x, y, edge, edge}, 0.004, 0.55 * tone);
    }
  }
  canvas.add_noise_at_many_scales(0.8, 0.018, 0.95);
  canvas.add_stains(static_cast<int>(2 * canvas.width() * canvas.height()), 0.3, 0.09);
  canvas.add_marks(4);
}

// A curtain: folds from top to bottom and a woven pattern.
void paint_fabric(Canvas& canvas, double tone) {
  canvas.add_noise(0.25, 0.05, 20);
  canvas.add_noise(0.1, 0.06, 15);
  canvas.add_noise(0.03, 0.04, 5);
  const int threads = static_cast<int>(60 * canvas.width() * canvas.height());
  for (int i = 0; i < threads; ++i) {
    const cv::Point2d at = canvas.somewhere();
    const cv::Point2d along(canvas.pick(-0.004, 0.004), canvas.pick(0.02, 0.15));
    canvas.draw_line({at, at + along}, canvas.pick(0.003, 0.01), tone + canvas.pick(-0.25, 0.25));
  }
  canvas.add_noise_at_many_scales(0.1, 0.02, 1);
}

void paint_metal(Canvas& canvas, double tone) {
  canvas.add_noise(0.8, 0.015);
  canvas.add_noise(0.02, 0.008, 10);
  canvas.frame_rectangle({0, 0, canvas.width(), canvas.height()}, 0.008, 0.5 * tone);
  canvas.fill_rectangle({canvas.width() / 2, 0, 0.006, canvas.height()}, 0.35 * tone);
  for (const double x : {canvas.width() * 0.5 - 0.06, canvas.width() * 0.5 + 0.04}) {
    canvas.fill_rectangle({x, canvas.height() * 0.5, 0.02, 0.12}, 0.15);
  }
  for (int i = 0; i < 5; ++i) {
    canvas.fill_rectangle({canvas.width() * 0.12, 0.12 + 0.03 * i, canvas.width() * 0.25, 0.008},
                          0.3 * tone);
  }
  if (canvas.chance(0.7)) {
    const cv::Point2d at(canvas.width() * 0.6, canvas.height() * canvas.pick(0.2, 0.4));
    canvas.fill_rectangle({at.x, at.y, 0.14, 0.07}, 0.9);
    canvas.write(canvas.random_word(3, 5), at + cv::Point2d(0.01, 0.05), 0.03, 0.1);
  }
  canvas.add_marks(5);
}

void paint_asphalt(Canvas& canvas) {
  canvas.add_noise_at_many_scales(3.0, 0.02, 0.9);
  canvas.add_noise(2 * canvas.texel(), 0.05);
  const int area = static_cast<int>(canvas.width() * canvas.height());
  canvas.add_stains(area, 0.8, 0.09);
  for (int i = 0; i < area / 2; ++i) paint_crack(canvas);
  for (int i = 0; i < area / 12; ++i) {  // patches of repair, covers
    const cv::Point2d at = canvas.somewhere();
    if (canvas.chance(0.4)) {
      canvas.fill_disc(at, 0.32, 0.12);
      canvas.draw_ring(at, 0.32, 0.03, 0.35);
      canvas.write(canvas.random_word(2, 4), at - cv::Point2d(0.2, -0.05), 0.1, 0.35);
    } else {
      canvas.fill_rectangle({at.x, at.y, canvas.pick(0.4, 2), canvas.pick(0.4, 2)},
                            canvas.pick(0.12, 0.2));
    }
  }
  canvas.add_marks(2);
}

void paint_clouds(Canvas& canvas) { canvas.add_noise_at_many_scales(120, 0.06, 0.6); }

void paint_photographs(Canvas& canvas, const std::vector<cv::Mat>& photographs) {
  constexpr double kEdge = 1.6;  // m, of one photograph's part at most
  const int columns = static_cast<int>(std::ceil(canvas.width() / kEdge));
  const int rows = static_cast<int>(std::ceil(canvas.height() / kEdge));
  const cv::Size2d cell(canvas.width() / columns, canvas.height() / rows);
  for (int i = 0; i < rows * columns; ++i) {
    const cv::Mat& whole = photographs[canvas.random().index(static_cast<int>(photographs.size()))];
    const double aspect = cell.width / cell.height;
    const double fit = std::min<double>(whole.cols, whole.rows * aspect) * canvas.pick(0.6, 1);
    const cv::Size part(std::max(1, static_cast<int>(fit)),
                        std::clamp(static_cast<int>(fit / aspect), 1, whole.rows));
    const cv::Point corner(canvas.random().index(whole.cols - part.width + 1),
                           canvas.random().index(whole.rows - part.height + 1));
    canvas.paste(
        whole(cv::Rect(corner, part)),
        {(i % columns) * cell.width, (i / columns) * cell.height, cell.width, cell.height});
  }
}

bool takes_photographs(Surface surface) {
  switch (surface) {
    case Surface::kLamp:
    case Surface::kClouds:
    case Surface::kPlain:
    case Surface::kMetal:
    case Surface::kStripes:
      return false;
    default:
      return true;
  }
}

void paint(Canvas& canvas, const SurfacePaint& p) {
  switch (p.surface) {
    case Surface::kPlaster:
      return paint_plaster(canvas);
    case Surface::kBrick:
      return paint_bricks(canvas, p.tone);
    case Surface::kWood:
      return paint_wood(canvas, p.tone);
    case Surface::kConcrete:
      return paint_concrete(canvas);
    case Surface::kCarpet:
      return paint_carpet(canvas);
    case Surface::kTiles:
      return paint_tiles(canvas, p.tone);
    case Surface::kFabric:
      return paint_fabric(canvas, p.tone);
    case Surface::kMetal:
      return paint_metal(canvas, p.tone);
    case Surface::kPoster:
      return paint_poster(canvas, p.tone);
    case Surface::kPlayMat:
      return paint_play_mat(canvas, p.tone);
    case Surface::kBoard:
      return paint_board(canvas, p.tone);
    case Surface::kCardboard:
      return paint_cardboard(canvas, p.tone);
    case Surface::kBook:
      return paint_book(canvas, p.tone);
    case Surface::kStripes:
      return paint_stripes(canvas);
    case Surface::kAsphalt:
      return paint_asphalt(canvas);
    case Surface::kFacade:
      return paint_facade(canvas, p.tone);
    case Surface::kShop:
      return paint_shop(canvas, p.tone);
    case Surface::kClouds:
      return paint_clouds(canvas);
    case Surface::kLamp:
      return;
    case Surface::kPlain:
      return paint_plain(canvas);
  }
}

}  // namespace

cv::Mat paint_surface(const SurfacePaint& p, const std::vector<cv::Mat>& photographs) {
  Canvas canvas(p.size, p.texel, p.tone, p.seed);
  if (!photographs.empty() && takes_photographs(p.surface)) {
    paint_photographs(canvas, photographs);
  } else {
    paint(canvas, p);
  }
  return canvas.finish();
}

}  // namespace rover
