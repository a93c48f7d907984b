#pragma once

#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

namespace rover {

// What lies between four neighbouring pixels of an 8-bit image.
class BilinearCell {
 public:
  // upper_left: of the four; x, y: from there, px in [0, 1).
  BilinearCell(const std::uint8_t* upper_left, std::size_t stride, float x, float y)
      : x_(x),
        y_(y),
        upper_left_(upper_left[0]),
        upper_right_(upper_left[1]),
        lower_left_(upper_left[stride]),
        lower_right_(upper_left[stride + 1]) {}

  float value() const { return upper() + y_ * (lower() - upper()); }
  Eigen::Vector2f gradient() const {  // per px
    return {(1 - y_) * (upper_right_ - upper_left_) + y_ * (lower_right_ - lower_left_),
            lower() - upper()};
  }

 private:
  float upper() const { return upper_left_ + x_ * (upper_right_ - upper_left_); }
  float lower() const { return lower_left_ + x_ * (lower_right_ - lower_left_); }

  float x_, y_, upper_left_, upper_right_, lower_left_, lower_right_;
};

}  // namespace rover
