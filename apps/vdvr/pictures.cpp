#include "apps/vdvr/pictures.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "apps/vdvr/inputs.hpp"
#include "vdvr/error.hpp"
#include "vdvr/volume_file.hpp"

namespace vdvr::cli {

Scene open_scene(const std::filesystem::path& path, const Arguments& args, const std::string& method,
                 bool unverified) {
  const std::uint64_t max_memory = common_options(args).max_memory;
  switch (kind_of(path, args)) {
    case InputKind::certified: {
      VdvrFile file = read_certified(path, args, unverified);
      // Samples on the grid alone are an ordinary volume; the certificate says nothing about their
      // interpolation.
      if (method == "dvr") return {as_mixed(on_grid(file.volume)), std::nullopt, false};
      return {std::move(file.volume), std::move(file.certificate), !unverified};
    }
    case InputKind::volume:
      return {as_mixed(read_volume(path, max_memory)), std::nullopt, false};
    case InputKind::scan:
      break;
  }
  throw InputError(
      fmt::format("{}: is neither a certified volume nor a uniform one (MHA, NRRD, FILE.h5:/dataset, TIFF "
                  "slices); build or reconstruct it first, or draw projections with --method d2vr",
                  path.string()));
}

const char* sampler_name(SamplerKind kind) {
  return kind == SamplerKind::image3d ? "image3d" : kind == SamplerKind::buffer ? "buffer" : "auto";
}

bool is_thin(const Grid& grid) {
  const double height = static_cast<double>(grid.cells[2]) * grid.spacing[2];
  const double width = static_cast<double>(std::max(grid.cells[0], grid.cells[1])) * grid.spacing[0];
  return grid.cells[2] <= 2 || height < 0.02 * width;
}

std::string outside_certificate(const RenderOptions& options) {
  const std::string rounding = "colours are rounded to 8 bits";
  if (options.mode != RenderMode::dvr) return rounding;
  return fmt::format(
      "rays stop at opacity {}, so what lies behind is missing with a weight of at most {:.2g}; {}",
      options.termination, 1 - options.termination, rounding);
}

}  // namespace vdvr::cli
