#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>

namespace rover {

// Lets long work step aside while urgent work is under way: tracking holds the gate while it has a
// frame, mapping calls yield() between the steps of its networks.
class PriorityGate {
 public:
  // Held for as long as urgent work lasts.
  class Hold {
   public:
    explicit Hold(PriorityGate& gate) : gate_(gate) { gate_.add(1); }
    ~Hold() { gate_.add(-1); }
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;

   private:
    PriorityGate& gate_;
  };

  // Waits until nobody holds the gate, but not longer than `patience`: urgent work without a pause
  // must not stop the other for good.
  void yield(std::chrono::milliseconds patience = std::chrono::milliseconds(40)) {
    std::unique_lock lock(mutex_);
    free_.wait_for(lock, patience, [&] { return holders_ == 0; });
  }

 private:
  void add(int change) {
    std::lock_guard lock(mutex_);
    holders_ += change;
    if (holders_ == 0) free_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable free_;
  int holders_ = 0;
};

}  // namespace rover
