#include "rover/simulation/scene_furniture.h"

#include <algorithm>
#include <array>
#include <numbers>

namespace rover {
namespace {

using Eigen::Vector3d;

SE3 turned(SceneBuilder& builder, const SE3& frame, const Vector3d& at, double most) {
  return frame * SE3(so3_exp(Vector3d(0, 0, builder.pick(-most, most))), at);
}

void add_books(SceneBuilder& builder, const SE3& frame, double left, double right, double floor,
               double tallest) {
  for (double x = left; x < right - 0.06;) {
    const double width = builder.pick(0.02, 0.055);
    const double height = tallest * builder.pick(0.6, 0.95);
    const double front = builder.pick(-0.3, -0.24);
    builder.add_box(frame, {x, front, floor}, {x + width, -0.02, floor + height}, Surface::kBook,
                    Surface::kPlain, builder.pick(0.05, 0.9));
    x += width + (builder.random().index(6) == 0 ? 0.12 : 0.002);
  }
}

// Small things on a table or cabinet.
void add_clutter(SceneBuilder& builder, const SE3& frame, const Vector3d& min, const Vector3d& max,
                 int count) {
  for (int i = 0; i < count; ++i) {
    const Vector3d size(builder.pick(0.06, 0.3), builder.pick(0.06, 0.25), builder.pick(0.04, 0.3));
    const Vector3d at(builder.pick(min.x() + 0.15, max.x() - 0.15),
                      builder.pick(min.y() + 0.15, max.y() - 0.15), max.z());
    const SE3 place = turned(builder, frame, at, 0.8);
    builder.add_box(place, {-size.x() / 2, -size.y() / 2, 0},
                    {size.x() / 2, size.y() / 2, size.z()},
                    builder.random().index(3) ? Surface::kCardboard : Surface::kPoster,
                    Surface::kCardboard, builder.pick(0.2, 0.8));
  }
}

Surface any_cover(SceneBuilder& builder) {
  constexpr std::array kCovers = {Surface::kPoster,  Surface::kPoster, Surface::kBoard,
                                  Surface::kPlayMat, Surface::kWood,   Surface::kFabric};
  return kCovers[builder.random().index(static_cast<int>(kCovers.size()))];
}

}  // namespace

bool add_cabinet(SceneBuilder& builder, const SE3& frame) {
  const Vector3d min(-0.5, -0.45, 0), max(0.5, 0, builder.pick(0.9, 2.0));
  if (!builder.take(frame, min, max)) return false;
  builder.add_box(frame, min, max, Surface::kMetal, Surface::kMetal, builder.pick(0.3, 0.75));
  add_clutter(builder, frame, min, max, 4);
  return true;
}

bool add_bookshelf(SceneBuilder& builder, const SE3& frame) {
  const double height = builder.pick(1.2, 2.1), width = builder.pick(0.8, 1.3), tone = 0.5;
  if (!builder.take(frame, {-width / 2, -0.32, 0}, {width / 2, 0, height})) return false;
  const double left = -width / 2, right = width / 2, board = 0.025;
  builder.add_box(frame, {left - board, -0.32, 0}, {left, 0, height}, Surface::kWood,
                  Surface::kWood, tone);
  builder.add_box(frame, {right, -0.32, 0}, {right + board, 0, height}, Surface::kWood,
                  Surface::kWood, tone);
  builder.add_box(frame, {left, -0.02, 0}, {right, 0, height}, Surface::kWood, Surface::kWood, 0.3);
  for (double z = 0.05; z < height; z += 0.38) {
    builder.add_box(frame, {left, -0.32, z}, {right, -0.02, z + board}, Surface::kWood,
                    Surface::kWood, tone);
    if (z + 0.38 < height) add_books(builder, frame, left, right, z + board, 0.34);
  }
  return true;
}

bool add_table(SceneBuilder& builder, const SE3& frame) {
  const double width = builder.pick(1.2, 1.8), height = builder.pick(0.65, 0.78);
  const Vector3d min(-width / 2, -0.75, height - 0.04), max(width / 2, 0, height);
  if (!builder.take(frame, {min.x(), min.y(), 0}, {max.x(), max.y(), height + 0.3})) return false;
  builder.add_box(frame, min, max, Surface::kWood, Surface::kWood, builder.pick(0.3, 0.7));
  for (const double x : {min.x() + 0.05, max.x() - 0.1}) {
    for (const double y : {-0.7, -0.1}) {
      builder.add_box(frame, {x, y, 0}, {x + 0.05, y + 0.05, height - 0.04}, Surface::kMetal,
                      Surface::kMetal, 0.3);
    }
  }
  add_clutter(builder, frame, min, max, 8);
  return true;
}

bool add_crates(SceneBuilder& builder, const SE3& frame) {
  const double base = builder.pick(0.35, 0.6), height = builder.pick(0.3, 0.5);
  const int storeys = 1 + builder.random().index(3);
  if (!builder.take(frame, {-base, -base - 0.1, 0}, {base, 0.1, storeys * height})) return false;
  for (int i = 0; i < storeys; ++i) {
    const double half = base * builder.pick(0.7, 0.95) * (1 - 0.08 * i);
    const SE3 place = turned(builder, frame, {0, -base / 2, i * height}, 0.2);
    builder.add_box(place, {-half, -base / 2, 0}, {half, base / 2, height}, Surface::kCardboard,
                    Surface::kCardboard, builder.pick(0.35, 0.75));
  }
  return true;
}

bool add_mattress(SceneBuilder& builder, const SE3& frame) {
  const Vector3d min(-1, -0.35, 0), max(1, 0, builder.pick(0.8, 1.4));
  if (!builder.take(frame, min, max)) return false;
  const double tone = builder.pick(0.3, 0.6);
  builder.add_box(frame, {-1, -0.18, 0}, max, Surface::kFabric, Surface::kFabric, tone);
  builder.add_box(frame, min, {1, -0.18, 0.25}, Surface::kFabric, Surface::kFabric, tone + 0.1);
  return true;
}

bool add_stand(SceneBuilder& builder, const SE3& frame) {
  const double width = builder.pick(0.6, 1.1), height = builder.pick(1.2, 1.8);
  if (!builder.take(frame, {-width / 2, -0.2, 0}, {width / 2, 0.2, height})) return false;
  builder.add_box(frame, {-width / 2, -0.02, 0.35}, {width / 2, 0.02, height}, Surface::kPoster,
                  Surface::kMetal, 0.7);
  builder.add_box(frame, {-0.04, -0.02, 0}, {0.04, 0.02, 0.35}, Surface::kMetal, Surface::kMetal,
                  0.25);
  builder.add_box(frame, {-0.3, -0.2, 0}, {0.3, 0.2, 0.03}, Surface::kMetal, Surface::kMetal, 0.25);
  return true;
}

bool add_car(SceneBuilder& builder, const SE3& frame) {
  if (!builder.take(frame, {-2.2, -1.8, 0}, {2.2, 0, 1.5})) return false;
  const double tone = builder.pick(0.08, 0.75);
  builder.add_box(frame, {-2.1, -1.75, 0.3}, {2.1, -0.05, 0.85}, Surface::kMetal, Surface::kMetal,
                  tone);
  builder.add_box(frame, {-1.3, -1.6, 0.85}, {1.2, -0.2, 1.45}, Surface::kMetal, Surface::kMetal,
                  0.12);
  for (const double x : {-1.6, 1.05}) {
    builder.add_box(frame, {x, -1.78, 0}, {x + 0.6, -0.02, 0.6}, Surface::kCardboard,
                    Surface::kPlain, 0.08);
  }
  return true;
}

bool add_tree(SceneBuilder& builder, const SE3& frame) {
  if (!builder.take(frame, {-0.3, -0.3, 0}, {0.3, 0.3, 4})) return false;
  builder.add_pillar(frame.translation, 0.16, 3, 8, Surface::kWood, 0.3);
  for (int i = 0; i < 60; ++i) {  // leaves in clumps
    const Vector3d at(builder.pick(-1.1, 1.1), builder.pick(-1.1, 1.1), builder.pick(2.4, 4.6));
    const double half = builder.pick(0.15, 0.35);
    const SE3 place = turned(builder, frame, at, std::numbers::pi);
    builder.add_box(place, {-half, -half, 0.001}, {half, half, half}, Surface::kFabric,
                    Surface::kFabric, builder.pick(0.12, 0.4));
  }
  return true;
}

bool add_any_furniture(SceneBuilder& builder, const SE3& frame) {
  switch (builder.random().index(6)) {
    case 0:
      return add_cabinet(builder, frame);
    case 1:
      return add_bookshelf(builder, frame);
    case 2:
      return add_table(builder, frame);
    case 3:
      return add_mattress(builder, frame);
    case 4:
      return add_stand(builder, frame);
    default:
      return add_crates(builder, frame);
  }
}

void decorate_wall(SceneBuilder& builder, const Plane& wall, double density) {
  std::vector<cv::Rect2d> hung;
  const int wanted = static_cast<int>(density * wall.width * wall.height);
  for (int i = 0; i < wanted; ++i) {
    const double width = builder.pick(0.25, 1.1), height = width * builder.pick(0.7, 1.5);
    if (width + 0.1 > wall.width || height + 0.1 > wall.height) continue;
    const cv::Rect2d area(builder.pick(0.05, wall.width - width - 0.05),
                          builder.pick(0.05, wall.height - height - 0.05), width, height);
    const bool free = std::none_of(hung.begin(), hung.end(), [&](const cv::Rect2d& other) {
      return (other & area).area() > 0;
    });
    if (!free) continue;
    hung.push_back(area);
    builder.hang(wall, area.x, area.y, area.size(), any_cover(builder), builder.pick(0.3, 0.9));
  }
}

void decorate_floor(SceneBuilder& builder, const Plane& floor, double density) {
  const int count = static_cast<int>(density * floor.width * floor.height);
  for (int i = 0; i < count; ++i) {
    const bool mat = builder.random().index(4) == 0;
    const bool tape = !mat && builder.random().index(2) == 0;
    const cv::Size2d size = mat    ? cv::Size2d(builder.pick(0.9, 1.8), builder.pick(0.7, 1.3))
                            : tape ? cv::Size2d(builder.pick(0.6, 2.2), 0.13)
                                   : cv::Size2d(builder.pick(0.15, 0.4), builder.pick(0.15, 0.4));
    const double reach = std::hypot(size.width, size.height);
    if (2 * reach > std::min(floor.width, floor.height)) continue;
    builder.hang(floor, builder.pick(reach, floor.width - reach),
                 builder.pick(reach, floor.height - reach), size,
                 mat    ? Surface::kPlayMat
                 : tape ? Surface::kStripes
                        : Surface::kPoster,
                 builder.pick(0.4, 0.7), builder.pick(0, 2 * std::numbers::pi));
  }
}

}  // namespace rover
