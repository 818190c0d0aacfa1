// NRRD, plain and compressed.
#include "tests/fuzz/raster_fuzz.hpp"
#include "tests/fuzz/target.hpp"

namespace vdvr::fuzz {
namespace {

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  write_angles(folder);
  const std::string start =
      "NRRD0004\n# a comment\ntype: unsigned short\ndimension: 3\nspace dimension: 3\nsizes: 4 2 3\n"
      "space directions: (0.5,0,0) (0,2,0) (0,0,1)\nkinds: domain domain domain\n"
      "space units: \"mm\" \"mm\" \"mm\"\nendian: little\nspace origin: (0,-1,2.5)\nmodality:=CT\n";
  return {start + "encoding: raw\n\n" + std::string(48, 'r'),
          start + "encoding: gzip\n\n" + deflated(std::string(48, 'z')),
          "NRRD0005\ntype: float\ndimension: 3\nsizes: 4 2 3\nspacings: 1 1 2\nendian: big\nencoding: raw\n"
          "byte skip: -1\n\n" +
              std::string(96, '\2')};
}

void read(const std::filesystem::path& file) { read_raster(file, memory_limit); }

}  // namespace

const Target fuzz_target{"volume.nrrd", Contents::text, seeds, read};

}  // namespace vdvr::fuzz
