#include "rover/base/timestamp.h"

#include <limits>

#include <gtest/gtest.h>

#include "rover/base/random.h"

namespace rover {
namespace {

TEST(Timestamp, ReadsDecimalsExactly) {
  EXPECT_EQ(parse_seconds("1305031102.175304"), 1305031102175304000);
  EXPECT_EQ(parse_seconds("1403715285.262142976"), 1403715285262142976);
  EXPECT_EQ(parse_seconds("1.037359e-01"), 103735900);
  EXPECT_EQ(parse_seconds("0.000000e+00"), 0);
  EXPECT_EQ(parse_seconds("1.4e9"), 1400000000000000000);
  EXPECT_EQ(parse_seconds("-0.5"), -500000000);
  EXPECT_EQ(parse_seconds("12"), 12000000000);
  EXPECT_EQ(parse_seconds("0.0000000015"), 2);
  EXPECT_EQ(parse_seconds("0.00000000001"), 0);
}

TEST(Timestamp, RefusesWhatIsNoNumber) {
  for (const char* text :
       {"", ".", "-", "abc", "1.2.3", "1e", "1e999", "nan", "inf", "1 ", "99999999999999999999"}) {
    EXPECT_FALSE(parse_seconds(text)) << text;
  }
  EXPECT_FALSE(parse_nanoseconds("1.5"));
  EXPECT_FALSE(parse_nanoseconds(""));
}

TEST(Timestamp, PrintsWhatItReads) {
  Random random(7);
  for (int i = 0; i < 10000; ++i) {
    const auto time = static_cast<Timestamp>(random.bits() >> (1 + i % 60));
    EXPECT_EQ(parse_seconds(format_seconds(time)), time);
    EXPECT_EQ(parse_seconds(format_seconds(-time)), -time);
  }
  EXPECT_EQ(format_seconds(std::numeric_limits<Timestamp>::min()), "-9223372036.854775808");
}

}  // namespace
}  // namespace rover
