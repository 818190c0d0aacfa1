// A page of results: sections of text, tables, plots and pictures as one self-contained HTML file, its tables
// as CSV too. Called by the command bench paper.
#pragma once

#include <string>
#include <vector>

#include "vdvr/image.hpp"

namespace vdvr {

struct PageTable {
  std::string name;  ///< of the CSV file, without its extension
  std::string caption;
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;  ///< each as long as the header
};
struct PagePicture {
  std::string name;  ///< of the PNG file, without its extension
  std::string caption;
  Image image;
};
struct PagePlot {
  std::string name;  ///< of the SVG file, without its extension
  std::string caption;
  std::string svg;
};
struct PageSection {
  std::string title;
  std::vector<std::string> paragraphs;
  std::vector<PagePlot> plots;
  std::vector<PagePicture> pictures;
  std::vector<PageTable> tables;
  std::vector<std::string> remarks;  ///< below the tables: where and why numbers differ
};
struct Page {
  std::string title;
  std::vector<std::string> introduction;
  std::vector<PageSection> sections;
};

/// The text with the five characters replaced that mean something in HTML and SVG.
std::string escaped(const std::string& text);
/// RFC 4648, padded.
std::string base64(const std::string& bytes);

/// Pictures as PNG data URIs, plots inline, no script, nothing fetched. Throws InputError for an empty
/// picture.
std::string html(const Page& page);
/// RFC 4180: header and rows, quoted where they need it.
std::string csv(const PageTable& table);

}  // namespace vdvr
