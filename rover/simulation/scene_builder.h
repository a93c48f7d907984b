#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "rover/base/random.h"
#include "rover/simulation/scene.h"
#include "rover/simulation/texture_surfaces.h"

namespace rover {

class ThreadPool;

// Where no furniture may stand: a box, and all that is nearer than `radius` to a flown path.
struct KeepFree {
  Eigen::Vector3d min = Eigen::Vector3d::Zero();  // empty box if not below max
  Eigen::Vector3d max = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> path;
  double radius = 0.5;  // m

  bool allows(const Eigen::Vector3d& box_min, const Eigen::Vector3d& box_max) const;
};

// A wall, floor or ceiling to put things on: seen from its front, x runs right and y down from its
// upper left corner. Metres, unit vectors.
struct Plane {
  Eigen::Vector3d corner, right, down;
  double width = 0, height = 0;

  Eigen::Vector3d front() const { return down.cross(right); }
  Eigen::Vector3d at(double x, double y) const { return corner + x * right + y * down; }
};

// Collects patches and says what to paint on them; the painting is done at the end, all at once.
class SceneBuilder {
 public:
  // texel: edge of a texture's pixel where nothing else is said, m. plain: walls and furniture with
  // hardly any texture.
  SceneBuilder(std::uint64_t seed, double texel, bool plain);

  Random& random() { return random_; }
  double pick(double low, double high) { return random_.uniform(low, high); }
  bool plain() const { return plain_; }
  void set_plain(bool plain) { plain_ = plain; }
  Scene& scene() { return scene_; }
  KeepFree& keep_free() { return keep_free_; }

  void add_patch(const Patch& patch, Surface surface, double tone, double texel = 0);
  // A whole plane, in panels of at most `panel` m.
  void add_plane(const Plane& plane, Surface surface, double tone, double panel = 5);
  // Something flat on a plane, its upper left corner at (x, y), turned by `angle` rad.
  void hang(const Plane& plane, double x, double y, cv::Size2d size, Surface surface, double tone,
            double angle = 0, float emission = 0);
  // A box along the axes of a frame; its underside only where it is above the frame's z = 0.
  void add_box(const SE3& world_from_frame, const Eigen::Vector3d& min, const Eigen::Vector3d& max,
               Surface sides, Surface top, double tone);
  // An upright prism with `faces` sides.
  void add_pillar(const Eigen::Vector3d& foot, double radius, double height, int faces,
                  Surface surface, double tone);
  void add_lamp(const Eigen::Vector3d& position, double intensity, double radius = 0.15);
  // A box with a texture of its own on each face, on a circle; feet at centre.z.
  void add_moving_object(const Eigen::Vector3d& centre, double circle, double speed);

  // Whether the box of a frame is free of other furniture and of what must stay free; if so it is
  // taken.
  bool take(const SE3& world_from_frame, const Eigen::Vector3d& min, const Eigen::Vector3d& max);

  // Paints everything and traces the light. Call once.
  Scene finish(const std::vector<cv::Mat>& photographs, double light_spacing, double ambient_reach,
               ThreadPool& pool);

 private:
  struct Taken {
    Eigen::Vector3d min, max;
  };
  int add_texture(cv::Size2d size, Surface surface, double tone, double texel);

  std::uint64_t seed_;
  double texel_;
  bool plain_;
  Random random_;
  Scene scene_;
  KeepFree keep_free_;
  std::vector<SurfacePaint> paints_;
  std::vector<Taken> taken_;
};

}  // namespace rover
