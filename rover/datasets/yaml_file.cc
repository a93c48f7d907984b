#include "rover/datasets/yaml_file.h"

#include <cmath>

#include "rover/base/error.h"
#include "rover/datasets/text_rows.h"

namespace rover {
namespace {

constexpr std::size_t kMaxBytes = 1 << 20;

void append_numbers(const YAML::Node& node, std::vector<double>& values) {
  if (node.IsSequence()) {
    for (const auto& item : node) append_numbers(item, values);
  } else {
    values.push_back(parse_number(node.Scalar()));
  }
}

}  // namespace

YamlFields::YamlFields(std::filesystem::path file, YAML::Node node, std::string prefix)
    : file_(std::move(file)), node_(std::move(node)), prefix_(std::move(prefix)) {}

YamlFields YamlFields::load(const std::filesystem::path& file) {
  const std::string text = read_text_file(file);
  require(text.size() <= kMaxBytes, "{}: too large for a calibration file", file.string());
  try {
    YAML::Node node = YAML::Load(text);
    require(node.IsMap(), "{}: holds no calibration; a YAML file with keys is expected",
            file.string());
    return {file, node, ""};
  } catch (const YAML::Exception& error) {
    throw InputError("{}: line {}: not valid YAML ({}); is the file whole?", file.string(),
                     error.mark.line + 1, error.msg);
  }
}

void YamlFields::fail(const std::string& what) const {
  throw InputError("{}: {}; correct the calibration file", file_.string(), what);
}

bool YamlFields::has(const std::string& key) const { return node_[key].IsDefined(); }

YAML::Node YamlFields::at(const std::string& key) const {
  const YAML::Node node = node_[key];
  if (!node.IsDefined()) fail(fmt::format("'{}{}' is missing", prefix_, key));
  return node;
}

YamlFields YamlFields::child(const std::string& key) const {
  const YAML::Node node = at(key);
  if (!node.IsMap()) fail(fmt::format("'{}{}' has no keys of its own", prefix_, key));
  return {file_, node, prefix_ + key + "."};
}

std::string YamlFields::text(const std::string& key) const {
  const YAML::Node node = at(key);
  if (!node.IsScalar()) fail(fmt::format("'{}{}' is not a text", prefix_, key));
  return node.Scalar();
}

std::vector<double> YamlFields::numbers(const std::string& key) const {
  std::vector<double> values;
  try {
    append_numbers(at(key), values);
  } catch (const InputError& error) {
    if (!has(key)) throw;
    fail(fmt::format("'{}{}': {}", prefix_, key, error.what()));
  } catch (const YAML::Exception&) {
    fail(fmt::format("'{}{}' is not a list of numbers", prefix_, key));
  }
  return values;
}

double YamlFields::number(const std::string& key) const {
  const auto values = numbers(key);
  if (values.size() != 1) fail(fmt::format("'{}{}' is not one number", prefix_, key));
  return values.front();
}

SE3 YamlFields::transform(const std::string& key) const {
  const bool nested = at(key).IsMap();
  const auto values = nested ? child(key).numbers("data") : numbers(key);
  if (values.size() != 16) fail(fmt::format("'{}{}' is not a 4x4 matrix", prefix_, key));
  const Eigen::Matrix4d matrix =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data());
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const double deviation = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm();
  const bool last_row = (matrix.row(3) - Eigen::RowVector4d::Unit(3)).norm() < 1e-6;
  // Files give few digits; SE3 makes the rotation exact.
  if (!(deviation < 1e-2) || rotation.determinant() < 0 || !last_row) {
    fail(fmt::format("'{}{}' is not a rigid transform", prefix_, key));
  }
  return SE3::from_matrix(matrix);
}

}  // namespace rover
