// The certified volume: deflated and not, with integer samples, and rewritten in the old HDF5 layout, where a
// damaged byte of metadata meets no checksum. Read as the commands do: seal and content hash are compared.
#include "tests/fuzz/seeds.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/support/certificates.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "vdvr/error.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr::fuzz {
namespace {

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  const auto path = folder / "seed.vdvr";
  const MixedVolume floats = support::random_mixed({{5, 4, 3}, {0, 1, 2}, {1, 1, 1}, "mm"}, 2, 4,
                                                   {{0, 0, 0}, {1, 1, 1}, {0, 2, 1}}, 5);
  std::vector<std::string> all;
  for (const MixedVolume& v :
       {floats, support::in_types(floats, {SampleType::u16, SampleType::u8, SampleType::u16})})
    for (const Compression compression : {Compression::deflate, Compression::none}) {
      write_vdvr(path, v, support::full_certificate(), compression);
      all.push_back(support::bytes_of(path));
      all.push_back(in_layout(path, false));
    }
  return all;
}

void read(const std::filesystem::path& file) {
  if (!is_vdvr(file)) throw FileError(file.string() + ": is no certified volume");
  static_cast<void>(read_vdvr(file, memory_limit));
}

}  // namespace

const Target fuzz_target{"volume.vdvr", Contents::hdf5, seeds, read};

}  // namespace vdvr::fuzz
