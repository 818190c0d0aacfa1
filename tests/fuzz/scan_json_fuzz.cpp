// scan.json over a folder of TIFF frames, with and without cone-beam geometry, and over an HDF5 file beside
// it.
#include "tests/fuzz/target.hpp"
#include "tests/support/scan_files.hpp"

namespace vdvr::fuzz {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> seeds(const fs::path& folder) {
  const support::TemporaryFolder made;
  nlohmann::json tiffs = support::write_folder(made);
  fs::copy(made.path(), folder, fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  support::write_exchange(folder / "scan.h5", {});
  nlohmann::json more = tiffs;
  more["center"] = 1.25;
  more["pitch"] = {0.5, 0.75};
  more["unit"] = "mm";
  more["use"] = {1, 4};
  more["air_columns"] = {{0, 1}};
  const nlohmann::json hdf5{
      {"hdf5", "scan.h5"}, {"angles", {0, 45.5, 90, 135}}, {"center", 1}, {"comment", "none"}};
  nlohmann::json cone = tiffs;
  cone.erase("angles");
  cone.erase("angle_range");
  cone["redundancy"] = "full-turn";
  cone["geometry"] = {
      {"source_to_axis", 50}, {"source_to_detector", 100.5}, {"pitch", {0.5, 0.75}}, {"center", 1.25},
      {"row", 0.5},           {"angles", {0, 90, 180, 270}}, {"tilt", {1, -2}},      {"sense", -1},
      {"offset_u", 0.125}};
  nlohmann::json stated = hdf5;
  stated["flats"] = 4000.5;
  stated["darks"] = "none";
  stated["description"] = "counts";
  stated["entry"] = "exchange";
  stated["use"] = {{0, 1}, {2, 4}};
  nlohmann::json named = tiffs;
  named.erase("angle_range");
  named["angles"] = "names";
  named["darks"] = 1;
  return {tiffs.dump(1), more.dump(1), hdf5.dump(1), cone.dump(1), stated.dump(1), named.dump(1)};
}

void read(const fs::path& file) {
  ScanOptions options;
  options.max_memory_bytes = memory_limit;
  static_cast<void>(read_scan(file.parent_path(), options));
}

}  // namespace

const Target fuzz_target{"scan.json", Contents::text, seeds, read};

}  // namespace vdvr::fuzz
