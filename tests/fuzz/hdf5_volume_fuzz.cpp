// A volume in a dataset of an HDF5 file.
#include <numeric>

#include "tests/fuzz/seeds.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/support/scan_files.hpp"
#include "vdvr/expert/volume_file.hpp"

namespace vdvr::fuzz {
namespace {

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  const auto path = folder / "seed.h5";
  {
    support::Hdf5Writer file(path);
    write_compressed(file.id(), "/data", {4, 3, 5}, std::vector<double>(60, 7));
    file.attribute("/data", "unit", "mm");
  }
  std::vector<std::string> all{support::bytes_of(path), in_layout(path, true)};
  {
    support::Hdf5Writer file(path);
    file.dataset("/data", {4, 3, 5}, std::vector<double>(60, 0.5));
  }
  all.push_back(support::bytes_of(path));
  {
    support::Hdf5Writer file(path);
    std::vector<double> ramp(60);
    std::iota(ramp.begin(), ramp.end(), 100);
    write_compressed(file.id(), "/data", {4, 3, 5}, ramp, true);
  }
  all.push_back(support::bytes_of(path));
  return all;
}

void read(const std::filesystem::path& file) {
  static_cast<void>(read_volume(file.string() + ":/data", memory_limit));
}

}  // namespace

const Target fuzz_target{"volume.h5", Contents::hdf5, seeds, read};

}  // namespace vdvr::fuzz
