#include "rover/matching/lightglue_matcher.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "rover/base/error.h"
#include "rover/matching/kernels.h"

namespace rover {

void LightGlueOptions::check() const {
  require(layers >= 1 && max_layers >= 1 && max_layers <= layers,
          "LightGlue: max_layers must be 1 to {}, not {}", layers, max_layers);
  require(min_score > 0 && min_score < 1, "LightGlue: min_score must be in (0, 1), not {}",
          min_score);
  require(exit_share > 0, "LightGlue: exit_share must be positive, not {}", exit_share);
  require(prune_matchability >= 0 && prune_matchability < 1,
          "LightGlue: prune_matchability must be in [0, 1), not {}", prune_matchability);
}

LightGlueOptions lighterglue_options() { return {}; }

LightGlueOptions lightglue_options(const std::string& model) {
  LightGlueOptions options;
  options.model = model;
  options.layers = options.max_layers = 9;
  return options;
}

namespace {

using Tensor = Network::Output;

// The given rows of a matrix.
Tensor gather_rows(const Tensor& tensor, const std::vector<int>& rows, std::int64_t channels) {
  auto kept = std::make_shared<std::vector<float>>();
  kept->reserve(rows.size() * static_cast<std::size_t>(channels));
  for (const int row : rows) {
    const auto from = tensor.values.begin() + row * channels;
    kept->insert(kept->end(), from, from + channels);
  }
  return {*kept, {static_cast<std::int64_t>(rows.size()), channels}, kept};
}

}  // namespace

struct LightGlueMatcher::Side {
  int size = 0;
  Tensor x, cos, sin;        // size x channels each
  std::vector<int> indices;  // of the features that are left

  void keep(const std::vector<int>& rows) {
    for (Tensor* tensor : {&x, &cos, &sin}) {
      *tensor = gather_rows(*tensor, rows, tensor->shape.back());
    }
    for (std::size_t to = 0; to < rows.size(); ++to) indices[to] = indices[rows[to]];
    indices.resize(rows.size());
    size = static_cast<int>(rows.size());
  }
};

struct LightGlueMatcher::Layer {
  Tensor confidence_a, confidence_b;  // empty after the last layer
  Tensor matchability_a, matchability_b;
};

LightGlueMatcher::LightGlueMatcher(Runtime& runtime, const LightGlueOptions& options)
    : options_(options) {
  options_.check();
  input_ = runtime.load(options_.model + "_input.onnx");
  for (int i = 0; i < options_.max_layers; ++i) {
    layers_.push_back(runtime.load(fmt::format("{}_layer_{}.onnx", options_.model, i)));
    assignments_.push_back(runtime.load(fmt::format("{}_assign_{}.onnx", options_.model, i)));
  }
}

namespace {

// LightGlue's own normalisation: the image's longer side spans [-1, 1].
std::vector<float> normalised_positions(const FeatureSet& features) {
  const Eigen::Vector2f size(static_cast<float>(features.image_size.width),
                             static_cast<float>(features.image_size.height));
  std::vector<float> normalised;
  normalised.reserve(2 * features.positions.size());
  for (const auto& position : features.positions) {
    const Eigen::Vector2f p = (position - size / 2) / (size.maxCoeff() / 2);
    normalised.insert(normalised.end(), {p.x(), p.y()});
  }
  return normalised;
}

Tensor output(const Network& network, const std::vector<Tensor>& outputs, const char* name) {
  const auto& names = network.output_names();
  const auto found = std::find(names.begin(), names.end(), name);
  require(found != names.end(), "the matcher's graph has no output '{}'", name);
  return outputs[found - names.begin()];
}

// Of layer k of n, counted from 1: lower in later layers (the paper's equation 12).
float confidence_threshold(int k, int n) {
  return 0.8f + 0.1f * std::exp(-4.0f * static_cast<float>(k) / static_cast<float>(n));
}

// The rows that are not confidently without a partner.
std::vector<int> possibly_matchable(const Tensor& confidence, const Tensor& matchability,
                                    float threshold, float min_matchability) {
  std::vector<int> rows;
  for (std::size_t i = 0; i < confidence.values.size(); ++i) {
    if (!(confidence.values[i] > threshold && matchability.values[i] < min_matchability)) {
      rows.push_back(static_cast<int>(i));
    }
  }
  return rows;
}

}  // namespace

LightGlueMatcher::Side LightGlueMatcher::prepare(const FeatureSet& features) const {
  const auto positions = normalised_positions(features);
  const std::int64_t size = features.size(), channels = features.descriptors.cols();
  const std::array<TensorView, 2> inputs = {
      TensorView{positions, {size, 2}},
      TensorView{{features.descriptors.data(), static_cast<std::size_t>(size * channels)},
                 {size, channels}}};
  const auto outputs = input_->run(inputs);
  Side side;
  side.size = features.size();
  side.x = output(*input_, outputs, "x");
  side.cos = output(*input_, outputs, "cos");
  side.sin = output(*input_, outputs, "sin");
  side.indices.resize(side.size);
  std::iota(side.indices.begin(), side.indices.end(), 0);
  return side;
}

LightGlueMatcher::Layer LightGlueMatcher::run_layer(int index, Side& a, Side& b) const {
  const Network& network = *layers_[index];
  const std::array<TensorView, 6> inputs = {
      TensorView{a.x.values, a.x.shape},     TensorView{a.cos.values, a.cos.shape},
      TensorView{a.sin.values, a.sin.shape}, TensorView{b.x.values, b.x.shape},
      TensorView{b.cos.values, b.cos.shape}, TensorView{b.sin.values, b.sin.shape}};
  const auto outputs = network.run(inputs);
  a.x = output(network, outputs, "x0_out");
  b.x = output(network, outputs, "x1_out");
  Layer layer;
  if (index + 1 == options_.layers) return layer;
  layer.confidence_a = output(network, outputs, "confidence0");
  layer.confidence_b = output(network, outputs, "confidence1");
  layer.matchability_a = output(network, outputs, "matchability0");
  layer.matchability_b = output(network, outputs, "matchability1");
  return layer;
}

bool LightGlueMatcher::finished(const Layer& layer, int pruned, int total, float threshold) const {
  const auto confident = [&](float confidence) { return confidence > threshold; };
  const auto count = pruned + std::ranges::count_if(layer.confidence_a.values, confident) +
                     std::ranges::count_if(layer.confidence_b.values, confident);
  return static_cast<float>(count) > options_.exit_share * static_cast<float>(total);
}

std::vector<Match> LightGlueMatcher::assign(int layer, const Side& a, const Side& b) const {
  const std::array<TensorView, 2> inputs = {TensorView{a.x.values, a.x.shape},
                                            TensorView{b.x.values, b.x.shape}};
  const auto outputs = assignments_[layer]->run(inputs);
  const float* scores = outputs.front().values.data();
  const MatchingKernels& kernels = matching_kernels();
  std::vector<float> row_best(a.size), column_best(b.size, -3e38f);
  std::vector<int> row_index(a.size), column_index(b.size, -1);
  for (int i = 0; i < a.size; ++i) {
    const float* row = scores + static_cast<std::ptrdiff_t>(i) * b.size;
    float second = 0;
    kernels.row_maximum(row, b.size, &row_best[i], &row_index[i], &second);
    kernels.column_maxima(row, b.size, i, column_best.data(), column_index.data());
  }
  const float least = std::log(options_.min_score);
  std::vector<Match> matches;
  for (int i = 0; i < a.size; ++i) {
    if (row_best[i] <= least || column_index[row_index[i]] != i) continue;
    matches.push_back(
        {a.indices[i], b.indices[row_index[i]], std::min(1.0f, std::exp(row_best[i]))});
  }
  return matches;
}

LightGlueResult LightGlueMatcher::run(const MatchInput& a, const MatchInput& b) const {
  LightGlueResult result;
  if (a.features.empty() || b.features.empty()) return result;
  Side side_a = prepare(a.features), side_b = prepare(b.features);
  const int total = side_a.size + side_b.size;
  while (true) {
    const Layer layer = run_layer(result.layers++, side_a, side_b);
    if (result.layers == options_.max_layers) break;
    const float threshold = confidence_threshold(result.layers, options_.layers);
    if (finished(layer, result.pruned, total, threshold)) break;
    const auto stay_a = possibly_matchable(layer.confidence_a, layer.matchability_a, threshold,
                                           options_.prune_matchability);
    const auto stay_b = possibly_matchable(layer.confidence_b, layer.matchability_b, threshold,
                                           options_.prune_matchability);
    if (stay_a.empty() || stay_b.empty()) return result;
    const int dropped = side_a.size + side_b.size - static_cast<int>(stay_a.size() + stay_b.size());
    if (dropped >= options_.min_pruned) {
      side_a.keep(stay_a);
      side_b.keep(stay_b);
      result.pruned += dropped;
    }
  }
  result.matches = assign(result.layers - 1, side_a, side_b);
  return result;
}

}  // namespace rover
