// A plain folder of images, sorted by name, with a calibration file beside it.
#include <algorithm>
#include <array>
#include <cctype>

#include "rover/base/error.h"
#include "rover/datasets/image_names.h"
#include "rover/datasets/sequence.h"
#include "rover/datasets/text_rows.h"

namespace rover {
namespace {

namespace fs = std::filesystem;

constexpr double kDefaultRate = 30;            // Hz
constexpr std::size_t kNanosecondDigits = 15;  // shorter numbers are counters

bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::size_t digits_at(const std::string& text, std::size_t at) {
  std::size_t end = at;
  while (end < text.size() && is_digit(text[end])) ++end;
  return end - at;
}

// "frame9" before "frame10": runs of digits compare as numbers.
bool natural_less(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    const std::size_t n = digits_at(a, i), m = digits_at(b, j);
    if (n > 0 && m > 0) {
      const auto x = a.substr(i, n), y = b.substr(j, m);
      const auto x_value = x.substr(std::min(x.find_first_not_of('0'), x.size()));
      const auto y_value = y.substr(std::min(y.find_first_not_of('0'), y.size()));
      if (x_value.size() != y_value.size()) return x_value.size() < y_value.size();
      if (x_value != y_value) return x_value < y_value;
      i += n, j += m;
    } else if (a[i] != b[j]) {
      return a[i] < b[j];
    } else {
      ++i, ++j;
    }
  }
  return a.size() - i != b.size() - j ? a.size() - i < b.size() - j : a < b;
}

std::vector<fs::path> list_images(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (has_image_name(entry.path())) files.push_back(entry.path());
  }
  require(!files.empty(), "{}: holds no image files (.png, .jpg, .pgm, .bmp, .tif)",
          folder.string());
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return files;
}

// The name as nanoseconds ("1403715285262142976") or seconds ("1305031102.175304").
std::optional<Timestamp> stamp_of(const fs::path& file) {
  const std::string stem = file.stem().string();
  const bool point = stem.find('.') != std::string::npos;
  if (!point && stem.size() < kNanosecondDigits) return std::nullopt;
  try {
    return point ? parse_seconds_field(stem) : parse_nanoseconds_field(stem);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

std::vector<SequenceFrame> stamp_by_rate(const std::vector<fs::path>& files, double rate) {
  std::vector<SequenceFrame> frames;
  for (const fs::path& file : files) {
    frames.push_back({from_seconds(static_cast<double>(frames.size()) / rate), {file}});
  }
  return frames;
}

std::vector<SequenceFrame> stamp_by_name(const std::vector<fs::path>& files,
                                         std::vector<std::string>& notes) {
  std::vector<SequenceFrame> frames;
  std::size_t unnamed = 0;
  for (const fs::path& file : files) {
    if (const auto stamp = stamp_of(file)) {
      frames.push_back({*stamp, {file}});
    } else {
      ++unnamed;
    }
  }
  if (unnamed > 0) {
    notes.push_back(fmt::format("{} images left out: their names are no time stamps", unnamed));
  }
  std::stable_sort(frames.begin(), frames.end(),
                   [](const SequenceFrame& a, const SequenceFrame& b) { return a.time < b.time; });
  const auto same = [](const SequenceFrame& a, const SequenceFrame& b) { return a.time == b.time; };
  const auto end = std::unique(frames.begin(), frames.end(), same);
  if (end != frames.end()) {
    notes.push_back(
        fmt::format("{} images left out: their time stamps repeat", frames.end() - end));
  }
  frames.erase(end, frames.end());
  return frames;
}

std::vector<SequenceFrame> stamp_frames(const std::vector<fs::path>& files,
                                        const DatasetOptions& options,
                                        std::vector<std::string>& notes) {
  const auto stamped = std::count_if(files.begin(), files.end(),
                                     [](const fs::path& file) { return stamp_of(file); });
  if (options.frame_rate > 0) return stamp_by_rate(files, options.frame_rate);
  if (2 * stamped > std::ssize(files)) return stamp_by_name(files, notes);
  notes.push_back(fmt::format("{}: file names are no time stamps; {} Hz is assumed",
                              options.path.string(), kDefaultRate));
  return stamp_by_rate(files, kDefaultRate);
}

}  // namespace

Sequence read_folder_sequence(const DatasetOptions& options) {
  require_monocular(options, "a plain folder of images");
  require(options.calibration.has_value(),
          "{}: a plain folder of images says nothing about its camera; give --calibration FILE",
          options.path.string());
  Sequence sequence;
  const RigCalibration calibration = read_rig_calibration(*options.calibration);
  sequence.rig = {{calibration.rig.cameras.front()}, {SE3()}};
  sequence.frames = stamp_frames(list_images(options.path), options, sequence.notes);
  return sequence;
}

}  // namespace rover
