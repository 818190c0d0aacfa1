// A stack of line integrals [angle][v][u] in MetaImage or NRRD, its angles in a text file. Called by
// read_scan.
#include "host/scan/raster_scan.hpp"

#include <fmt/format.h>

#include <charconv>
#include <fstream>
#include <memory>

#include "host/io/raster_file.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {

std::vector<double> read_numbers(const std::filesystem::path& path) {
  std::error_code error;
  std::ifstream file(path);
  if (!std::filesystem::is_regular_file(path, error) || !file)
    throw FileError(path.string() + ": the file of angles cannot be opened");
  std::vector<double> values;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    line.erase(std::min(line.find('#'), line.size()));
    for (std::size_t start = line.find_first_not_of(" \t\r,;"); start != std::string::npos;) {
      const std::size_t end = std::min(line.find_first_of(" \t\r,;", start), line.size());
      const char* first = line.data() + start + (line[start] == '+' ? 1 : 0);
      const char* last = line.data() + end;
      double value = 0;
      const auto [rest, code] = std::from_chars(first, last, value);
      if (code != std::errc() || rest != last)
        throw FileError(fmt::format("{}: line {}: '{}' is not a number", path.string(), number,
                                    line.substr(start, std::min<std::size_t>(end - start, 40))));
      values.push_back(value);
      start = line.find_first_not_of(" \t\r,;", end);
    }
  }
  if (values.empty()) throw FileError(path.string() + ": holds no angles");
  return values;
}

RawScan open_raster_stack(const std::filesystem::path& path, std::uint64_t max_memory_bytes) {
  RawScan scan;
  const auto samples = std::make_shared<RasterSamples>(read_raster_header(path), max_memory_bytes);
  const RasterHeader& header = samples->header();
  if (!header.axes.are_plain())
    throw FileError(
        path.string() +
        ": its axes are turned or mirrored, which a stack of projections cannot be; write it "
        "with its columns "
        "projections cannot be; write columns first, rows second and views third, without directions");
  scan.format = header.format;
  scan.columns = header.samples[0];
  scan.rows = header.samples[1];
  scan.counts = false;
  scan.integer = header.kind != ScalarKind::floating;
  scan.pitch_u = header.spacing[0];
  scan.pitch_v = header.spacing[1];
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

RawScan open_raster_scan(const std::filesystem::path& path, const std::filesystem::path& angles_file) {
  RawScan scan = open_raster_stack(path, 0);
  scan.theta_deg = read_numbers(angles_file);
  if (static_cast<std::int64_t>(scan.theta_deg.size()) != scan.projections.count)
    throw FileError(fmt::format("{}: {} angles for the {} views of {}", angles_file.string(),
                                scan.theta_deg.size(), scan.projections.count, path.string()));
  return scan;
}

}  // namespace vdvr::io
