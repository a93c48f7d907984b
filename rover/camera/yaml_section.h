#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "rover/geometry/se3.h"

namespace rover {

// A mapping in a YAML file whose values are read with checks. Every failure throws an InputError
// that names the file, the line and the key.
class YamlSection {
 public:
  // The whole file. OpenCV's header `%YAML:1.0`, which is no valid YAML directive, is skipped.
  static YamlSection load(const std::filesystem::path& file);

  bool has(const std::string& key) const { return static_cast<bool>(node_[key]); }
  YamlSection section(const std::string& key) const;
  std::string text(const std::string& key) const;
  double number(const std::string& key) const;
  // Exactly `count` finite numbers; `meaning` explains them in the error message.
  std::vector<double> numbers(const std::string& key, std::size_t count,
                              const std::string& meaning) const;
  // Any count of finite numbers.
  std::vector<double> numbers(const std::string& key) const;
  // A rigid 4x4 matrix, row by row: a list of 16, four lists of four, or a map with such `data`
  // (EuRoC). Rounded rotations are made orthonormal again.
  SE3 transform(const std::string& key) const;

  // Throws an InputError "file:line: key: message" about a key of this section.
  [[noreturn]] void fail(const std::string& key, const std::string& message) const;

 private:
  YamlSection(std::string file, std::string prefix, YAML::Node node)
      : file_(std::move(file)), prefix_(std::move(prefix)), node_(std::move(node)) {}
  YAML::Node at(const std::string& key) const;
  void collect(const std::string& key, const YAML::Node& node, std::vector<double>* values) const;

  std::string file_;
  std::string prefix_;
  YAML::Node node_;
};

}  // namespace rover
