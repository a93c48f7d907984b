#pragma once

#include <compare>
#include <cstdint>
#include <functional>

namespace rover {

// A number that names one thing of one kind; ids of different kinds do not mix. Ids are given in
// ascending order and never reused, so iteration in id order is iteration in order of creation.
template <class Tag>
struct Id {
  std::int64_t value = -1;

  constexpr bool valid() const { return value >= 0; }
  constexpr auto operator<=>(const Id&) const = default;
};

using FrameId = Id<struct FrameTag>;        // input frame (one instant, all cameras)
using KeyframeId = Id<struct KeyframeTag>;  // unique over all maps of an atlas
using LandmarkId = Id<struct LandmarkTag>;  // likewise
using MapId = Id<struct MapTag>;

}  // namespace rover

template <class Tag>
struct std::hash<rover::Id<Tag>> {
  std::size_t operator()(const rover::Id<Tag>& id) const noexcept {
    return std::hash<std::int64_t>()(id.value);
  }
};
