#include <exception>
#include <thread>
#include <utility>

#include "rover/base/bounded_queue.h"
#include "rover/base/error.h"
#include "rover/datasets/dataset.h"

namespace rover {
namespace {

// The thread owns the wrapped stream's position from the first next() on; everything else of it is
// immutable, so that both threads may read it.
class ReadAheadDataset : public Dataset {
 public:
  ReadAheadDataset(std::unique_ptr<Dataset> dataset, int depth)
      : dataset_(std::move(dataset)),
        size_(dataset_->size()),
        queue_(static_cast<std::size_t>(depth)) {}

  ~ReadAheadDataset() override {
    queue_.close();
    if (thread_.joinable()) thread_.join();
  }

  const Rig& rig() const override { return dataset_->rig(); }
  const std::optional<ImuCalibration>& imu_calibration() const override {
    return dataset_->imu_calibration();
  }
  std::size_t size() const override { return size_; }
  const Trajectory& ground_truth() const override { return dataset_->ground_truth(); }
  const std::vector<std::string>& notes() const override { return dataset_->notes(); }

  std::optional<SensorFrame> next() override {
    if (!thread_.joinable()) thread_ = std::thread([this] { read_all(); });
    auto frame = queue_.pop();
    if (!frame && failure_) std::rethrow_exception(failure_);
    return frame;
  }

 private:
  void read_all() {
    try {
      while (auto frame = dataset_->next()) {
        if (!queue_.push(std::move(*frame))) break;
      }
    } catch (...) {
      failure_ = std::current_exception();  // read only after the queue was seen closed
    }
    queue_.close();
  }

  std::unique_ptr<Dataset> dataset_;
  const std::size_t size_;
  BoundedQueue<SensorFrame> queue_;
  std::exception_ptr failure_;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<Dataset> read_ahead(std::unique_ptr<Dataset> dataset, int depth) {
  require(depth >= 1, "the number of frames read ahead must be at least 1, not {}", depth);
  return std::make_unique<ReadAheadDataset>(std::move(dataset), depth);
}

}  // namespace rover
