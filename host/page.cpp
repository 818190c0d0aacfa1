#include "host/page.hpp"

#include <fmt/format.h>

#include <cstdint>

#include "host/picture/png.hpp"

namespace vdvr {

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  return out;
}

std::string base64(const std::string& bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t k) -> std::uint32_t {
      return i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u;
    };
    const std::uint32_t group = byte(0) << 16 | byte(1) << 8 | byte(2);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k > bytes.size() ? '=' : kDigits[group >> (18 - 6 * k) & 63];
  }
  return out;
}

namespace {

constexpr const char* kStyle = R"(
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; max-width: 72rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.7rem; } h2 { font-size: 1.25rem; margin-top: 2.6rem; border-bottom: 1px solid #ccc; }
figure { margin: 1.2rem 0; } figcaption, caption { color: #444; font-size: .92rem; text-align: left; }
caption { padding: .3rem 0; } img, svg { max-width: 100%; height: auto; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .9rem; margin: 1rem 0; }
th, td { border: 1px solid #ccc; padding: .25rem .55rem; vertical-align: top; text-align: left; }
th { background: #f1f1f1; }
)";

std::string paragraph(const std::string& text) { return "<p>" + escaped(text) + "</p>\n"; }

std::string row_html(const std::vector<std::string>& cells, const char* tag) {
  std::string out = "<tr>";
  for (const auto& cell : cells) out += fmt::format("<{0}>{1}</{0}>", tag, escaped(cell));
  return out + "</tr>\n";
}

std::string table_html(const PageTable& table) {
  std::string out = "<div class=\"wide\"><table><caption>" + escaped(table.caption) + "</caption>\n" +
                    row_html(table.header, "th");
  for (const auto& row : table.rows) out += row_html(row, "td");
  return out + "</table></div>\n";
}

std::string picture_html(const PagePicture& picture) {
  return fmt::format(
      "<figure><img width=\"{}\" height=\"{}\" alt=\"{}\" src=\"data:image/png;base64,{}\">\n"
      "<figcaption>{}</figcaption></figure>\n",
      picture.image.width, picture.image.height, escaped(picture.name),
      base64(encode_png(picture.name, picture.image)), escaped(picture.caption));
}

std::string section_html(const PageSection& section) {
  std::string out = "<h2>" + escaped(section.title) + "</h2>\n";
  for (const auto& text : section.paragraphs) out += paragraph(text);
  for (const auto& plot : section.plots)
    out += "<figure>" + plot.svg + "<figcaption>" + escaped(plot.caption) + "</figcaption></figure>\n";
  for (const auto& picture : section.pictures) out += picture_html(picture);
  for (const auto& table : section.tables) out += table_html(table);
  for (const auto& text : section.remarks) out += paragraph(text);
  return out;
}

std::string csv_row(const std::vector<std::string>& cells) {
  std::string out;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i != 0) out += ',';
    if (cells[i].find_first_of(",\"\n") == std::string::npos) {
      out += cells[i];
      continue;
    }
    out += '"';
    for (const char c : cells[i]) out += c == '"' ? std::string("\"\"") : std::string(1, c);
    out += '"';
  }
  return out + "\n";
}

}  // namespace

std::string html(const Page& page) {
  std::string out = "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<title>" +
                    escaped(page.title) + "</title>\n<style>" + kStyle + "</style></head><body>\n<h1>" +
                    escaped(page.title) + "</h1>\n";
  for (const auto& text : page.introduction) out += paragraph(text);
  for (const auto& section : page.sections) out += section_html(section);
  return out + "</body></html>\n";
}

std::string csv(const PageTable& table) {
  std::string out = csv_row(table.header);
  for (const auto& row : table.rows) out += csv_row(row);
  return out;
}

}  // namespace vdvr
