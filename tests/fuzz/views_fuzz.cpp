// VIEWS.json: the pictures that a build is refined for.
#include "tests/fuzz/target.hpp"
#include "vdvr/expert/picture_refinement.hpp"

namespace vdvr::fuzz {
namespace {

std::vector<std::string> seeds(const std::filesystem::path&) {
  return {R"({"views": [{"azimuth": 30, "elevation": -20.5, "zoom": 1.25}]})",
          R"({"size": [256, 128], "tf": "default", "tf_range": [0, 1], "background": [0, 0.5, 1],
 "views": [{"azimuth": 30}, {"position": [0, 200, 0], "focal_point": [0, 0, 0], "view_up": [0, 0, -1],
 "view_angle": 30}]})",
          R"({"background": [0, 0, 0, 1, 1, 1], "views": [{}]})"};
}

void read(const std::filesystem::path& file) { static_cast<void>(read_views(file)); }

}  // namespace

const Target fuzz_target{"views.json", Contents::text, seeds, read};

}  // namespace vdvr::fuzz
