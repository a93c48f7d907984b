#include "rover/evaluation/html.h"

#include <fmt/format.h>

#include "rover/evaluation/svg.h"

namespace rover {
namespace {

constexpr const char* kStyle = R"(
:root { color-scheme: light; }
body { margin: 0; background: #f4f5f7; color: #222;
       font: 15px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
main { max-width: 980px; margin: 0 auto; padding: 28px 20px 60px; }
h1 { font-size: 26px; line-height: 1.25; margin: 0 0 4px; }
h2 { font-size: 18px; margin: 0 0 2px; }
p { margin: 6px 0; }
.sub, .note { color: #666; }
.note { margin: 0 0 12px; font-size: 13.5px; }
section { background: #fff; border: 1px solid #e2e4e8; border-radius: 8px; margin: 18px 0;
          padding: 18px 22px; }
svg { display: block; max-width: 100%; height: auto; margin: 4px auto; }
img { display: block; width: 100%; height: auto; border-radius: 4px; }
figure { margin: 0; }
figcaption { color: #666; font-size: 12.5px; padding-top: 3px; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: 12px;
         margin: 18px 0; }
.tile { background: #fff; border: 1px solid #e2e4e8; border-radius: 8px; padding: 12px 16px; }
.tile b { display: block; font-size: 22px; line-height: 1.3; }
.tile span { color: #666; font-size: 13px; }
.grid { display: grid; grid-template-columns: repeat(auto-fit, minmax(270px, 1fr)); gap: 14px; }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(210px, 1fr));
            gap: 12px; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: 13.5px; font-variant-numeric: tabular-nums; }
th, td { padding: 3px 12px; text-align: right; border-bottom: 1px solid #eceef1;
         white-space: nowrap; }
th { font-weight: 600; }
th:first-child, td:first-child { text-align: left; padding-left: 0; font-weight: 400;
                                 white-space: pre; }
tr:first-child th { border-bottom: 1px solid #999; font-weight: 600; }
details { margin-top: 10px; }
summary { cursor: pointer; color: #1f6fb4; }
a { color: #1f6fb4; }
.failed { color: #b3261e; }
)";

}  // namespace

std::string html_page(const std::string& title, const std::string& body) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<main>\n{}</main>\n</body>\n</"
      "html>\n",
      escape_xml(title), kStyle, body);
}

std::string html_section(const std::string& heading, const std::string& note,
                         const std::string& content) {
  return fmt::format("<section>\n<h2>{}</h2>\n<p class=\"note\">{}</p>\n{}</section>\n",
                     escape_xml(heading), escape_xml(note), content);
}

std::string html_table(const std::vector<std::vector<std::string>>& rows) {
  std::string html = "<div class=\"scroll\"><table>\n";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    html += "<tr>";
    for (std::size_t k = 0; k < rows[i].size(); ++k) {
      const char* tag = i == 0 || k == 0 ? "th" : "td";
      html += fmt::format("<{0}>{1}</{0}>", tag, escape_xml(rows[i][k]));
    }
    html += "</tr>\n";
  }
  return html + "</table></div>\n";
}

std::string html_tile(const std::string& value, const std::string& label) {
  return fmt::format("<div class=\"tile\"><b>{}</b><span>{}</span></div>\n", escape_xml(value),
                     escape_xml(label));
}

std::string html_details(const std::string& title, const std::string& content) {
  return fmt::format("<details><summary>{}</summary>\n{}</details>\n", escape_xml(title), content);
}

}  // namespace rover
