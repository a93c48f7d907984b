#pragma once

#include <array>
#include <string>

#include <Eigen/Geometry>

#include "rover/datasets/trajectory.h"

namespace rover {

// A view of the world along one of its axes: which axes go right and up, what part is seen, and
// where on the page it lies.
struct PlanView {
  int right = 0;
  int up = 1;
  Eigen::Vector2d low, high;  // m
  double pixels_per_metre = 1;
  double left = 0, top = 0;  // px, of the inside

  double width() const { return (high.x() - low.x()) * pixels_per_metre; }
  double height() const { return (high.y() - low.y()) * pixels_per_metre; }
  double bottom() const { return top + height(); }
  double page_x(const Eigen::Vector3d& point) const { return page_right(point[right]); }
  double page_y(const Eigen::Vector3d& point) const { return page_up(point[up]); }
  double page_right(double metres) const { return left + (metres - low.x()) * pixels_per_metre; }
  double page_up(double metres) const { return bottom() - (metres - low.y()) * pixels_per_metre; }
};

// The same piece of the world seen along the axis of its least extent ("from above"), and from the
// side, one below the other at one scale.
struct PlanViews {
  PlanView above, side;
  double height = 0;  // px, of both with their axes
};

struct PlanLayout {
  double width = 900;       // px, of the drawing
  double margin = 64;       // px, left and right of a view, for its axes
  double max_height = 640;  // px, of the inside of one view
  double min_height = 90;
  double top = 24;    // px, free above each view
  double legend = 0;  // px, above all
};

// A box around positions with some air; never without extent.
Eigen::AlignedBox3d box_around(const Eigen::AlignedBox3d& positions);

PlanViews lay_out(const Eigen::AlignedBox3d& box, const PlanLayout& layout = {});

// Grid lines with numbers in metres, below everything else.
std::string draw_grid(const PlanView& view);
// The frame with names of the axes and a title, above everything else.
std::string draw_frame(const PlanView& view, const std::string& title);
// A line that breaks where poses are missing for more than a second, and finer than a pixel needs
// no more than that.
std::string draw_path(const PlanView& view, const Trajectory& trajectory, const char* color,
                      double width);
// A circle where it begins.
std::string draw_start(const PlanView& view, const Trajectory& trajectory, const char* color);

}  // namespace rover
