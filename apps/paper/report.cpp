#include "apps/paper/report.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "vdvr/expert/output_file.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr::paper {
namespace {

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

/// Of a section, what is not in files of its own.
Json section_json(const Section& section) {
  Json tables = Json::array();
  for (const auto& t : section.tables) tables.push_back({{"name", t.name}, {"caption", t.caption}});
  return {{"title", section.title},
          {"paragraphs", section.paragraphs},
          {"figures", section.figures},
          {"tables", tables},
          {"remarks", section.remarks}};
}

/// Figures made of pictures and the most of them in a run.
constexpr std::pair<const char*, int> kPictures[] = {
    {"figure-11", 6}, {"figure-13", 3}, {"figure-14", 9}, {"figure-15", 9}};
constexpr const char* kFields[] = {"figure-5-row",
                                   "figure-5-row-map",
                                   "figure-5-row-product",
                                   "figure-5-projection-spectrum",
                                   "figure-5-projection-map",
                                   "figure-5-projection-product",
                                   "figure-5-volume-spectrum-xy",
                                   "figure-5-volume-spectrum-xz",
                                   "figure-5-volume-spectrum-yz",
                                   "figure-5-volume-map",
                                   "figure-5-volume-product-xy",
                                   "figure-5-volume-product-xz",
                                   "figure-5-volume-product-yz",
                                   "figure-10",
                                   "figure-12-function",
                                   "figure-12-field"};
constexpr const char* kTables[] = {"claims",      "speed",           "figure-3",    "figure-4",  "figure-5",
                                   "figure-10",   "figure-11",       "figure-12",   "figure-14", "table-1",
                                   "table-2-rms", "table-2-storage", "table-2-head"};
/// What scripts/paper-page draws beside the numbers: no page of an older run shall stand beside newer ones.
constexpr const char* kDrawn[] = {"figure-3",
                                  "figure-4",
                                  "figure-5-row",
                                  "figure-5-projection-spectrum",
                                  "figure-5-projection-map",
                                  "figure-5-projection-product",
                                  "figure-5-volume-spectrum",
                                  "figure-5-volume-map",
                                  "figure-5-volume-product",
                                  "figure-10",
                                  "figure-11",
                                  "figure-12-function",
                                  "figure-12-field",
                                  "figure-13",
                                  "figure-14",
                                  "figure-15"};

std::string panel_name(const std::string& figure, std::size_t panel) {
  return fmt::format("{}-{}", figure, panel + 1);
}

}  // namespace

std::string csv(const Table& table) {
  std::string out = csv_row(table.header);
  for (const auto& row : table.rows) out += csv_row(row);
  return out;
}

std::vector<std::string> file_names() {
  std::vector<std::string> names{"paper.json", "paper.html"};
  for (const std::string table : kTables) names.push_back(table + ".csv");
  for (const auto& [figure, most] : kPictures)
    for (int i = 0; i < most; ++i) names.push_back(panel_name(figure, static_cast<std::size_t>(i)) + ".png");
  for (const std::string field : kFields) names.push_back(field + ".npy");
  for (const std::string figure : kDrawn)
    for (const char* ending : {".png", ".svg"}) names.push_back(figure + ending);
  return names;
}

void write_report(const Report& run, cli::OutputFolder& folder) {
  folder.begin();
  try {
    for (const auto& section : run.sections)
      for (const auto& table : section.tables) io::write_file(folder.file(table.name + ".csv"), csv(table));
    for (const auto& [name, image] : run.pictures) write_png(folder.file(name + ".png"), image);
    for (const auto& [name, field] : run.fields) write_npy(folder.file(name + ".npy"), field);
    throw_if_stopped();
    Json sections = Json::array();
    for (const auto& section : run.sections) sections.push_back(section_json(section));
    Json all = run.json;
    all["sections"] = std::move(sections);
    io::write_file(folder.file("paper.json"), all.dump(2) + "\n");
  } catch (...) {
    folder.begin();
    throw;
  }
}

Json pictures_figure(Report& run, const std::string& name, const std::string& caption,
                     std::vector<TitledPicture> pictures, std::size_t across) {
  Json panels = Json::array();
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    panels.push_back({{"title", pictures[i].title}, {"picture", panel_name(name, i) + ".png"}});
    run.pictures.emplace_back(panel_name(name, i), std::move(pictures[i].image));
  }
  return {{"kind", "pictures"}, {"name", name}, {"caption", caption}, {"across", across}, {"panels", panels}};
}

Json slices_figure(Report& run, const std::string& name, const std::string& caption,
                   const std::vector<Slice>& slices, std::int64_t side, const SliceScale& scale) {
  const auto count = slices.size(), pixels = static_cast<std::size_t>(side * side);
  FloatImage field{side, side, std::vector<float>(pixels * count), static_cast<std::int64_t>(count)};
  Json titles = Json::array();
  for (std::size_t p = 0; p < count; ++p) {
    titles.push_back(slices[p].title);
    for (std::size_t i = 0; i < pixels; ++i) field.values[i * count + p] = slices[p].values.at(i);
  }
  run.fields.emplace_back(name, std::move(field));
  return {{"kind", "slices"},       {"name", name},     {"caption", caption}, {"titles", titles},
          {"field", name + ".npy"}, {"low", scale.low}, {"high", scale.high}, {"colours", scale.colours},
          {"label", scale.label}};
}

Json curves_figure(const std::string& name, const std::string& caption, const Curves& plot) {
  Json curves = Json::array();
  for (const auto& c : plot.curves) {
    Json points = Json::array();
    for (const auto& [x, y] : c.points) points.push_back(Json::array({x, y}));
    curves.push_back({{"label", c.label}, {"points", std::move(points)}});
  }
  return {{"kind", "curves"},
          {"name", name},
          {"caption", caption},
          {"title", plot.title},
          {"x", plot.x_label},
          {"y", plot.y_label},
          {"logarithmic", plot.logarithmic},
          {"marks", plot.marks},
          {"curves", curves}};
}

}  // namespace vdvr::paper
