// Transfer functions: our own, 3D Slicer's and ParaView's.
#include "tests/fuzz/target.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr::fuzz {
namespace {

std::vector<std::string> seeds(const std::filesystem::path&) {
  return {R"({"points": [{"value": -1, "rgb": [0, 0.5, 1], "opacity": 0},
 {"value": 2.5, "rgb": [1, 1, 1], "opacity": 0.75}]})",
          R"({"volumeProperties": [{"components": [{"scalarOpacityUnitDistance": 0.5,
 "scalarOpacity": {"points": [{"x": 0, "y": 0, "midpoint": 0.5, "sharpness": 0}, {"x": 100, "y": 0.8}]},
 "rgbTransferFunction": {"points": [{"x": 0, "color": [0, 0, 0]}, {"x": 50, "color": [1, 0.5, 0.25]}]},
 "gradientOpacity": {"points": [{"x": 0, "y": 1.0}]}}]}]})",
          R"([{"Name": "p", "ColorSpace": "Diverging", "NanColor": [1, 1, 0],
 "Points": [0, 0, 0.5, 0, 1, 0.3, 0.5, 0],
 "RGBPoints": [0, 0.2, 0.3, 0.8, 0.5, 0.9, 0.9, 0.9, 1, 0.8, 0.2, 0.1]}])",
          R"([{"ColorSpace": "HSV", "HSVWrap": true, "RGBPoints": [0, 1, 0, 0, 1, 0, 0, 1]}])"};
}

void read(const std::filesystem::path& file) { static_cast<void>(read_transfer_function(file)); }

}  // namespace

const Target fuzz_target{"transfer.json", Contents::text, seeds, read};

}  // namespace vdvr::fuzz
