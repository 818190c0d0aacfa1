// Matrices of views in NumPy's format.
#include "tests/fuzz/cone_folder.hpp"

namespace vdvr::fuzz {
namespace {

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  write_cone_folder(folder, "matrices", "matrices.npy");
  std::vector<double> in_c, in_fortran(48);
  for (int k = 0; k < 4; ++k) {
    CircularView view;
    view.theta_rad = k * support::pi / 2;
    view.source_to_axis = 100;
    view.source_to_detector = 150;
    view.center = 1;
    view.row = 0.5;
    for (const auto& row : circular_view(view)) in_c.insert(in_c.end(), row.begin(), row.end());
  }
  for (std::size_t i = 0; i < 48; ++i) in_fortran[i / 12 + 4 * (i / 4 % 3) + 12 * (i % 4)] = in_c[i];
  return {support::npy_bytes(in_c, "4, 3, 4"), support::npy_bytes(in_fortran, "4, 3, 4", true),
          support::npy_bytes(std::vector<float>(in_c.begin(), in_c.end()), "4, 3, 4")};
}

}  // namespace

const Target fuzz_target{"matrices.npy", Contents::binary, seeds, read_cone_folder};

}  // namespace vdvr::fuzz
