#pragma once

#include <string>
#include <vector>

namespace rover {

// Rows of cells as text with aligned columns: the first to the left, the others to the right. Rows
// may differ in length; widths count bytes.
std::string format_rows(const std::vector<std::vector<std::string>>& rows);

}  // namespace rover
