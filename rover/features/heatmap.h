#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "rover/base/thread_pool.h"
#include "rover/features/kernels.h"
#include "rover/features/local_maxima.h"
#include "rover/networks/runtime.h"

namespace rover {

// The probability of a keypoint at each pixel, from logits [1, 65, H/8, W/8]: softmax over the 64
// pixels of a cell and "none" (DeTone et al., SuperPoint, CVPRW 2018, section 3.2). Borrows
// `memory`; covers `size`, the part of the padded image that is real.
ScoreMap softmax_heatmap(const Network::Output& logits, cv::Size size,
                         const kernels::Kernels& kernels, ThreadPool& pool,
                         std::vector<float>& memory);

// Centre of mass of the scores around a maximum, (2 radius + 1)^2 px: the soft-argmax at the
// temperature at which the scores are probabilities.
Eigen::Vector2f refine_centroid(const ScoreMap& map, const Candidate& candidate, int radius);

}  // namespace rover
