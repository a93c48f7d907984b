#include "rover/datasets/atomic_file.h"

#include <fstream>
#include <string>
#include <system_error>

#include "rover/base/error.h"

namespace rover {

void write_file_atomically(const std::filesystem::path& file, std::string_view content) {
  std::filesystem::path part = file;
  part += ".part";
  std::ofstream stream(part, std::ios::binary | std::ios::trunc);
  stream.write(content.data(), static_cast<std::streamsize>(content.size()));
  stream.close();
  std::error_code error;
  if (!stream.fail()) std::filesystem::rename(part, file, error);
  if (!stream.fail() && !error) return;
  std::error_code ignored;
  std::filesystem::remove(part, ignored);
  throw InputError("{}: cannot be written; check that the folder exists, its permissions and space",
                   file.string());
}

}  // namespace rover
