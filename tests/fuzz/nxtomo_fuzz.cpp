// NXtomo in HDF5, with and without checksums on its metadata.
#include "tests/fuzz/seeds.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/support/scan_files.hpp"

namespace vdvr::fuzz {
namespace {

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  const auto path = support::write_nxtomo(folder / "seed.nxs");
  return {support::bytes_of(path), in_layout(path, true)};
}

void read(const std::filesystem::path& file) {
  ScanOptions options;
  options.max_memory_bytes = memory_limit;
  static_cast<void>(read_scan(file, options));
}

}  // namespace

const Target fuzz_target{"scan.nxs", Contents::hdf5, seeds, read};

}  // namespace vdvr::fuzz
