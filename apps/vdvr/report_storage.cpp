#include "apps/vdvr/report_storage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "apps/vdvr/html.hpp"
#include "apps/vdvr/output.hpp"
#include "apps/vdvr/report_chart.hpp"

namespace vdvr::cli {
namespace {

struct LevelRow {
  LevelTriple level{};
  std::uint64_t bricks = 0, samples = 0;
};

/// The bricks that read the base first, then by samples stored.
std::vector<LevelRow> level_rows(const MixedVolume& volume) {
  std::map<LevelTriple, LevelRow> found;
  for (const LevelTriple& level : volume.level) {
    LevelRow& row = found[level];
    row.level = level;
    ++row.bricks;
  }
  found[LevelTriple{}].samples = volume.base.size();
  for (const auto& [kind, block] : volume.tiles) found[kind.level].samples += block.size();
  std::vector<LevelRow> rows;
  for (const auto& [level, row] : found) rows.push_back(row);
  std::sort(rows.begin() + 1, rows.end(), [](const auto& a, const auto& b) { return a.samples > b.samples; });
  return rows;
}

/// A sample every so many cells, x, y, z.
std::string level_text(const MixedVolume& volume, const LevelTriple& level) {
  const auto every = [&](std::size_t axis) { return std::ldexp(1.0, volume.coarsening[axis] - level[axis]); };
  return fmt::format("{} \xC3\x97 {} \xC3\x97 {}", every(2), every(1), every(0));
}

/// The last row of `rows` becomes the sum of all from there on; how many these are.
std::size_t merge_rest(std::vector<LevelRow>& rows) {
  constexpr std::size_t most = 12;
  if (rows.size() <= most) return 0;
  const std::size_t others = rows.size() - most + 1;
  for (std::size_t i = most; i < rows.size(); ++i) {
    rows[most - 1].bricks += rows[i].bricks;
    rows[most - 1].samples += rows[i].samples;
  }
  rows.resize(most);
  return others;
}

std::string histogram(const MixedVolume& volume) {
  std::vector<LevelRow> rows = level_rows(volume);
  const std::size_t others = merge_rest(rows);
  std::uint64_t largest = 1;
  for (const LevelRow& row : rows) largest = std::max(largest, row.samples);
  std::string html =
      "<h3>Levels</h3>\n" + table_head({"a sample every x \xC3\x97 y \xC3\x97 z cells", "bricks", "samples"},
                                       /*bars=*/true);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const bool rest = others > 0 && i + 1 == rows.size();
    const std::string name = rest     ? fmt::format("{} other levels", others)
                             : i == 0 ? level_text(volume, rows[i].level) + " (the base)"
                                      : level_text(volume, rows[i].level);
    html += table_row(name, {count_html(rows[i].bricks), count_html(rows[i].samples)},
                      stacked_bar({{name, kGrid, static_cast<double>(rows[i].samples)}},
                                  static_cast<double>(largest), 0, name + ": samples"));
  }
  return html + table_end +
         fmt::format(
             "<p class=\"note\">A brick has {0} \xC3\x97 {0} \xC3\x97 {0} cells. "
             "The base has samples "
             "everywhere; bricks of other levels have their own beside it.</p>\n",
             volume.granularity);
}

}  // namespace

std::string storage_section(const RunReport& run) {
  const MixedVolume& volume = run.volume;
  const Storage all = storage_of(volume, false), interior = storage_of(volume, true);
  const auto samples = static_cast<std::uint64_t>(volume.grid.sample_count());
  const std::uint64_t bytes = samples * sizeof(float);
  const auto stored =
      static_cast<std::uint64_t>(std::llround(all.samples_ratio * static_cast<double>(samples)));
  std::string html =
      "<section>\n<h2>Storage</h2>\n" + table_head({"", "uniform float32 grid", "certified volume", "ratio"});
  const auto row = [&](const std::string& name, const std::string& uniform, const std::string& ours,
                       double ratio) {
    html += table_row(name, {uniform, ours, percent(ratio, 1)});
  };
  row("samples, with the index", count_html(samples), count_html(stored), all.samples_ratio);
  row("bytes on the device", bytes_text(bytes), bytes_text(all.device_bytes), all.bytes_ratio);
  row("bytes in the file", bytes_text(bytes), bytes_text(run.file_bytes),
      static_cast<double>(run.file_bytes) / static_cast<double>(bytes));
  html += table_end;
  const double full = static_cast<double>(bytes);
  html += fmt::format(
      "<div class=\"row\"><span>uniform float32 grid</span><span>{}</span></div>{}\n", bytes_text(bytes),
      stacked_bar({{"uniform float32 grid", "#9aa3ad", full}}, full, 0, "uniform float32 grid"));
  html +=
      fmt::format("<div class=\"row\"><span>certified volume on the device</span><span>{}</span></div>{}\n",
                  bytes_text(all.device_bytes),
                  stacked_bar({{"certified volume", kGrid, static_cast<double>(all.device_bytes)}}, full, 0,
                              "certified volume on the device"));
  html += fmt::format(
      "<p class=\"note\">Of the interior, without the empty rim: {} of the samples, {} of the bytes. The "
      "uniform "
      "grid alone carries no certificate.</p>\n",
      percent(interior.samples_ratio, 1), percent(interior.bytes_ratio, 1));
  return html + histogram(volume) + "</section>\n";
}

}  // namespace vdvr::cli
