#pragma once

#include <string>
#include <vector>

namespace rover {

// A page of its own: style included, nothing outside of it referred to.
std::string html_page(const std::string& title, const std::string& body);

// A part with a heading and, below it, a sentence on what is to be seen.
std::string html_section(const std::string& heading, const std::string& note,
                         const std::string& content);

// Cells are escaped; the first row and the first column are headings.
std::string html_table(const std::vector<std::vector<std::string>>& rows);

// A number in large print with what it is.
std::string html_tile(const std::string& value, const std::string& label);

// Something that is shown when its title is clicked.
std::string html_details(const std::string& title, const std::string& content);

}  // namespace rover
