#include "rover/evaluation/benchmark_plan.h"

#include <algorithm>
#include <functional>
#include <string_view>

#include <yaml-cpp/yaml.h>

#include "rover/base/error.h"
#include "rover/datasets/text_rows.h"

namespace rover {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string_view>;

const Names kModes = {"mono", "stereo", "mono-inertial", "stereo-inertial"};
const Names kRunFlags = {"realtime", "threads", "family", "device", "no-final-adjustment"};
const Names kSimulatePaths = {"along", "imu", "textures"};

bool contains(const Names& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string listed(const Names& names) {
  std::string text;
  for (const auto name : names) text += (text.empty() ? "" : ", ") + std::string(name);
  return text;
}

// Reads values with checks; knows the file for messages and for relative paths.
class PlanReader {
 public:
  explicit PlanReader(const fs::path& file) : file_(file) {}

  template <class... Args>
  [[noreturn]] void fail(const YAML::Node& where, fmt::format_string<Args...> format,
                         Args&&... args) const {
    throw InputError("{}:{}: {}", file_.string(), where.Mark().line + 1,
                     fmt::format(format, std::forward<Args>(args)...));
  }

  // Calls use(key, name node, value) for each entry of a section that may hold only these keys.
  void each_key(const YAML::Node& section, const std::string& what, const Names& known,
                const std::function<void(const std::string&, const YAML::Node&)>& use) const {
    if (!section.IsMap())
      fail(section, "{} must be a section with the keys {}", what, listed(known));
    for (const auto& entry : section) {
      const std::string key = text(entry.first, "a key");
      if (!contains(known, key)) {
        fail(entry.first, "unknown key '{}' in {}; known are {}", key, what, listed(known));
      }
      use(key, entry.second);
    }
  }

  std::string text(const YAML::Node& value, const std::string& what) const {
    if (!value.IsScalar() || value.Scalar().empty()) fail(value, "{} must be one word", what);
    return value.Scalar();
  }

  // A name that becomes a folder.
  std::string name(const YAML::Node& value) const {
    const std::string name = text(value, "name");
    const auto allowed = [](unsigned char c) {
      return std::isalnum(c) != 0 || c == '.' || c == '_' || c == '-' || c == '+';
    };
    if (!std::all_of(name.begin(), name.end(), allowed) || name.front() == '.') {
      fail(value, "the name '{}' must consist of letters, digits, '-', '_', '+' and '.'", name);
    }
    return name;
  }

  std::uint64_t whole_number(const YAML::Node& value, const std::string& what,
                             std::uint64_t low) const {
    std::uint64_t number = 0;
    if (!value.IsScalar() || !YAML::convert<std::uint64_t>::decode(value, number) || number < low) {
      fail(value, "{} must be a whole number from {} on", what, low);
    }
    return number;
  }

  // A list that is not empty.
  std::vector<YAML::Node> list(const YAML::Node& value, const std::string& what) const {
    if (!value.IsSequence() || value.size() == 0) {
      fail(value, "{} must be a list with at least one entry", what);
    }
    return {value.begin(), value.end()};
  }

  fs::path resolve(const std::string& path) const {
    return (fs::absolute(file_).parent_path() / path).lexically_normal();
  }

  fs::path existing(const YAML::Node& value, const std::string& what) const {
    const fs::path path = resolve(text(value, what));
    if (!fs::exists(path)) fail(value, "{}: {} is not there", what, path.string());
    return path;
  }

  // True without a value, nothing for false.
  void add_option(const std::string& key, const YAML::Node& value, CommandOptions& options) const {
    const std::string word = text(value, key);
    if (word == "false") return;
    options.emplace_back(key, word == "true" ? std::nullopt : std::optional(word));
  }

  std::vector<std::string> modes(const YAML::Node& value) const {
    std::vector<std::string> modes;
    for (const YAML::Node& mode : list(value, "modes")) {
      modes.push_back(known_mode(mode));
    }
    return modes;
  }

  std::string known_mode(const YAML::Node& value) const {
    const std::string mode = text(value, "mode");
    if (!contains(kModes, mode))
      fail(value, "unknown mode '{}'; known are {}", mode, listed(kModes));
    return mode;
  }

  std::vector<std::uint64_t> seeds(const YAML::Node& value) const {
    std::vector<std::uint64_t> seeds;
    for (const YAML::Node& seed : list(value, "seeds")) {
      seeds.push_back(whole_number(seed, "a seed", 0));
    }
    return seeds;
  }

  CommandOptions simulation(const YAML::Node& section) const {
    if (!section.IsMap())
      fail(section, "simulate must be a section with options of rover simulate");
    CommandOptions options;
    for (const auto& entry : section) {
      const std::string key = text(entry.first, "an option of rover simulate");
      if (key == "output" || key == "seed") {
        fail(entry.first, "simulate.{} is set by the benchmark itself; leave it out", key);
      }
      if (contains(kSimulatePaths, key) ||
          (key == "rig" && fs::exists(resolve(text(entry.second, key))))) {
        options.emplace_back(key, existing(entry.second, "simulate." + key).string());
      } else {
        add_option(key, entry.second, options);
      }
    }
    return options;
  }

 private:
  fs::path file_;
};

BenchmarkSequence read_sequence(const PlanReader& reader, const YAML::Node& node,
                                const BenchmarkSequence& defaults) {
  BenchmarkSequence sequence = defaults;
  const auto use = [&](const std::string& key, const YAML::Node& value) {
    if (key == "name") sequence.name = reader.name(value);
    if (key == "dataset") sequence.dataset = reader.existing(value, key);
    if (key == "simulate") sequence.simulate = reader.simulation(value);
    if (key == "modes") sequence.modes = reader.modes(value);
    if (key == "seeds") sequence.seeds = reader.seeds(value);
    if (key == "format") sequence.input.emplace_back(key, reader.text(value, key));
    if (key == "calibration")
      sequence.input.emplace_back(key, reader.existing(value, key).string());
    if (key == "mask") sequence.run.emplace_back(key, reader.existing(value, key).string());
    if (key == "max-frames") {
      sequence.run.emplace_back(key, std::to_string(reader.whole_number(value, key, 1)));
    }
    if (key == "frame-rate") reader.add_option(key, value, sequence.run);
  };
  reader.each_key(node, "a sequence",
                  {"name", "dataset", "simulate", "modes", "seeds", "format", "calibration", "mask",
                   "max-frames", "frame-rate"},
                  use);
  if (sequence.name.empty()) reader.fail(node, "a sequence needs a name");
  if (sequence.dataset.empty() == !sequence.simulate.has_value()) {
    reader.fail(node, "sequence {} needs either 'dataset' or 'simulate'", sequence.name);
  }
  if (sequence.modes.empty()) {
    reader.fail(node, "sequence {} needs 'modes', of its own or for all", sequence.name);
  }
  return sequence;
}

CommandOptions read_flags(const PlanReader& reader, const YAML::Node& node) {
  CommandOptions flags;
  reader.each_key(node, "flags", kRunFlags, [&](const std::string& key, const YAML::Node& value) {
    reader.add_option(key, value, flags);
  });
  return flags;
}

BenchmarkConfiguration read_configuration(const PlanReader& reader, const YAML::Node& node) {
  BenchmarkConfiguration configuration;
  configuration.line = node.Mark().line + 1;
  const auto use = [&](const std::string& key, const YAML::Node& value) {
    if (key == "name") configuration.name = reader.name(value);
    if (key == "flags") configuration.flags = read_flags(reader, value);
    if (key != "settings") return;
    if (!value.IsMap()) reader.fail(value, "settings must be keys of docs/configuration.md");
    configuration.line = value.Mark().line + 1;
    configuration.settings = YAML::Dump(value) + "\n";
  };
  reader.each_key(node, "a configuration", {"name", "settings", "flags"}, use);
  if (configuration.name.empty()) reader.fail(node, "a configuration needs a name");
  return configuration;
}

OtherProgram read_other(const PlanReader& reader, const YAML::Node& node,
                        const BenchmarkPlan& plan) {
  OtherProgram other;
  const auto use = [&](const std::string& key, const YAML::Node& value) {
    if (key == "name") other.name = reader.name(value);
    if (key == "sequence") other.sequence = reader.text(value, key);
    if (key == "mode") other.mode = reader.known_mode(value);
    if (key == "trajectory") other.trajectory = reader.existing(value, key);
  };
  reader.each_key(node, "an entry of others", {"name", "sequence", "mode", "trajectory"}, use);
  if (other.name.empty() || other.trajectory.empty()) {
    reader.fail(node, "an entry of others needs name, sequence, mode and trajectory");
  }
  const auto called = [&](const BenchmarkConfiguration& c) { return c.name == other.name; };
  if (contains({"final", "causal"}, other.name) ||
      std::any_of(plan.configurations.begin(), plan.configurations.end(), called)) {
    reader.fail(node, "the name '{}' is taken; give {} another", other.name,
                other.trajectory.string());
  }
  const auto same = [&](const BenchmarkSequence& s) { return s.name == other.sequence; };
  const auto sequence = std::find_if(plan.sequences.begin(), plan.sequences.end(), same);
  if (sequence == plan.sequences.end()) {
    reader.fail(node, "there is no sequence '{}' for {}", other.sequence, other.name);
  }
  if (std::find(sequence->modes.begin(), sequence->modes.end(), other.mode) ==
      sequence->modes.end()) {
    reader.fail(node, "sequence {} is not run in mode '{}' of {}", other.sequence, other.mode,
                other.name);
  }
  return other;
}

template <class Entry>
void add_unique(const PlanReader& reader, const YAML::Node& node, Entry entry,
                std::vector<Entry>& entries) {
  const auto same = [&](const Entry& e) { return e.name == entry.name; };
  if (std::any_of(entries.begin(), entries.end(), same)) {
    reader.fail(node, "the name '{}' is given twice", entry.name);
  }
  entries.push_back(std::move(entry));
}

YAML::Node parse(const fs::path& file) {
  YAML::Node root;
  try {
    root = YAML::Load(read_text_file(file));
  } catch (const YAML::Exception& error) {
    throw InputError("{}:{}: not valid YAML: {}", file.string(), error.mark.line + 1, error.msg);
  }
  require(root.IsMap(), "{}: holds no keys; see docs/evaluation.md for the format", file.string());
  return root;
}

}  // namespace

std::vector<std::string> to_arguments(const CommandOptions& options) {
  std::vector<std::string> arguments;
  for (const auto& [name, value] : options) {
    arguments.push_back("--" + name);
    if (value) arguments.push_back(*value);
  }
  return arguments;
}

BenchmarkPlan read_benchmark_plan(const fs::path& file) {
  const YAML::Node root = parse(file);
  const PlanReader reader(file);
  BenchmarkPlan plan;
  plan.file = file;
  BenchmarkSequence defaults;
  defaults.seeds = {1};
  YAML::Node sequences, configurations, others;
  const auto use = [&](const std::string& key, const YAML::Node& value) {
    if (key == "output") plan.output = reader.resolve(reader.text(value, key));
    if (key == "repetitions")
      plan.repetitions = static_cast<int>(reader.whole_number(value, key, 1));
    if (key == "modes") defaults.modes = reader.modes(value);
    if (key == "seeds") defaults.seeds = reader.seeds(value);
    if (key == "sequences") sequences.reset(value);
    if (key == "configurations") configurations.reset(value);
    if (key == "others") others.reset(value);
  };
  reader.each_key(
      root, "a benchmark",
      {"output", "repetitions", "modes", "seeds", "sequences", "configurations", "others"}, use);
  if (sequences.IsNull()) reader.fail(root, "'sequences' is missing");
  for (const YAML::Node& node : reader.list(sequences, "sequences")) {
    add_unique(reader, node, read_sequence(reader, node, defaults), plan.sequences);
  }
  if (configurations.IsNull()) {
    plan.configurations.push_back({"default", "", {}, 0});
  } else {
    for (const YAML::Node& node : reader.list(configurations, "configurations")) {
      add_unique(reader, node, read_configuration(reader, node), plan.configurations);
    }
  }
  if (others.IsNull()) return plan;
  for (const YAML::Node& node : reader.list(others, "others")) {
    plan.others.push_back(read_other(reader, node, plan));
  }
  return plan;
}

}  // namespace rover
