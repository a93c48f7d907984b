#include "rover/optimization/map_error.h"

#include "rover/geometry/so3.h"

namespace rover {

Matrix15x3d by_map_error(const InertialState& state, const Eigen::Vector3d& lever,
                         const Eigen::Vector3d& pivot) {
  const Eigen::Matrix3d turn = state.world_from_body.rotation_matrix();
  const Eigen::Vector3d way = state.world_from_body.translation - pivot;
  Matrix15x3d by_error = Matrix15x3d::Zero();
  by_error.block<3, 2>(0, 0) = (-turn.transpose() * skew(way)).leftCols<2>();
  by_error.block<3, 2>(3, 0) = turn.transpose().leftCols<2>();
  by_error.block<3, 2>(6, 0) = -skew(state.velocity).leftCols<2>();
  by_error.block<3, 1>(0, 2) = turn.transpose() * way + lever;
  by_error.block<3, 1>(6, 2) = state.velocity;
  return by_error;
}

}  // namespace rover
