#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace rover {

// Base 64 of RFC 4648, with padding.
std::string base64(std::span<const std::uint8_t> bytes);

// The bytes as an address that pages can show without another file.
std::string data_url(const std::string& type, std::span<const std::uint8_t> bytes);

}  // namespace rover
