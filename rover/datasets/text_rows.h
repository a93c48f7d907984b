#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "rover/base/error.h"
#include "rover/base/timestamp.h"
#include "rover/geometry/se3.h"

namespace rover {

// The content of a text file, unpacked if it was packed with gzip. Throws InputError if it cannot
// be read, is cut off or is larger than 1 GiB.
std::string read_text_file(const std::filesystem::path& file);

// One line of a text file that is neither empty nor a comment ('#'). Fields point into the text.
struct TextRow {
  int line = 0;  // from 1
  std::vector<std::string_view> fields;
};

// separator: ',' or ' ' (any run of blanks). Line ends may be those of any system.
std::vector<TextRow> split_rows(std::string_view text, char separator);

// Fields as numbers. They throw InputError saying what is wrong with the field (without the file
// and line, which the caller knows). Numbers are read with '.' in every locale, and are finite.
double parse_number(std::string_view field);
Timestamp parse_seconds_field(std::string_view field);      // not negative, below 2^62 ns
Timestamp parse_nanoseconds_field(std::string_view field);  // likewise
// A quaternion of nearly unit length, normalised.
Eigen::Quaterniond checked_quaternion(double w, double x, double y, double z);
void require_fields(const TextRow& row, std::size_t count);

// What was left out of one file: counted, the first reason kept.
class Omissions {
 public:
  explicit Omissions(std::filesystem::path file) : file_(std::move(file)) {}

  void add(int line, std::string_view reason);
  // The line that is about to be left out only says again what the one before said: that does no
  // harm, however often.
  void expect_repetition() { ++repeated_; }
  int count() const { return count_; }
  // Adds one line to the notes if anything was left out. Throws InputError unless more was kept
  // than left out, repetitions apart: then the file is not what it should be.
  void finish(std::size_t kept, std::vector<std::string>* notes) const;

 private:
  std::filesystem::path file_;
  int count_ = 0;
  int repeated_ = 0;  // of them
  std::string first_;
};

// One value per row by `parse`, which throws InputError for rows that it cannot read. These rows,
// and those whose time does not increase, are left out.
template <class T, class Parse>
std::vector<T> read_timed_rows(const std::filesystem::path& file, char separator,
                               const Parse& parse, std::vector<std::string>* notes) {
  const std::string text = read_text_file(file);
  Omissions omissions(file);
  std::vector<T> values;
  int last_line = 0;
  for (const TextRow& row : split_rows(text, separator)) {
    try {
      T value = parse(row);
      const Timestamp last = values.empty() ? value.time - 1 : values.back().time;
      if (value.time == last) omissions.expect_repetition();
      require(last < value.time, "its time stamp does not lie after that of line {}", last_line);
      values.push_back(std::move(value));
      last_line = row.line;
    } catch (const InputError& error) {
      omissions.add(row.line, error.what());
    }
  }
  omissions.finish(values.size(), notes);
  return values;
}

}  // namespace rover
