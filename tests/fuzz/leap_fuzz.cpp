// LEAP's geometries in JSON.
#include "tests/fuzz/cone_folder.hpp"

namespace vdvr::fuzz {
namespace {

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  write_cone_folder(folder, "leap", "geometry.json");
  const std::string start =
      R"({"numAngles": 4, "numRows": 2, "numCols": 3, "pixelHeight": 0.25, "pixelWidth": 0.5)";
  return {start + R"(, "centerRow": 0.5, "centerCol": 1, "phis": [0, 90, 180, 270], "sod": 100.5, "sdd": 150,
 "tau": 0.125, "helicalPitch": 0, "tiltAngle": 1.5, "detectorType": "FLAT", "geometry": "CONE"})",
          start + R"(, "centerRow": 0.5, "centerCol": 1, "angularRange": 360, "sod": 100, "sdd": 150})",
          start + R"(, "sourcePositions": [[0, -9, 0], [9, 0, 0], [0, 9, 0], [-9, 0, 0]],
 "moduleCenters": [[0, 5, 0], [-5, 0, 0], [0, -5, 0], [5, 0, 0]],
 "rowVectors": [[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1]],
 "colVectors": [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]})"};
}

}  // namespace

const Target fuzz_target{"geometry.json", Contents::text, seeds, read_cone_folder};

}  // namespace vdvr::fuzz
