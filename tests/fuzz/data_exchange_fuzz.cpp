// Data Exchange in HDF5: as others write it, compressed, virtual and behind a link, and as we write it.
#include "tests/fuzz/seeds.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/support/hdf5_sources.hpp"

namespace vdvr::fuzz {
namespace {

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  const auto path = folder / "seed.h5", ours = folder / "ours.h5";
  support::write_exchange(path, {});
  std::vector<std::string> all{support::bytes_of(path), in_layout(path, true)};
  write_data_exchange(ours, read_scan(path));
  all.push_back(support::bytes_of(ours));
  {
    support::Hdf5Writer file(path);
    file.group("/exchange");
    write_compressed(file.id(), "/exchange/data", {support::K, support::V, support::U},
                     support::raw_counts());
    file.attribute("/exchange/data", "axes", "theta:y:x");
    file.dataset("/exchange/theta", {support::K}, {0, 45, 90, 135}, H5T_IEEE_F64LE);
    file.attribute("/exchange/theta", "units", "degrees");
    write_compressed(file.id(), "/exchange/data_white", {2, support::V, support::U},
                     std::vector<double>(2 * support::V * support::U, 10100));
    write_compressed(file.id(), "/exchange/data_dark", {2, support::V, support::U},
                     std::vector<double>(2 * support::V * support::U, 100));
  }
  all.push_back(support::bytes_of(path));
  support::write_virtual_exchange(path);  // and two more files, which stay
  all.push_back(support::bytes_of(path));
  all.push_back(in_layout(path, true));
  std::filesystem::copy_file(path, folder / "virtual.h5");
  {
    support::Hdf5Writer file(path);
    support::write_exchange_rest(file);
    support::link_external(file.id(), "/exchange/data", "virtual.h5", "/exchange/data");
  }
  all.push_back(support::bytes_of(path));
  {
    support::Hdf5Writer file(path);
    support::write_exchange_rest(file);
    support::write_filtered(file.id(), "/exchange/data", {support::K, support::V, support::U},
                            support::raw_counts(), io::hdf5::zstd_filter_number);
  }
  all.push_back(support::bytes_of(path));
  return all;
}

void read(const std::filesystem::path& file) {
  ScanOptions options;
  options.max_memory_bytes = memory_limit;
  static_cast<void>(read_scan(file, options));
}

}  // namespace

const Target fuzz_target{"scan.h5", Contents::hdf5, seeds, read};

}  // namespace vdvr::fuzz
