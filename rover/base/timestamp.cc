#include "rover/base/timestamp.h"

#include <algorithm>
#include <charconv>
#include <limits>

#include <fmt/format.h>

namespace rover {
namespace {

constexpr int kDecimals = 9;

// The digits of a decimal number without its point, and the power of ten they are scaled by.
struct Decimal {
  bool negative = false;
  std::string digits;
  int exponent = 0;
};

bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::optional<int> parse_exponent(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (value < -100 || value > 100) return std::nullopt;
  return value;
}

std::optional<Decimal> parse_decimal(std::string_view text) {
  Decimal decimal;
  std::size_t i = 0;
  if (i < text.size() && (text[i] == '-' || text[i] == '+')) decimal.negative = text[i++] == '-';
  bool point = false;
  for (; i < text.size() && (is_digit(text[i]) || (text[i] == '.' && !point)); ++i) {
    if (text[i] == '.') {
      point = true;
    } else {
      decimal.digits += text[i];
      if (point) --decimal.exponent;
    }
  }
  if (decimal.digits.empty()) return std::nullopt;
  if (i == text.size()) return decimal;
  if (text[i] != 'e' && text[i] != 'E') return std::nullopt;
  const auto exponent = parse_exponent(text.substr(i + 1));
  if (!exponent) return std::nullopt;
  decimal.exponent += *exponent;
  return decimal;
}

}  // namespace

std::optional<Timestamp> parse_nanoseconds(std::string_view text) {
  Timestamp value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<Timestamp> parse_seconds(std::string_view text) {
  auto decimal = parse_decimal(text);
  if (!decimal) return std::nullopt;
  const int shift = decimal->exponent + kDecimals;
  std::string digits = decimal->digits;
  bool round_up = false;
  if (shift >= 0) {
    digits.append(static_cast<std::size_t>(shift), '0');
  } else {
    const auto cut = std::min(digits.size(), static_cast<std::size_t>(-shift));
    const auto kept = digits.size() - cut;
    round_up = cut == static_cast<std::size_t>(-shift) && digits[kept] >= '5';
    digits.resize(kept);
  }
  digits.erase(0, std::min(digits.find_first_not_of('0'), digits.size()));
  if (digits.empty()) digits = "0";
  const auto value = parse_nanoseconds(digits);
  if (!value || *value == std::numeric_limits<Timestamp>::max()) return std::nullopt;
  const Timestamp magnitude = *value + (round_up ? 1 : 0);
  return decimal->negative ? -magnitude : magnitude;
}

std::string format_seconds(Timestamp time) {
  const bool negative = time < 0;
  const auto magnitude =
      negative ? 0 - static_cast<std::uint64_t>(time) : static_cast<std::uint64_t>(time);
  constexpr auto kUnit = static_cast<std::uint64_t>(kNanosecondsPerSecond);
  return fmt::format("{}{}.{:09}", negative ? "-" : "", magnitude / kUnit, magnitude % kUnit);
}

}  // namespace rover
