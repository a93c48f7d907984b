#pragma once

#include <span>
#include <vector>

#include "rover/imu/imu_buffer.h"
#include "rover/imu/preintegration.h"

namespace rover {

// The samples of motions that follow each other without a break, and those that come after, in one
// buffer whose stamps are `shift` ns less.
ImuBuffer joined_samples(std::span<const Preintegration> motions, std::span<const ImuSample> after,
                         Timestamp shift);

// Such motions as they are where the inertial sensor's stamps turn out to be `shift` ns too late:
// over the same intervals, of samples that belong to other moments. `after`: samples that follow
// the last motion; what is asked for beyond the first and the last sample there are is held.
std::vector<Preintegration> with_shifted_clock(std::span<const Preintegration> motions,
                                               std::span<const ImuSample> after, Timestamp shift);

}  // namespace rover
