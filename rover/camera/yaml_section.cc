#include "rover/camera/yaml_section.h"

#include <cmath>
#include <fstream>
#include <sstream>

#include <Eigen/LU>
#include <Eigen/SVD>

#include "rover/base/error.h"

namespace rover {
namespace {

// Calibrations are written with at least four digits; a matrix that is farther from a rotation than
// this was mistyped or is something else.
constexpr double kRotationTolerance = 1e-3;

std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file);
  require(stream.good() && !std::filesystem::is_directory(file),
          "{}: cannot be read; check the path", file.string());
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

// Makes OpenCV's header a comment, so that line numbers stay.
std::string without_opencv_header(std::string text) {
  if (text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);
  if (text.starts_with("%YAML:")) text[0] = '#';
  return text;
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

}  // namespace

YamlSection YamlSection::load(const std::filesystem::path& file) {
  YAML::Node root;
  try {
    root = YAML::Load(without_opencv_header(read_text(file)));
  } catch (const YAML::Exception& error) {
    throw InputError("{}:{}: is not valid YAML ({}); is the file complete?", file.string(),
                     error.mark.line + 1, error.msg);
  }
  require(root.IsMap(), "{}: holds no keys; expected a calibration in YAML", file.string());
  return YamlSection(file.string(), "", root);
}

void YamlSection::fail(const std::string& key, const std::string& message) const {
  const YAML::Node node = node_[key];
  const YAML::Mark mark = node ? node.Mark() : node_.Mark();
  throw InputError("{}:{}: {}{}: {}", file_, mark.line + 1, prefix_, key, message);
}

YAML::Node YamlSection::at(const std::string& key) const {
  const YAML::Node node = node_[key];
  if (!node || node.IsNull()) fail(key, "is missing; add it, or is the file complete?");
  return node;
}

YamlSection YamlSection::section(const std::string& key) const {
  const YAML::Node node = at(key);
  if (!node.IsMap()) fail(key, "must be a section with keys of its own");
  return YamlSection(file_, prefix_ + key + ".", node);
}

std::string YamlSection::text(const std::string& key) const {
  const YAML::Node node = at(key);
  if (!node.IsScalar()) fail(key, "must be one word");
  return node.Scalar();
}

double YamlSection::number(const std::string& key) const {
  std::vector<double> value;
  if (!at(key).IsScalar()) fail(key, "must be one number");
  collect(key, at(key), &value);
  return value.front();
}

void YamlSection::collect(const std::string& key, const YAML::Node& node,
                          std::vector<double>* values) const {
  if (node.IsSequence()) {
    for (const auto& element : node) collect(key, element, values);
    return;
  }
  double value = 0;
  if (!node.IsScalar() || !YAML::convert<double>::decode(node, value))
    fail(key, "must hold numbers only");
  if (!std::isfinite(value)) fail(key, "holds a number that is not finite; calibrate again");
  values->push_back(value);
}

std::vector<double> YamlSection::numbers(const std::string& key) const {
  const YAML::Node node = at(key);
  if (!node.IsSequence()) fail(key, "must be a list of numbers");
  std::vector<double> values;
  collect(key, node, &values);
  return values;
}

std::vector<double> YamlSection::numbers(const std::string& key, std::size_t count,
                                         const std::string& meaning) const {
  const std::vector<double> values = numbers(key);
  if (values.size() != count)
    fail(key, fmt::format("must hold {} numbers ({}), not {}", count, meaning, values.size()));
  return values;
}

SE3 YamlSection::transform(const std::string& key) const {
  if (at(key).IsMap()) return section(key).transform("data");
  const std::vector<double> values = numbers(key, 16, "a 4x4 matrix by rows");
  const Eigen::Matrix4d matrix =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data());
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const double error = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (!(error < kRotationTolerance) || rotation.determinant() < 0)
    fail(key, "the upper left 3x3 part is not a rotation matrix");
  if ((matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() > 1e-9)
    fail(key, "the last row of the matrix must be 0 0 0 1");
  return {nearest_rotation(rotation), matrix.topRightCorner<3, 1>()};
}

}  // namespace rover
