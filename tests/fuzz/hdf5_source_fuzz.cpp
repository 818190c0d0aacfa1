// The source of a virtual dataset, damaged beside a whole virtual file: plain, and through each filter that
// is installed.
#include "tests/fuzz/seeds.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/support/hdf5_sources.hpp"

namespace vdvr::fuzz {
namespace {

// Frames that every filter makes shorter; Blosc leaves those below 128 bytes alone.
const support::Shape shape{4, 8, 16};

std::vector<double> counts() {
  std::vector<double> values(4 * 8 * 16);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = 5000 + static_cast<double>(i % 7);
  return values;
}

void write_whole(const std::filesystem::path& path) {
  support::Hdf5Writer file(path);
  file.group("/exchange");
  file.dataset("/exchange/theta", {4}, {0, 45, 90, 135}, H5T_IEEE_F64LE);
  file.dataset("/exchange/data_white", {1, 8, 16}, std::vector<double>(8 * 16, 10100));
  file.dataset("/exchange/data_dark", {1, 8, 16}, std::vector<double>(8 * 16, 100));
  support::write_virtual(file.id(), "/exchange/data", shape, {{"source.h5", "/data", 4}}, H5T_STD_U16LE);
}

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  write_whole(folder / "scan.h5");
  const auto source = folder / "source.h5";
  { support::Hdf5Writer(source).dataset("/data", shape, counts(), H5T_STD_U16LE); }
  std::vector<std::string> all{support::bytes_of(source), in_layout(source, true)};
  constexpr H5Z_filter_t bzip2 = 307, lzf = 32000, blosc = 32001, lz4 = 32004, bitshuffle = 32008;
  const std::vector<std::pair<H5Z_filter_t, std::vector<unsigned>>> filters{
      {io::hdf5::zstd_filter_number, {}}, {bzip2, {9}}, {lzf, {}},
      {blosc, {0, 0, 0, 0, 5, 1, 0}},     {lz4, {}},    {bitshuffle, {0, 2}}};
  for (const auto& [filter, parameters] : filters) {
    bool written = false;
    {
      support::Hdf5Writer file(source);
      written =
          support::write_filtered(file.id(), "/data", shape, counts(), filter, parameters, H5T_STD_U16LE);
    }
    if (written) all.push_back(support::bytes_of(source));
  }
  return all;
}

void read(const std::filesystem::path& file) {
  ScanOptions options;
  options.max_memory_bytes = memory_limit;
  static_cast<void>(read_scan(file.parent_path() / "scan.h5", options));
}

}  // namespace

const Target fuzz_target{"source.h5", Contents::hdf5, seeds, read};

}  // namespace vdvr::fuzz
