#pragma once

#include "rover/simulation/scene_builder.h"

namespace rover {

// Things to put into scenes. Frames stand on the floor, z up, their back towards +y. Each returns
// whether there was room for it.
bool add_cabinet(SceneBuilder& builder, const SE3& frame);
bool add_bookshelf(SceneBuilder& builder, const SE3& frame);
bool add_table(SceneBuilder& builder, const SE3& frame);
bool add_crates(SceneBuilder& builder, const SE3& frame);
bool add_mattress(SceneBuilder& builder, const SE3& frame);
bool add_stand(SceneBuilder& builder, const SE3& frame);  // a board on a foot
bool add_car(SceneBuilder& builder, const SE3& frame);
bool add_tree(SceneBuilder& builder, const SE3& frame);

// Any of those that suit a room.
bool add_any_furniture(SceneBuilder& builder, const SE3& frame);

// Posters, boards and pictures all over a wall, about `density` per square metre, clear of each
// other.
void decorate_wall(SceneBuilder& builder, const Plane& wall, double density);
// Mats, tapes and sheets on a floor.
void decorate_floor(SceneBuilder& builder, const Plane& floor, double density);

}  // namespace rover
