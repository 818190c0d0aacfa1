// TIGRE's geometry in JSON.
#include "tests/fuzz/cone_folder.hpp"

namespace vdvr::fuzz {
namespace {

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  write_cone_folder(folder, "tigre", "geometry.json");
  const std::string start =
      R"({"mode": "cone", "DSD": 150, "DSO": 100.5, "nDetector": [2, 3], "dDetector": [0.25, 0.5])";
  return {start +
              R"(, "angles": [0, 1.5, 3, 4.5], "offDetector": [0.125, 0],
 "rotDetector": [0, 0, 0], "COR": 0.25})",
          start + R"(, "angles": [[0, 0, 0], [1.5, 0, 0], [3, 0, 0], [4.5, 0, 0]],
 "offDetector": [[0, 0], [0, 0.125], [0.25, 0], [0, 0]], "accuracy": 0.5, "nVoxel": [2, 2, 2]})"};
}

}  // namespace

const Target fuzz_target{"geometry.json", Contents::text, seeds, read_cone_folder};

}  // namespace vdvr::fuzz
