#include "rover/datasets/text_rows.h"

#include <zlib.h>

#include <array>
#include <charconv>
#include <cmath>
#include <memory>
#include <system_error>

namespace rover {
namespace {

constexpr std::uintmax_t kMaxBytes = std::uintmax_t{1} << 30;
constexpr Timestamp kMaxTime = Timestamp{1} << 62;  // so that differences of stamps always fit
constexpr std::string_view kBlank = " \t\r\v\f";
constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";

std::string_view trim(std::string_view text) {
  const auto begin = text.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

std::vector<std::string_view> split_blank(std::string_view line) {
  std::vector<std::string_view> fields;
  while (!(line = trim(line)).empty()) {
    const auto end = std::min(line.find_first_of(kBlank), line.size());
    fields.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
  return fields;
}

std::vector<std::string_view> split_comma(std::string_view line) {
  std::vector<std::string_view> fields;
  for (;;) {
    const auto end = line.find(',');
    fields.push_back(trim(line.substr(0, end)));
    if (end == std::string_view::npos) return fields;
    line.remove_prefix(end + 1);
  }
}

// Fields come from files: they are shown short and printable.
std::string shown(std::string_view field) {
  std::string text(field.substr(0, 30));
  for (char& c : text) {
    if (c < ' ' || c > '~') c = '?';
  }
  return text;
}

Timestamp checked_time(std::optional<Timestamp> time, std::string_view field) {
  require(time.has_value(), "'{}' is not a time stamp", shown(field));
  require(*time >= 0 && *time < kMaxTime, "time stamp {} is out of range", shown(field));
  return *time;
}

struct CloseGzip {
  void operator()(gzFile file) const { gzclose(file); }
};
using GzipFile = std::unique_ptr<gzFile_s, CloseGzip>;

// False at the end and on errors, which gzerror() tells apart.
bool append_block(gzFile stream, std::string& text) {
  std::array<char, 1 << 16> block;
  const int count = gzread(stream, block.data(), static_cast<unsigned>(block.size()));
  if (count > 0) text.append(block.data(), static_cast<std::size_t>(count));
  return count > 0;
}

}  // namespace

std::string read_text_file(const std::filesystem::path& file) {
  std::error_code error;
  require(std::filesystem::is_regular_file(file, error),
          "{}: no such file; check the path and that the dataset is complete", file.string());
  const auto size = std::filesystem::file_size(file, error);
  require(!error && size <= kMaxBytes, "{}: too large for a text file", file.string());
  const GzipFile stream(gzopen(file.c_str(), "rb"));
  require(stream != nullptr, "{}: cannot be read; check its permissions", file.string());
  std::string text;
  while (append_block(stream.get(), text)) {
    require(text.size() <= kMaxBytes, "{}: too large for a text file", file.string());
  }
  int code = Z_OK;
  gzerror(stream.get(), &code);
  require(code == Z_OK, "{}: cannot be read; check its permissions and that it is whole",
          file.string());
  return text;
}

std::vector<TextRow> split_rows(std::string_view text, char separator) {
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  std::vector<TextRow> rows;
  for (int number = 1; !text.empty(); ++number) {
    const auto end = std::min(text.find('\n'), text.size());
    const std::string_view line = trim(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty() || line.front() == '#') continue;
    rows.push_back({number, separator == ',' ? split_comma(line) : split_blank(line)});
  }
  return rows;
}

double parse_number(std::string_view field) {
  if (field.starts_with('+')) field.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  require(error == std::errc() && end == field.data() + field.size() && std::isfinite(value),
          "'{}' is not a number", shown(field));
  return value;
}

Timestamp parse_seconds_field(std::string_view field) {
  return checked_time(parse_seconds(field), field);
}

Timestamp parse_nanoseconds_field(std::string_view field) {
  return checked_time(parse_nanoseconds(field), field);
}

Eigen::Quaterniond checked_quaternion(double w, double x, double y, double z) {
  const Eigen::Quaterniond quaternion(w, x, y, z);
  // Files round to as few as four digits; anything farther off is not a rotation.
  require(std::abs(quaternion.norm() - 1) < 0.05, "its quaternion does not have length 1");
  return quaternion.normalized();
}

void require_fields(const TextRow& row, std::size_t count) {
  require(row.fields.size() >= count, "{} fields instead of {}", row.fields.size(), count);
}

void Omissions::add(int line, std::string_view reason) {
  if (count_++ == 0) first_ = fmt::format("line {}: {}", line, reason);
}

void Omissions::finish(std::size_t kept, std::vector<std::string>* notes) const {
  require(kept > 0 || count_ > 0, "{}: holds no data; check that the dataset is complete",
          file_.string());
  require(kept > static_cast<std::size_t>(count_ - repeated_),
          "{}: {} of {} lines cannot be used (first: {}); check the format", file_.string(), count_,
          kept + static_cast<std::size_t>(count_), first_);
  if (count_ == 0 || notes == nullptr) return;
  notes->push_back(fmt::format("{}: {} of {} lines left out (first: {})", file_.string(), count_,
                               kept + static_cast<std::size_t>(count_), first_));
}

}  // namespace rover
