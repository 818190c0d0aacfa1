#include "apps/vdvr/pictures.hpp"

#include <fmt/format.h>

#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/volume_input.hpp"
#include "vdvr/error.hpp"

namespace vdvr::cli {

Scene open_scene(const std::filesystem::path& path, const Arguments& args, const std::string& method,
                 bool unverified) {
  switch (kind_of(path, args)) {
    case InputKind::certified: {
      VdvrFile file = open_certified(path, args, unverified);
      // Samples on the grid alone are an ordinary volume; the certificate says nothing about their
      // interpolation.
      if (method == "dvr") return {as_mixed(on_grid(file.volume)), std::nullopt, false};
      return {std::move(file.volume), std::move(file.certificate), !unverified};
    }
    case InputKind::volume:
      return {as_mixed(load_volume(path, args)), std::nullopt, false};
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

}  // namespace vdvr::cli
