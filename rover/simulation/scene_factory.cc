#include "rover/simulation/scene_factory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "rover/base/error.h"
#include "rover/base/thread_pool.h"
#include "rover/simulation/scene_furniture.h"
#include "rover/simulation/texture_photographs.h"

namespace rover {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// A hollow box with the numbers that make it a room or a hall.
struct Interior {
  Vector3d min, max;
  int furniture = 16;  // pieces along the walls
  int middle = 4;      // low pieces anywhere
  int pillars = 0;
  double lamp_spacing = 3;      // m
  double light_spacing = 0.07;  // m between nodes of the baked light
  double texel = 0.0025;        // m
};

double yaw_into(const Vector3d& front) { return std::atan2(front.y(), front.x()) + M_PI / 2; }

SE3 standing(const Vector3d& at, double yaw) { return {so3_exp(Vector3d(0, 0, yaw)), at}; }

Plane wall_between(const Vector2d& left, const Vector2d& right, double floor, double ceiling) {
  Plane wall;
  const Vector2d along = right - left;
  wall.corner = {left.x(), left.y(), ceiling};
  wall.right = Vector3d(along.x(), along.y(), 0).normalized();
  wall.down = {0, 0, -1};
  wall.width = along.norm();
  wall.height = ceiling - floor;
  return wall;
}

// The inner sides of a box's four walls.
std::array<Plane, 4> walls_of(const Vector3d& min, const Vector3d& max) {
  const Vector2d a(min.x(), min.y()), b(max.x(), min.y()), c(max.x(), max.y()), d(min.x(), max.y());
  return {wall_between(b, a, min.z(), max.z()), wall_between(c, b, min.z(), max.z()),
          wall_between(d, c, min.z(), max.z()), wall_between(a, d, min.z(), max.z())};
}

Plane floor_of(const Vector3d& min, const Vector3d& max) {
  return {{min.x(), max.y(), min.z()}, {1, 0, 0}, {0, -1, 0}, max.x() - min.x(), max.y() - min.y()};
}

Plane ceiling_of(const Vector3d& min, const Vector3d& max) {
  return {{min.x(), min.y(), max.z()}, {1, 0, 0}, {0, 1, 0}, max.x() - min.x(), max.y() - min.y()};
}

Surface any_wall(SceneBuilder& builder) {
  constexpr std::array kWalls = {Surface::kPlaster,  Surface::kBrick,   Surface::kWood,
                                 Surface::kConcrete, Surface::kPlaster, Surface::kFabric};
  return kWalls[builder.random().index(static_cast<int>(kWalls.size()))];
}

Surface any_floor(SceneBuilder& builder) {
  constexpr std::array kFloors = {Surface::kCarpet, Surface::kTiles, Surface::kWood};
  return kFloors[builder.random().index(static_cast<int>(kFloors.size()))];
}

// Lamps over a ceiling in a grid, each with its bright panel.
void add_ceiling_lamps(SceneBuilder& builder, const Plane& ceiling, double spacing, double height) {
  const int columns = std::max(2, static_cast<int>(ceiling.width / spacing));
  const int rows = std::max(2, static_cast<int>(ceiling.height / spacing));
  for (int i = 0; i < rows * columns; ++i) {
    const double x = (i % columns + 0.5) * ceiling.width / columns;
    const double y = (i / columns + 0.5) * ceiling.height / rows;
    builder.hang(ceiling, x - 0.6, y - 0.15, {1.2, 0.3}, Surface::kLamp, 1, 0, 3);
    builder.add_lamp(ceiling.at(x, y) + Vector3d(0, 0, -0.1 * height), 0.4 * height * height);
  }
}

void furnish_along(SceneBuilder& builder, const std::array<Plane, 4>& walls, int pieces) {
  for (int i = 0, tries = 0; i < pieces && tries < 20 * pieces; ++tries) {
    const Plane& wall = walls[builder.random().index(4)];
    if (wall.width < 3) continue;
    const Vector3d at = wall.at(builder.pick(1.1, wall.width - 1.1), wall.height);
    if (add_any_furniture(builder, standing(at + 0.03 * wall.front(), yaw_into(wall.front())))) ++i;
  }
}

void furnish_middle(SceneBuilder& builder, const Interior& room) {
  for (int i = 0, tries = 0; i < room.middle && tries < 20 * room.middle; ++tries) {
    const Vector3d at(builder.pick(room.min.x() + 1, room.max.x() - 1),
                      builder.pick(room.min.y() + 1, room.max.y() - 1), room.min.z());
    const SE3 frame = standing(at, builder.pick(0, 2 * M_PI));
    if (builder.random().index(2) ? add_crates(builder, frame) : add_stand(builder, frame)) ++i;
  }
  for (int i = 0; i < room.pillars; ++i) {
    const Vector3d at(builder.pick(room.min.x() + 2, room.max.x() - 2),
                      builder.pick(room.min.y() + 2, room.max.y() - 2), room.min.z());
    const double height = room.max.z() - room.min.z();
    if (!builder.take(standing(at, 0), {-0.4, -0.4, 0}, {0.4, 0.4, height})) continue;
    builder.add_pillar(at, 0.4, height, 10, any_wall(builder), builder.pick(0.4, 0.7));
  }
}

void build_interior(SceneBuilder& builder, const Interior& room) {
  const auto walls = walls_of(room.min, room.max);
  const Plane floor = floor_of(room.min, room.max), ceiling = ceiling_of(room.min, room.max);
  builder.add_plane(floor, any_floor(builder), builder.pick(0.3, 0.5));
  builder.add_plane(ceiling, Surface::kPlaster, 0.75);
  for (const Plane& wall : walls)
    builder.add_plane(wall, any_wall(builder), builder.pick(0.45, 0.75));
  add_ceiling_lamps(builder, ceiling, room.lamp_spacing, room.max.z() - room.min.z());
  const double density = builder.plain() ? 0.04 : 0.9;
  for (const Plane& wall : walls) decorate_wall(builder, wall, density);
  decorate_floor(builder, floor, builder.plain() ? 0.05 : 0.8);
  furnish_along(builder, walls, builder.plain() ? room.furniture / 3 : room.furniture);
  furnish_middle(builder, room);
}

FlightVolume volume_inside(const Interior& room, double side, double below, double above) {
  FlightVolume volume;
  volume.min = room.min + Vector3d(side, side, below);
  volume.max = room.max - Vector3d(side, side, above);
  return volume;
}

// The box is free of all, and things in the middle stay well below.
void keep_volume_free(SceneBuilder& builder, const FlightVolume& volume) {
  builder.scene().flight_volume = volume;
  builder.keep_free().min = volume.min - Vector3d::Constant(0.35);
  builder.keep_free().max = volume.max + Vector3d::Constant(0.35);
}

Interior interior_around(const std::vector<Vector3d>& flight, bool hall) {
  Vector3d low = flight.front(), high = flight.front();
  for (const Vector3d& p : flight) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double side = hall ? 4.0 : 2.2;
  Interior room;
  room.min = low - Vector3d(side, side, 0.5);
  room.max = high + Vector3d(side, side, hall ? 3.0 : 1.3);
  room.max.z() = std::max(room.max.z(), room.min.z() + (hall ? 6.0 : 3.5));
  return room;
}

Interior interior_of(const SceneOptions& options) {
  const bool hall = options.kind == SceneKind::kHall;
  Interior room;
  if (!options.around.empty()) {
    room = interior_around(options.around, hall);
  } else {
    room.min = Vector3d::Zero();
    room.max = hall ? Vector3d(24, 16, 7) : Vector3d(8, 6, 3.5);
  }
  const double area = (room.max - room.min).head<2>().prod();
  if (hall) {
    room.pillars = static_cast<int>(area / 40);
    room.lamp_spacing = 5;
    room.light_spacing = 0.15;
    room.texel = 0.004;
  }
  room.furniture = static_cast<int>(hall ? area / 9 : area / 3);
  room.middle = static_cast<int>(hall ? area / 14 : area / 7);
  return room;
}

void add_objects_in(SceneBuilder& builder, const Interior& room, int count) {
  for (int i = 0; i < count; ++i) {
    const double circle = builder.pick(0.4, 1.2);
    const Vector3d at(builder.pick(room.min.x() + 1.5, room.max.x() - 1.5),
                      builder.pick(room.min.y() + 1.5, room.max.y() - 1.5), room.min.z());
    builder.add_moving_object(at, circle, builder.pick(0.3, 1));
  }
}

void build_room_or_hall(SceneBuilder& builder, const SceneOptions& options, const Interior& room) {
  if (options.around.empty()) {
    const bool hall = options.kind == SceneKind::kHall;
    keep_volume_free(builder,
                     hall ? volume_inside(room, 3, 1.2, 2.5) : volume_inside(room, 1.6, 0.9, 1.0));
  } else {
    builder.keep_free().path = options.around;
    builder.keep_free().radius = 0.55;
    builder.scene().flight_volume = volume_inside(room, 0.5, 0.3, 0.5);
  }
  build_interior(builder, room);
  add_objects_in(builder, room, options.moving_objects);
}

void add_doors(SceneBuilder& builder, const Plane& wall) {
  for (double x = builder.pick(0.5, 3); x + 1 < wall.width; x += builder.pick(3, 6)) {
    builder.hang(wall, x, wall.height - 2.05, {0.95, 2.05},
                 builder.random().index(2) ? Surface::kWood : Surface::kMetal,
                 builder.pick(0.3, 0.7));
    builder.hang(wall, x + 1.05, wall.height - 1.7, {0.2, 0.15}, Surface::kPoster, 0.8);
  }
}

// Walls of one side of the corridor in sections of their own look.
void build_corridor_wall(SceneBuilder& builder, const Plane& wall) {
  const int sections = std::max(1, static_cast<int>(wall.width / 4));
  const double width = wall.width / sections;
  for (int i = 0; i < sections; ++i) {
    Plane part = wall;
    part.corner = wall.at(i * width, 0);
    part.width = width;
    builder.add_plane(part, any_wall(builder), builder.pick(0.4, 0.75));
  }
  add_doors(builder, wall);
  decorate_wall(builder, wall, builder.plain() ? 0.05 : 0.8);
}

void build_corridor(SceneBuilder& builder, const SceneOptions& options) {
  constexpr double kLength = 24, kDepth = 16, kWidth = 2.6, kHeight = 2.9;
  const Vector3d min(0, 0, 0), max(kLength, kDepth, kHeight);
  const Vector3d inner_min(kWidth, kWidth, 0),
      inner_max(kLength - kWidth, kDepth - kWidth, kHeight);
  FlightVolume volume;
  const double mid = kWidth / 2;
  volume.min = {0.7, 0.7, 1.1};
  volume.max = {kLength - 0.7, kDepth - 0.7, 1.9};
  volume.path = {{mid, mid, 1.5},
                 {kLength - mid, mid, 1.5},
                 {kLength - mid, kDepth - mid, 1.5},
                 {mid, kDepth - mid, 1.5}};
  volume.closed = true;
  volume.path_radius = 0.4;
  builder.scene().flight_volume = volume;
  builder.add_plane(floor_of(min, max), any_floor(builder), 0.4, 4);
  builder.add_plane(ceiling_of(min, max), Surface::kPlaster, 0.75, 4);
  constexpr std::size_t kSecondLeg = 1;  // of the walls: at the largest x
  for (std::size_t i = 0; i < 4; ++i) {
    Plane inner = walls_of(inner_min, inner_max)[i];  // seen from outside the block
    inner.corner += inner.width * inner.right;
    inner.right = -inner.right;
    builder.set_plain(options.low_texture || (options.plain_leg && i == kSecondLeg));
    build_corridor_wall(builder, walls_of(min, max)[i]);
    build_corridor_wall(builder, inner);
  }
  builder.set_plain(options.low_texture);
  const Plane ceiling = ceiling_of(min, max);
  const auto lamp = [&](double x, double y) {
    builder.hang(ceiling, x - 0.5, y - 0.12, {1, 0.24}, Surface::kLamp, 1, 0, 3);
    builder.add_lamp(ceiling.at(x, y) + Vector3d(0, 0, -0.3), 2.4);
  };
  for (double x = mid; x < kLength; x += 3.6) lamp(x, mid), lamp(x, kDepth - mid);
  for (double y = mid + 3.2; y < kDepth - mid - 1; y += 3.2) lamp(mid, y), lamp(kLength - mid, y);
  const auto walls = walls_of(min, max);
  builder.keep_free().min = {mid - 0.6, mid - 0.6, 0};
  builder.keep_free().max = {kLength - mid + 0.6, kDepth - mid + 0.6, kHeight};
  furnish_along(builder, walls, 26);
  for (int i = 0; i < options.moving_objects; ++i) {
    builder.add_moving_object({builder.pick(3, kLength - 3), i % 2 ? mid : kDepth - mid, 0}, 0.5,
                              builder.pick(0.2, 0.6));
  }
}

// Houses along one side, from `from` on to the right as seen from the road.
void build_houses(SceneBuilder& builder, Vector2d from, const Vector2d& along, double length) {
  for (double at = 0; at < length;) {
    const double width = std::min(builder.pick(7, 13), length - at);
    const double height = builder.pick(8, 13), depth = builder.pick(0, 0.8);
    const Vector2d back(-along.y(), along.x());
    const Vector2d left = from + at * along + depth * back, right = left + width * along;
    const Plane upper = wall_between(left, right, 3.2, height);
    const Plane lower = wall_between(left, right, 0, 3.2);
    const double tone = builder.pick(0.3, 0.75);
    builder.add_plane(upper, builder.random().index(4) ? Surface::kFacade : Surface::kBrick, tone,
                      10);
    builder.add_plane(lower, Surface::kShop, tone, 5);
    decorate_wall(builder, lower, 0.1);
    const Vector2d far = 3 * back;
    builder.add_plane(wall_between(left + far, left, 0, height), Surface::kBrick, tone);
    builder.add_plane(wall_between(right, right + far, 0, height), Surface::kBrick, tone);
    at += width;
  }
}

void add_sky(SceneBuilder& builder, const Vector3d& min, const Vector3d& max) {
  std::vector<Plane> sides = {ceiling_of(min, max)};
  for (const Plane& wall : walls_of(min, max)) sides.push_back(wall);
  for (const Plane& side : sides) {
    Patch patch;
    patch.origin = side.corner.cast<float>();
    patch.edge_u = (side.width * side.right).cast<float>();
    patch.edge_v = (side.height * side.down).cast<float>();
    patch.emission = 0.35F;
    patch.casts_shadow = false;
    builder.add_patch(patch, Surface::kClouds, 0.7, 1);
  }
}

void furnish_street(SceneBuilder& builder, double length, double half_width) {
  for (const double side : {-1.0, 1.0}) {
    const double yaw = side > 0 ? 0 : M_PI;
    for (double x = 6; x < length - 6; x += builder.pick(5, 9)) {
      add_car(builder, standing({x, side * (half_width - 2.2), 0}, yaw));
    }
    for (double x = 3; x < length; x += builder.pick(4, 9)) {
      const Vector3d at(x, side * (half_width - 0.9), 0.12);
      const SE3 frame = standing(at, yaw + builder.pick(-0.3, 0.3));
      switch (builder.random().index(4)) {
        case 0:
          add_tree(builder, frame);
          break;
        case 1:
          add_stand(builder, frame);
          break;
        case 2:
          add_crates(builder, frame);
          break;
        default:
          builder.add_pillar(at, 0.07, 5, 6, Surface::kMetal, 0.3);
      }
    }
  }
}

void build_street(SceneBuilder& builder, const SceneOptions& options) {
  constexpr double kLength = 110, kHalf = 8;
  FlightVolume volume;
  volume.min = {4, -2.5, 1.0};
  volume.max = {kLength - 6, 2.5, 3.0};
  volume.path = {{6, 0, 1.8}, {kLength - 8, 0, 1.8}};
  volume.path_radius = 1.6;
  keep_volume_free(builder, volume);
  builder.scene().ambient = 0.5F;
  const Vector3d low(-4, -kHalf - 1, 0), high(kLength + 4, kHalf + 1, 0);
  builder.add_plane(floor_of(low, high), Surface::kAsphalt, 0.25, 6);
  for (const double y : {-kHalf - 1, kHalf - 1.8}) {
    builder.add_box(SE3(), {-4, y, 0}, {kLength + 4, y + 2.8, 0.12}, Surface::kConcrete,
                    Surface::kTiles, 0.5);
  }
  const Plane road = floor_of({0, -4, 0}, {kLength, 4, 0});
  for (double x = 1; x < kLength - 3; x += 6) {
    builder.hang(road, x, 3.94, {3, 0.12}, Surface::kPlaster, 0.8);
  }
  build_houses(builder, {-4, kHalf}, {1, 0}, kLength + 8);
  build_houses(builder, {kLength + 4, -kHalf}, {-1, 0}, kLength + 8);
  build_houses(builder, {-4, -kHalf}, {0, 1}, 2 * kHalf);
  build_houses(builder, {kLength + 4, kHalf}, {0, -1}, 2 * kHalf);
  furnish_street(builder, kLength, kHalf);
  add_sky(builder, {-150, -150, -5}, {kLength + 150, 150, 120});
  builder.add_lamp({30, -60, 90}, 1.2 * (60 * 60 + 90 * 90), 1.5);
  for (int i = 0; i < options.moving_objects; ++i) {
    builder.add_moving_object({builder.pick(8, kLength - 8), builder.pick(-3, 3), 0},
                              builder.pick(0.6, 2), builder.pick(0.5, 1.5));
  }
}

SceneBuilder make_builder(const SceneOptions& options, double texel) {
  return {hash_seed(options.seed, 4), texel, options.low_texture};
}

}  // namespace

SceneKind parse_scene_kind(const std::string& name) {
  if (name == "room") return SceneKind::kRoom;
  if (name == "hall") return SceneKind::kHall;
  if (name == "corridor") return SceneKind::kCorridor;
  if (name == "street") return SceneKind::kStreet;
  throw InputError("--scene '{}' is not known; use room, hall, corridor or street", name);
}

bool parse_low_texture(const std::string& name) {
  require(name == "rich" || name == "low", "--texture '{}' is not known; use rich or low", name);
  return name == "low";
}

void SceneOptions::check() const {
  require(moving_objects >= 0 && moving_objects <= 100,
          "--moving-objects {}: must lie between 0 and 100", moving_objects);
  require(around.empty() || kind == SceneKind::kRoom || kind == SceneKind::kHall,
          "a real flight can be flown in a room or a hall only; choose --scene room or hall");
}

Scene make_scene(const SceneOptions& options, ThreadPool& pool) {
  options.check();
  std::vector<cv::Mat> photographs;
  if (options.photographs) photographs = read_photographs(*options.photographs);
  if (options.kind == SceneKind::kCorridor) {
    SceneBuilder builder = make_builder(options, 0.003);
    build_corridor(builder, options);
    return builder.finish(photographs, 0.1, 2, pool);
  }
  if (options.kind == SceneKind::kStreet) {
    SceneBuilder builder = make_builder(options, 0.006);
    build_street(builder, options);
    return builder.finish(photographs, 0.25, 30, pool);
  }
  const Interior room = interior_of(options);
  SceneBuilder builder = make_builder(options, room.texel);
  build_room_or_hall(builder, options, room);
  return builder.finish(photographs, room.light_spacing, 2, pool);
}

}  // namespace rover
