// A stack of line integrals [angle][v][u] in MetaImage or NRRD, its angles in a text file.
#include "host/scan/raw/raster_scan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <memory>
#include <sstream>

#include "host/files/io/number_text.hpp"
#include "host/files/io/raster_file.hpp"
#include "host/files/io/text_encoding.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {

namespace {

// A number, which may be infinite or NaN: whoever takes the list says where such a one lies.
std::optional<double> number_or_nan_of(const std::string& word) {
  const char* first = word.data() + (word[0] == '+' ? 1 : 0);
  double value = 0;
  const auto [rest, code] = std::from_chars(first, word.data() + word.size(), value);
  if (code != std::errc() || rest != word.data() + word.size()) return {};
  return value;
}

// Words between blanks and semicolons, all with one comma within: numbers with decimal commas, where that
// makes a rising or falling list of what would be none as pairs.
std::string decimal_comma(const std::vector<std::string>& words) {
  std::vector<double> whole, pairs;
  for (const std::string& word : words) {
    if (comma_hint(word).empty()) return "";
    std::string point = word;
    const std::size_t comma = word.find(',');
    point[comma] = '.';
    const auto number = number_of(point), first = number_of(word.substr(0, comma)),
               second = number_of(word.substr(comma + 1));
    if (!number || !first || !second) return "";
    whole.push_back(*number);
    pairs.insert(pairs.end(), {*first, *second});
  }
  const auto runs = [](const std::vector<double>& list) {
    return std::is_sorted(list.begin(), list.end()) || std::is_sorted(list.rbegin(), list.rend());
  };
  return words.size() > 1 && runs(whole) && !runs(pairs) ? words.front() + "'" + comma_hint(words.front())
                                                         : "";
}

void split(const std::string& line, const char* between, std::vector<std::string>& words) {
  for (std::size_t start = line.find_first_not_of(between); start != std::string::npos;) {
    const std::size_t end = std::min(line.find_first_of(between, start), line.size());
    words.push_back(line.substr(start, end - start));
    start = line.find_first_not_of(between, end);
  }
}

}  // namespace

std::vector<double> read_numbers(const std::filesystem::path& path) {
  constexpr std::uintmax_t most = 256u << 20;
  std::istringstream file(read_text(path, "the file of numbers", most));
  std::vector<double> values;
  std::vector<std::string> all;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    line.erase(std::min(line.find('#'), line.size()));
    split(line, " \t\r;", all);
    std::vector<std::string> words;
    split(line, " \t\r,;", words);
    for (const std::string& word : words) {
      const auto value = number_or_nan_of(word);
      if (!value)
        throw FileError(
            fmt::format("{}: line {}: '{}' is not a number", path.string(), number, word.substr(0, 40)));
      values.push_back(*value);
    }
  }
  if (values.empty()) throw FileError(path.string() + ": holds no angles");
  if (const std::string comma = decimal_comma(all); !comma.empty())
    throw FileError(fmt::format("{}: '{}; commas stand between numbers here", path.string(), comma));
  return values;
}

RawScan open_raster_stack(const std::filesystem::path& path, std::uint64_t max_memory_bytes) {
  RawScan scan;
  const auto samples = std::make_shared<RasterSamples>(read_raster_header(path), max_memory_bytes);
  const RasterHeader& header = samples->header();
  if (!header.axes.are_plain())
    throw FileError(
        path.string() +
        ": its axes are turned or mirrored (TransformMatrix, space directions), which those of a stack of "
        "projections cannot be; write columns first, rows second and views third, without directions");
  scan.format = header.format;
  scan.columns = header.samples[0];
  scan.rows = header.samples[1];
  scan.integer = header.kind != ScalarKind::floating;
  scan.pitch_u = header.spacing[0];
  scan.pitch_v = header.spacing[1];
  scan.pitch_stated = true;
  if (!header.unit.empty()) scan.unit = header.unit;
  scan.projections.count = header.samples[2];
  const std::int64_t size = scan.rows * scan.columns;
  scan.projections.read = [samples, size](std::int64_t first, std::int64_t n, double* out) {
    samples->read(first * size, n * size, out);
  };
  scan.projections.name = [name = path.string()](std::int64_t k) {
    return fmt::format("{}: view {}", name, k);
  };
  scan.files.emplace_back(path.filename().string(), path);
  if (header.data_file != header.file)
    scan.files.emplace_back(header.data_file.filename().string(), header.data_file);
  return scan;
}

RawScan open_raster_scan(const std::filesystem::path& path, const std::filesystem::path& angles_file,
                         AngleUnit unit) {
  RawScan scan = open_raster_stack(path, 0);
  scan.theta_deg = in_degrees(read_numbers(angles_file), unit);
  if (static_cast<std::int64_t>(scan.theta_deg.size()) != scan.projections.count)
    throw FileError(fmt::format("{}: {} angles for the {} views of {}", angles_file.string(),
                                scan.theta_deg.size(), scan.projections.count, path.string()));
  return scan;
}

}  // namespace vdvr::io
