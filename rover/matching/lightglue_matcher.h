#pragma once

#include <memory>
#include <string>
#include <vector>

#include "rover/matching/matcher.h"
#include "rover/networks/runtime.h"

namespace rover {

struct LightGlueOptions {
  std::string model =
      "lighterglue";         // of the graphs' names: MODEL_input.onnx, MODEL_layer_0.onnx...
  int layers = 6;            // that the model has
  int max_layers = 6;        // to run at most
  float min_score = 0.1f;    // of a match, in (0, 1)
  float exit_share = 0.95f;  // of confident points at which no further layer is run;
                             // above 1: never leave early
  float prune_matchability = 0.01f;  // confident points below it are dropped; 0: none
  int min_pruned = 64;               // fewer are left in: copying the rest would cost more

  void check() const;
};

// Six layers of 96 channels for XFeat; nine of 256 for ALIKED-n16 and SuperPoint.
LightGlueOptions lighterglue_options();
LightGlueOptions lightglue_options(const std::string& model);

// What the matcher did besides matching.
struct LightGlueResult {
  std::vector<Match> matches;
  int layers = 0;  // that were run
  int pruned = 0;  // points of both images dropped on the way
};

// LightGlue (Lindenberger, Sarlin, Pollefeys, ICCV 2023), layer by layer: leaves as soon as nearly
// all points are confident, and drops points that are confident to have no partner (its section
// 3.3). LighterGlue (XFeat's authors) is the same network, smaller. Graphs: docs/networks.md.
// A match's score is its probability under the assignment.
class LightGlueMatcher : public Matcher {
 public:
  // Throws InputError for options that make no sense and for missing graphs.
  LightGlueMatcher(Runtime& runtime, const LightGlueOptions& options);

  std::vector<Match> match(const MatchInput& a, const MatchInput& b) const override {
    return run(a, b).matches;
  }
  LightGlueResult run(const MatchInput& a, const MatchInput& b) const;

 private:
  struct Side;   // one image's points on their way through the layers
  struct Layer;  // what a layer says about them

  Side prepare(const FeatureSet& features) const;
  Layer run_layer(int index, Side& a, Side& b) const;
  bool finished(const Layer& layer, int pruned, int total, float threshold) const;
  std::vector<Match> assign(int layer, const Side& a, const Side& b) const;

  LightGlueOptions options_;
  std::shared_ptr<const Network> input_;
  std::vector<std::shared_ptr<const Network>> layers_;
  std::vector<std::shared_ptr<const Network>> assignments_;
};

}  // namespace rover
