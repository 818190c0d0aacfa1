#include "apps/vdvr/source.hpp"

#include <algorithm>

#include "apps/vdvr/inputs.hpp"
#include "vdvr/certify.hpp"
#include "vdvr/error.hpp"

namespace vdvr::cli {
namespace {

const std::vector<std::string> kProjectionOptions{"cells",  "spacing",       "origin",     "center",
                                                  "filter", "filter-cutoff", "upsampling", "no-skip"};

}  // namespace

const std::vector<std::string>& render_methods() {
  static const std::vector<std::string> names{"vdvr", "dvr", "d2vr"};
  return names;
}

void add_method(Arguments& args) {
  args.value(
      "method", "vdvr|dvr|d2vr",
      "the mixed volume, its base samples alone, or no volume at all: projections, back-projected at every "
      "sample of a ray (default vdvr)");
}

void add_projection_options(Arguments& args) {
  args.group("Projections (--method d2vr)")
      .value("cells", "NxNxN", "cells of the box in x, y, z (default: the covered region)")
      .value("spacing", "S[,SZ]", "cell width, and height where it differs (default: the detector pitch)")
      .value("origin", "X,Y,Z", "the box's corner (default: centred)")
      .value("center", "C", "column onto which the rotation axis projects")
      .value("filter", "ram-lak|shepp-logan|cosine|hamming|hann", "default ram-lak")
      .value("filter-cutoff", "F", "fraction of the detector's Nyquist frequency, in (0, 1] (default 1)")
      .value("upsampling", "N",
             "columns and rows per detector pixel, a power of two (default 1: as published)")
      .flag("no-skip", "also sample where the field is taken for empty");
}

std::string method_option(const Arguments& args) {
  std::string method = args.choice("method", render_methods(), "vdvr");
  if (method != "d2vr") refuse(args, kProjectionOptions, "applies to --method d2vr");
  return method;
}

Source::Source(const Arguments& args, const CommonOptions& common, const std::string& method, bool unverified,
               const Progress& progress) {
  if (method == "d2vr") {
    open_projections(args, common, progress);
    return;
  }
  scene_ = open_scene(args.path("FILE"), args, method, unverified);
  device_.emplace(open_device(common));
  resident_.emplace(*device_, scene_->volume);
  renderer_.emplace(*device_, *resident_);
}

void Source::open_projections(const Arguments& args, const CommonOptions& common, const Progress& progress) {
  D2vrOptions options;
  options.field = field_options(args);
  options.upsampling = upsampling_option(args);
  const ProjectionSet scan = load_scan(args.path("FILE"), args, options.field, progress);
  ParallelGeometry geometry = scan.geometry;
  geometry.center = center_of(options.field, geometry);
  // --size is the picture's.
  const Grid grid = make_grid(geometry, grid_options(args, "cells"));
  device_.emplace(open_device(common));
  field_.emplace(*device_, scan, options, progress);
  projections_.emplace(*device_, *field_, grid, progress);
  renderer_.emplace(*device_, *projections_);
  scene_ = Scene{as_mixed(projections_->samples()), std::nullopt, false};
}

RenderResult Source::draw(const RenderOptions& options) {
  if (options.output == RenderOutput::error && !bounds_set_) {
    if (!scene_->certificate)
      throw InputError("--show error: the volume has no certificate to take bounds from");
    const bool image3d = renderer_->sampler(options.sampler) == SamplerKind::image3d;
    renderer_->set_bounds(brick_bounds(*scene_->certificate, image3d));
    bounds_set_ = true;
  }
  return renderer_->render(options);
}

PixelBounds Source::certify(const RenderOptions& options, const CertifyPictureOptions& certify,
                            const Progress& progress) {
  const bool image3d = renderer_->sampler(options.sampler) == SamplerKind::image3d;
  return certify_pixels(*device_, *resident_, brick_bounds(*scene_->certificate, image3d), options, certify,
                        progress);
}

std::uint64_t Source::bytes() const { return field_ ? field_->bytes() : resident_->bytes(); }

}  // namespace vdvr::cli
