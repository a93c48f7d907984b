#pragma once

#include <filesystem>
#include <string_view>

namespace rover {

// Writes under a temporary name in the same folder and renames, so that a reader (or a crash) sees
// the old file or the whole new one. Throws InputError saying what to check.
void write_file_atomically(const std::filesystem::path& file, std::string_view content);

}  // namespace rover
