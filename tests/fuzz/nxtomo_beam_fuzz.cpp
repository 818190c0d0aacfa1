// NXtomo in HDF5 read as cone beam by its distances, with and without checksums on its metadata.
#include "tests/fuzz/seeds.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/support/scan_files.hpp"

namespace vdvr::fuzz {
namespace {

void write_distances(support::Hdf5Writer& file) {
  const std::string instrument = support::nxtomo_entry + "/instrument",
                    sample = support::nxtomo_entry + "/sample";
  // A full turn instead of the writer's own.
  H5Ldelete(file.id(), (sample + "/rotation_angle").c_str(), H5P_DEFAULT);
  file.dataset(sample + "/rotation_angle", {8}, {0, 0, 0, 90, 9, 180, 9, 270}, H5T_IEEE_F64LE);
  file.dataset(instrument + "/source/distance", {1}, {-50}, H5T_IEEE_F64LE);
  file.attribute(instrument + "/source/distance", "units", "mm");
  file.dataset(instrument + "/ccd/distance", {1}, {0.025}, H5T_IEEE_F64LE);
  file.dataset(instrument + "/ccd/x_rotation_axis_pixel_position", {1}, {1.25}, H5T_IEEE_F64LE);
  file.dataset(instrument + "/ccd/y_rotation_axis_pixel_position", {1}, {0.5}, H5T_IEEE_F64LE);
  file.dataset(instrument + "/ccd/half_acquisition", {1}, {0}, H5T_STD_U8LE);
  file.dataset(sample + "/z_translation", {8}, std::vector<double>(8, 0.5));
  file.dataset(sample + "/x_pixel_size", {1}, {0.25});
}

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  const auto path = support::write_nxtomo(folder / "seed.nxs", {2, 1, 0, 0, 3, 0, 1, 0}, write_distances);
  return {support::bytes_of(path), in_layout(path, true)};
}

void read(const std::filesystem::path& file) {
  ScanOptions options;
  options.max_memory_bytes = memory_limit;
  options.beam = Beam::cone;
  static_cast<void>(read_scan(file, options));
}

}  // namespace

const Target fuzz_target{"scan.nxs", Contents::hdf5, seeds, read};

}  // namespace vdvr::fuzz
