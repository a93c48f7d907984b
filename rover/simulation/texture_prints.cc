#include "rover/simulation/texture_prints.h"

#include <algorithm>
#include <cmath>

#include "rover/simulation/texture_canvas.h"

namespace rover {
namespace {

// A tone that stands out from another.
double ink_on(Canvas& canvas, double ground) {
  return ground > 0.4 ? canvas.pick(0.03, 0.25) : canvas.pick(0.7, 0.95);
}

void write_lines(Canvas& canvas, cv::Rect2d area, double letters, double ink) {
  for (double y = area.y + letters; y < area.br().y; y += 1.8 * letters) {
    double x = area.x;
    for (;;) {
      const std::string word = canvas.random_word();
      const double width = canvas.text_width(word, letters);
      if (x + width > area.br().x) break;
      canvas.write(word, {x, y}, letters, ink);
      x += width + 0.7 * letters;
    }
    if (canvas.chance(0.12)) y += 1.5 * letters;  // a paragraph ends
  }
}

void draw_checkers(Canvas& canvas, cv::Rect2d area) {
  const int columns = 4 + canvas.random().index(5);
  const double edge = area.width / columns;
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; (j + 1) * edge <= area.height; ++j) {
      canvas.fill_rectangle({area.x + i * edge, area.y + j * edge, edge, edge},
                            (i + j) % 2 ? 0.9 : 0.05);
    }
  }
}

// Triangles, discs, rings, bars in no order.
void draw_shapes(Canvas& canvas, cv::Rect2d area, int count) {
  const double size = std::min(area.width, area.height);
  const auto inside = [&] {
    return cv::Point2d(area.x + canvas.pick(0, area.width), area.y + canvas.pick(0, area.height));
  };
  for (int i = 0; i < count; ++i) {
    const double tone = canvas.pick(0.03, 0.95), extent = size * canvas.pick(0.04, 0.3);
    const cv::Point2d at = inside();
    switch (canvas.random().index(4)) {
      case 0:
        canvas.fill_disc(at, extent / 2, tone);
        break;
      case 1:
        canvas.draw_ring(at, extent / 2, extent / 8, tone);
        break;
      case 2:
        canvas.fill_rectangle({at.x, at.y, extent, extent * canvas.pick(0.3, 1.5)}, tone);
        break;
      default: {
        std::vector<cv::Point2d> corners;
        const int count_of_corners = 3 + canvas.random().index(4);
        for (int k = 0; k < count_of_corners; ++k) {
          corners.push_back(at + extent * cv::Point2d(canvas.pick(-1, 1), canvas.pick(-1, 1)));
        }
        canvas.fill_polygon(corners, tone);
      }
    }
  }
}

void write_title(Canvas& canvas, cv::Rect2d area, double ink) {
  const std::string word = canvas.random_word(3, 8);
  const double letters =
      std::min(0.7 * area.height, area.width / std::max(1e-3, canvas.text_width(word, 1)));
  canvas.write(word, {area.x, area.y + area.height}, letters, ink);
}

void draw_window(Canvas& canvas, cv::Rect2d area) {
  canvas.fill_rectangle(area, canvas.pick(0.05, 0.3));
  const double inner = area.width * 0.06;
  if (canvas.chance(0.6)) {  // curtains
    const double part = canvas.pick(0.15, 0.45) * area.width;
    const double tone = canvas.pick(0.35, 0.7);
    canvas.fill_rectangle({area.x, area.y, part, area.height}, tone);
    canvas.fill_rectangle({area.br().x - part, area.y, part, area.height}, tone);
  }
  if (canvas.chance(0.4)) {  // a blind
    canvas.fill_rectangle({area.x, area.y, area.width, canvas.pick(0.1, 0.8) * area.height}, 0.6);
  }
  const double frame = canvas.pick(0.6, 0.9);
  canvas.frame_rectangle(area, inner, frame);
  canvas.fill_rectangle({area.x + area.width / 2, area.y, inner / 2, area.height}, frame);
  canvas.fill_rectangle({area.x - inner, area.br().y, area.width + 2 * inner, inner}, 0.75);
}

}  // namespace

void paint_poster(Canvas& canvas, double tone) {
  const double w = canvas.width(), h = canvas.height(), margin = 0.06 * std::min(w, h);
  const double ground = canvas.chance(0.6) ? canvas.pick(0.7, 0.92) : canvas.pick(0.06, tone);
  canvas.fill_rectangle({0, 0, w, h}, ground);
  const double ink = ink_on(canvas, ground);
  write_title(canvas, {margin, margin, w - 2 * margin, 0.13 * h}, ink);
  const cv::Rect2d upper(margin, 0.2 * h, w - 2 * margin, 0.45 * h);
  if (canvas.chance(0.15)) {
    draw_checkers(canvas, upper);
  } else {
    canvas.fill_rectangle(upper, canvas.pick(0.15, 0.8));
    draw_shapes(canvas, upper, 12 + canvas.random().index(25));
  }
  const double letters = std::max(3.5 * canvas.texel(), h * canvas.pick(0.015, 0.04));
  write_lines(canvas, {margin, 0.7 * h, w - 2 * margin, 0.27 * h}, letters, ink);
  canvas.frame_rectangle({0, 0, w, h}, 0.006, 0.5 * ground);
  canvas.add_noise_at_many_scales(0.5 * std::min(w, h), 0.012, 0.9);
}

// Roads, houses and trees as children play on.
void paint_play_mat(Canvas& canvas, double tone) {
  const double w = canvas.width(), h = canvas.height(), size = std::min(w, h);
  canvas.fill_rectangle({0, 0, w, h}, tone);
  draw_shapes(canvas, {0, 0, w, h}, 30);
  for (int road = 0; road < 5; ++road) {
    std::vector<cv::Point2d> points;
    const double phase = canvas.pick(0, 6), bend = canvas.pick(2, 6), side = canvas.pick(0.1, 0.9);
    for (double s = 0; s <= 1.001; s += 0.02) {
      const double across = side + 0.15 * std::sin(phase + bend * s);
      points.push_back(road % 2 ? cv::Point2d(s * w, across * h) : cv::Point2d(across * w, s * h));
    }
    const double ground = canvas.pick(0.15, 0.3);
    canvas.draw_line(points, 0.1 * size, ground);
    for (std::size_t i = 0; i + 1 < points.size(); i += 2) {
      canvas.draw_line({points[i], points[i + 1]}, 0.008 * size, 0.85);
    }
  }
  for (int i = 0; i < 12; ++i)
    write_title(canvas, {canvas.pick(0, 0.8) * w, canvas.pick(0, 0.9) * h, 0.2 * w, 0.08 * h},
                ink_on(canvas, tone));
  draw_shapes(canvas, {0, 0, w, h}, 40);
  canvas.frame_rectangle({0, 0, w, h}, 0.02, 0.85);
  canvas.add_noise_at_many_scales(0.4, 0.015, 0.9);
}

void paint_board(Canvas& canvas, double tone) {
  const double w = canvas.width(), h = canvas.height();
  canvas.fill_rectangle({0, 0, w, h}, tone);
  canvas.add_noise(0.6, 0.015);
  const int papers = static_cast<int>(6 * w * h) + 2;
  for (int i = 0; i < papers; ++i) {
    const cv::Size2d size(canvas.pick(0.12, 0.32), canvas.pick(0.15, 0.32));
    const cv::Rect2d area(canvas.pick(0, std::max(0.01, w - size.width)),
                          canvas.pick(0, std::max(0.01, h - size.height)), size.width, size.height);
    const double paper = canvas.pick(0.55, 0.93);
    canvas.fill_rectangle(area, paper);
    const cv::Rect2d inner(area.x + 0.02, area.y + 0.02, area.width - 0.04, area.height - 0.04);
    if (canvas.chance(0.5)) {
      draw_shapes(canvas, inner, 8);
    } else {
      write_lines(canvas, inner, canvas.pick(4, 7) * canvas.texel(), canvas.pick(0.05, 0.3));
    }
    canvas.fill_disc({area.x + area.width / 2, area.y + 0.012}, 0.008, 0.05);
  }
  canvas.frame_rectangle({0, 0, w, h}, 0.025, 0.3);
}

void paint_cardboard(Canvas& canvas, double tone) {
  const double w = canvas.width(), h = canvas.height();
  canvas.add_noise(0.015, 0.012, 8);
  if (canvas.chance(0.8)) canvas.fill_rectangle({0, 0.45 * h, w, 0.05}, tone + 0.12);
  if (canvas.chance(0.8)) write_title(canvas, {0.1 * w, 0.1 * h, 0.7 * w, 0.2 * h}, 0.15 * tone);
  if (canvas.chance(0.7)) {
    const cv::Rect2d label(0.55 * w, 0.6 * h, 0.35 * w, 0.3 * h);
    canvas.fill_rectangle(label, 0.88);
    write_lines(canvas, {label.x + 0.01, label.y + 0.01, label.width - 0.02, label.height - 0.02},
                4 * canvas.texel(), 0.1);
  }
  draw_shapes(canvas, {0.05 * w, 0.55 * h, 0.4 * w, 0.4 * h}, 4);
  canvas.add_noise_at_many_scales(0.4, 0.018, 0.9);
  canvas.add_marks(5);
  canvas.frame_rectangle({0, 0, w, h}, 0.005, 0.6 * tone);
}

void paint_book(Canvas& canvas, double tone) {
  const double w = canvas.width(), h = canvas.height(), ink = ink_on(canvas, tone);
  for (int i = 0; i < 3; ++i) {
    canvas.fill_rectangle({0, canvas.pick(0, 0.95) * h, w, canvas.pick(0.01, 0.08) * h}, ink);
  }
  for (double y = canvas.pick(0.05, 0.2) * h; y < 0.9 * h; y += canvas.pick(0.08, 0.3) * h) {
    write_title(canvas, {0.15 * w, y, 0.7 * w, 0.12 * h}, ink);
  }
  canvas.add_noise_at_many_scales(0.1, 0.015, 1);
}

void paint_stripes(Canvas& canvas) {
  const double w = canvas.width(), h = canvas.height();
  canvas.fill_rectangle({0, 0, w, h}, 0.06);
  const int marks = static_cast<int>(250 * w * h);
  for (int i = 0; i < marks; ++i) {
    const cv::Point2d at = canvas.somewhere();
    const double angle = canvas.pick(0, CV_PI), length = canvas.pick(0.015, 0.05);
    const cv::Point2d along = length * cv::Point2d(std::cos(angle), std::sin(angle));
    canvas.draw_line({at, at + along}, canvas.pick(0.012, 0.03), canvas.pick(0.6, 0.95));
  }
}

void paint_facade(Canvas& canvas, double tone) {
  canvas.add_noise_at_many_scales(2, 0.03, 0.85);
  canvas.add_stains(static_cast<int>(canvas.width() * canvas.height() / 2), 0.9, 0.1);
  const double step = canvas.pick(1.7, 2.6), storey = canvas.pick(2.6, 3.2);
  const double width = step * canvas.pick(0.4, 0.65), height = storey * canvas.pick(0.45, 0.62);
  for (double y = 0.6; y + height < canvas.height(); y += storey) {
    for (double x = 0.4; x + width < canvas.width(); x += step) {
      if (canvas.chance(0.93)) draw_window(canvas, {x, y, width, height});
    }
    canvas.fill_rectangle({0, y + storey - 0.45, canvas.width(), 0.08}, tone + 0.15);
  }
  canvas.add_noise_at_many_scales(0.1, 0.02, 0.9);
  canvas.add_marks(0.5);
}

void paint_shop(Canvas& canvas, double tone) {
  const double w = canvas.width(), h = canvas.height(), sign = canvas.pick(0.1, 0.9);
  canvas.add_noise_at_many_scales(1, 0.03, 0.85);
  canvas.fill_rectangle({0.1, 0.15, w - 0.2, 0.7}, sign);
  write_title(canvas, {0.3, 0.25, w - 0.6, 0.45}, ink_on(canvas, sign));
  const cv::Rect2d pane(0.15, 1.0, 0.68 * w, h - 1.4);
  canvas.fill_rectangle(pane, canvas.pick(0.06, 0.2));
  draw_shapes(canvas, pane, 30);
  write_lines(canvas, {pane.x, pane.y + 0.1, pane.width, 0.5}, 0.1, canvas.pick(0.6, 0.9));
  canvas.frame_rectangle(pane, 0.06, tone + 0.2);
  const cv::Rect2d door(0.76 * w, 0.95, 0.2 * w, h - 0.95);
  canvas.fill_rectangle(door, canvas.pick(0.1, 0.5));
  canvas.frame_rectangle(door, 0.07, canvas.pick(0.5, 0.8));
  canvas.fill_disc({door.x + 0.12, door.y + 0.55 * door.height}, 0.04, 0.9);
  canvas.add_noise_at_many_scales(0.2, 0.015, 0.9);
  canvas.add_marks(3);
}

}  // namespace rover
