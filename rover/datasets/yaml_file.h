#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "rover/geometry/se3.h"

namespace rover {

// One mapping of a calibration file in YAML, with errors that name file, key and what is wrong.
class YamlFields {
 public:
  // Throws InputError unless the file is a YAML mapping.
  static YamlFields load(const std::filesystem::path& file);

  bool has(const std::string& key) const;
  // The mapping under a key; throws InputError if there is none. So do the others.
  YamlFields child(const std::string& key) const;
  std::string text(const std::string& key) const;
  double number(const std::string& key) const;                // finite
  std::vector<double> numbers(const std::string& key) const;  // finite, also nested: row by row
  // A 4x4 matrix, in rows or as OpenCV's `data`, that must be a rigid transform.
  SE3 transform(const std::string& key) const;

  [[noreturn]] void fail(const std::string& what) const;

 private:
  YamlFields(std::filesystem::path file, YAML::Node node, std::string prefix);
  YAML::Node at(const std::string& key) const;

  std::filesystem::path file_;
  YAML::Node node_;
  std::string prefix_;  // of keys in messages, "cam0."
};

}  // namespace rover
