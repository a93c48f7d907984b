#pragma once

#include <vector>

#include "rover/matching/matcher.h"

namespace rover {

// The rows of a set that are named, as a set of their own.
FeatureSet select_features(const FeatureSet& features, const std::vector<int>& rows);

// Joins only some features of two images: a learned matcher's time grows with their square. Rows
// ascend; the matches name features of the whole sets.
std::vector<Match> match_some(const Matcher& matcher, const MatchInput& a,
                              const std::vector<int>& rows_a, const MatchInput& b,
                              const std::vector<int>& rows_b);

// Likewise with the `share` (0 to 1] of best features of each image.
std::vector<Match> match_best(const Matcher& matcher, const MatchInput& a, const MatchInput& b,
                              double share);

}  // namespace rover
