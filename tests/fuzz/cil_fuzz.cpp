// CIL's geometry in JSON.
#include "tests/fuzz/cone_folder.hpp"

namespace vdvr::fuzz {
namespace {

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  write_cone_folder(folder, "cil", "geometry.json");
  const std::string start =
      R"({"source_position": [0, -100.5, 0], "detector_position": [0, 50, 0], "num_pixels": [3, 2])";
  return {start + R"(, "angles": [0, 90, 180, 270], "pixel_size": 0.5, "units": "mm"})",
          start + R"(, "angles": [0, 1.5, 3, 4.5], "angle_unit": "radian", "initial_angle": 0.25,
 "pixel_size": [0.5, 0.25], "origin": "top-right", "detector_direction_x": [1, 0, 0.125],
 "detector_direction_y": [-0.125, 0, 1], "rotation_axis_position": [0.125, 0, 0],
 "rotation_axis_direction": [0.125, 0, 2], "geom_type": "cone", "num_channels": 1,
 "dimension_labels": ["angle", "vertical", "horizontal"]})"};
}

}  // namespace

const Target fuzz_target{"geometry.json", Contents::text, seeds, read_cone_folder};

}  // namespace vdvr::fuzz
