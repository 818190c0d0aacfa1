// NXtomo in HDF5, with and without checksums on its metadata, its frames its own or virtual in another file.
#include "tests/fuzz/seeds.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/support/hdf5_sources.hpp"

namespace vdvr::fuzz {
namespace {

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  const auto path = support::write_nxtomo(folder / "seed.nxs");
  std::vector<std::string> all{support::bytes_of(path), in_layout(path, true)};
  // The frames move into another file, which stays, and a virtual dataset takes their place.
  std::filesystem::copy_file(path, folder / "frames.nxs");
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const std::string data = "/entry1/tomo_entry/instrument/ccd/data";
  H5Ldelete(file, data.c_str(), H5P_DEFAULT);
  support::write_virtual(file, data, {8, support::V, support::U}, {{"frames.nxs", data, 8}});
  H5Fclose(file);
  all.push_back(support::bytes_of(path));
  all.push_back(in_layout(path, true));
  return all;
}

void read(const std::filesystem::path& file) {
  ScanOptions options;
  options.max_memory_bytes = memory_limit;
  static_cast<void>(read_scan(file, options));
}

}  // namespace

const Target fuzz_target{"scan.nxs", Contents::hdf5, seeds, read};

}  // namespace vdvr::fuzz
