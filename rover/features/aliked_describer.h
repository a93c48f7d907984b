#pragma once

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "rover/base/thread_pool.h"
#include "rover/features/aliked_levels.h"
#include "rover/features/feature_set.h"
#include "rover/networks/runtime.h"

namespace rover {

// ALIKED's sparse deformable descriptor head (Zhao et al., IEEE TIM 2023, section III.B): a patch
// of joint vectors says where around a point to look, what is seen there makes the descriptor.
class AlikedDescriber {
 public:
  // name: "aliked-t16" or "aliked-n16". Throws InputError if a model is missing.
  AlikedDescriber(const std::string& name, Runtime& runtime);

  int descriptor_size() const { return size_; }

  // One unit row per position (px in the image that the levels are of). `memory` is grown as
  // needed.
  Descriptors describe(const AlikedLevels& levels, const std::vector<Eigen::Vector2f>& positions,
                       ThreadPool& pool, std::vector<float>& memory) const;

 private:
  TensorView gather_patches(const AlikedLevels& levels,
                            const std::vector<Eigen::Vector2f>& positions, ThreadPool& pool,
                            std::vector<float>& memory) const;
  TensorView gather_samples(const AlikedLevels& levels,
                            const std::vector<Eigen::Vector2f>& positions, const float* offsets,
                            ThreadPool& pool, std::vector<float>& memory) const;

  std::shared_ptr<const Network> offsets_, descriptors_;
  int size_;
};

}  // namespace rover
