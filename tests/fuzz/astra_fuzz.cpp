// ASTRA's cone-beam geometries in JSON.
#include "tests/fuzz/cone_folder.hpp"

namespace vdvr::fuzz {
namespace {

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  write_cone_folder(folder, "astra", "geometry.json");
  const std::string sides = R"("DetectorRowCount": 2, "DetectorColCount": 3)";
  return {R"({"type": "cone", "DetectorSpacingX": 0.5, "DetectorSpacingY": 0.25, )" + sides +
              R"(, "ProjectionAngles": [0, 1.5, 3, 4.5], "DistanceOriginSource": 100,
 "DistanceOriginDetector": 50})",
          R"({"type": "cone_vec", )" + sides + R"(, "Vectors": [
[0, -100, 0, 0, 50, 0, 0.5, 0, 0, 0, 0, 0.25], [100, 0, 0, -50, 0, 0, 0, 0.5, 0, 0, 0, 0.25],
[0, 100, 0, 0, -50, 0, -0.5, 0, 0, 0, 0, 0.25], [-100, 0, 0, 50, 0, 0, 0, -0.5, 0, 0, 0, 0.25]]})"};
}

}  // namespace

const Target fuzz_target{"geometry.json", Contents::text, seeds, read_cone_folder};

}  // namespace vdvr::fuzz
