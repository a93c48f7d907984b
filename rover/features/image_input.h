#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "rover/base/thread_pool.h"
#include "rover/features/extractor.h"
#include "rover/features/kernels.h"
#include "rover/networks/runtime.h"

namespace rover {

// Throws InputError unless the image is 8 bit, one channel, at least 32x32, and the mask (if any)
// 8 bit and of its size; and the budget positive.
void check_request(const cv::Mat& image, const ExtractionRequest& request);

// What networks take: sizes are multiples of this.
constexpr int kNetworkStride = 32;
cv::Size padded_size(cv::Size size);

// The image as a tensor [1, 1, H, W] in `memory`, gray times scale; its pixel (0, 0) at `origin`,
// its border repeated up to the padded size.
TensorView network_input(const cv::Mat& image, float scale, cv::Point origin,
                         const kernels::Kernels& kernels, ThreadPool& pool,
                         std::vector<float>& memory);

// Memory that calls use and hand back, so that a call of the same size allocates nothing large.
// There are as many as calls have been running at once.
template <class Workspace>
class WorkspacePool {
 public:
  class Lease {
   public:
    Lease(WorkspacePool& pool, std::unique_ptr<Workspace> workspace)
        : pool_(pool), workspace_(std::move(workspace)) {}
    ~Lease() {
      std::lock_guard lock(pool_.mutex_);
      pool_.idle_.push_back(std::move(workspace_));
    }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    Workspace& operator*() const { return *workspace_; }
    Workspace* operator->() const { return workspace_.get(); }

   private:
    WorkspacePool& pool_;
    std::unique_ptr<Workspace> workspace_;
  };

  Lease borrow() {
    std::lock_guard lock(mutex_);
    if (idle_.empty()) return {*this, std::make_unique<Workspace>()};
    auto workspace = std::move(idle_.back());
    idle_.pop_back();
    return {*this, std::move(workspace)};
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<Workspace>> idle_;
};

}  // namespace rover
