#pragma once

#include <memory>
#include <mutex>
#include <utility>

#include "rover/map/map.h"

namespace rover {

// A map that several threads use. Readers take an immutable view; writers commit short edits, each
// of which publishes a new view.
class SharedMap {
 public:
  explicit SharedMap(Map map) : working_(std::move(map)) { publish(); }

  std::shared_ptr<const Map> view() const {
    std::lock_guard lock(view_mutex_);
    return view_;
  }

  // Runs edit(map) alone among writers and publishes what it made. Long work belongs before it.
  template <class Edit>
  auto commit(Edit&& edit) {
    std::lock_guard lock(mutex_);
    if constexpr (std::is_void_v<decltype(edit(working_))>) {
      edit(working_);
      publish();
    } else {
      auto result = edit(working_);
      publish();
      return result;
    }
  }

 private:
  void publish() {
    auto view = std::make_shared<const Map>(working_);
    working_.freeze();
    std::lock_guard lock(view_mutex_);
    view_ = std::move(view);
  }

  std::mutex mutex_;
  Map working_;
  mutable std::mutex view_mutex_;
  std::shared_ptr<const Map> view_;
};

}  // namespace rover
