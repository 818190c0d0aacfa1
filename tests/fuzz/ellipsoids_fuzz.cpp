// The JSON of ellipsoid phantoms.
#include "tests/fuzz/target.hpp"
#include "vdvr/expert/simulate.hpp"

namespace vdvr::fuzz {
namespace {

std::vector<std::string> seeds(const std::filesystem::path&) {
  return {R"({"ellipsoids": [{"density": 1, "center": [0, 0.5, -1], "semi_axes": [3, 2, 1], "phi_deg": 30},
 {"density": -0.25, "center": [1e-3, 0, 0], "semi_axes": [0.5, 0.5, 0.5]}], "background": 0})",
          R"({"ellipsoids": [{"density": 2e3, "center": [0,0,0], "semi_axes": [1,1,1], "comment": "one"}],
 "name": "ball"})"};
}

void read(const std::filesystem::path& file) {
  const Phantom phantom = read_phantom(file);
  static_cast<void>(phantom.density({0.1, 0.2, 0.3}));
  if (phantom.line_integral) static_cast<void>(phantom.line_integral(0.3, 0.1, 0.2));
}

}  // namespace

const Target fuzz_target{"phantom.json", Contents::text, seeds, read};

}  // namespace vdvr::fuzz
