// Matrices as they are: world to column and row, whose centres are integers; see matrix_geometry.hpp.
#include "host/scan/open/matrix_geometry.hpp"

#include <fmt/format.h>

#include "host/base/system/limits.hpp"
#include "host/files/io/npy_file.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {

ConeViews matrix_geometry(const std::filesystem::path& path, const StackShape& stack) {
  const NpyArray array = read_npy(path);
  if (array.shape.size() != 3 || array.shape[1] != 3 || array.shape[2] != 4)
    throw FileError(fmt::format("{}: shape {}; views x 3 x 4 is needed, one matrix for each view",
                                path.string(), shape_text(array.shape)));
  require_views(path.string(), "matrices", array.shape[0], stack);
  ConeViews out;
  out.center_source = "file";
  for (std::int64_t k = 0; k < stack.views; ++k) {
    ViewMatrix matrix{};
    for (std::size_t i = 0; i < 12; ++i)
      matrix[i / 4][i % 4] = array.values[static_cast<std::size_t>(12 * k) + i];
    out.views.push_back(checked_view(matrix, path.string(), k));
  }
  out.notes.emplace_back(
      "matrices are taken as world to column and row, pixel centres at whole numbers from 0");
  return out;
}

}  // namespace vdvr::io
