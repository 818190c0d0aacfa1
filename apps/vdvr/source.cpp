#include "apps/vdvr/source.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/vdvr/crew.hpp"
#include "apps/vdvr/inputs.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certify.hpp"
#include "vdvr/expert/trust.hpp"

namespace vdvr::cli {
namespace {

const std::vector<std::string> kProjectionOptions{"cells",  "spacing",       "origin",     "center",
                                                  "filter", "filter-cutoff", "upsampling", "no-skip"};

}  // namespace

Json paging_json(const std::optional<PagingCounts>& counts) {
  if (!counts) return {};
  return {{"parts", counts->parts},
          {"bricks", counts->bricks},
          {"bytes", counts->bytes},
          {"largest_part_bytes", counts->largest_part}};
}

void print_paging(const std::optional<PagingCounts>& counts) {
  if (!counts) return;
  fmt::print("  by bricks    {} parts of pictures, {:.1f} MiB of tiles for the largest, {:.1f} MiB in all\n",
             counts->parts, static_cast<double>(counts->largest_part) / (1 << 20),
             static_cast<double>(counts->bytes) / (1 << 20));
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
  std::string method = args.choice("method", "vdvr");
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
  std::vector<std::string> selectors = device_selectors(common.device);
  if (processes_here() > 1)  // each takes one of the list, in turn
    selectors = {selectors[static_cast<std::size_t>(place_here()) % selectors.size()]};
  const std::uint64_t memory =
      common.max_memory / (selectors.size() * static_cast<std::uint64_t>(processes_here()));
  std::vector<Device*> devices;
  for (const std::string& selector : selectors) {
    devices_.push_back(std::make_unique<Device>(selector, memory));
    devices.push_back(devices_.back().get());
  }
  drawn_.emplace(devices, scene_->volume, progress);
}

void Source::open_projections(const Arguments& args, const CommonOptions& common, const Progress& progress) {
  D2vrOptions options;
  options.field = field_options(args);
  options.upsampling = upsampling_option(args);
  const ProjectionSet scan = load_scan(args.path("FILE"), args, options.field, progress);
  ParallelGeometry geometry = scan.geometry;
  geometry.center = center_of(options.field, geometry);
  if (device_selectors(common.device).size() > 1)
    throw InputError("--device: --method d2vr draws on one device; volumes are drawn on several");
  // --size is the picture's.
  const Grid grid = make_grid(geometry, grid_options(args, "cells"));
  devices_.push_back(std::make_unique<Device>(open_device(common)));
  field_.emplace(device(), scan, options, progress);
  projections_.emplace(device(), *field_, grid, progress);
  renderer_.emplace(device(), *projections_);
  scene_ = Scene{as_mixed(projections_->samples()), std::nullopt, false};
}

bool Source::trusted() {
  return std::all_of(devices_.begin(), devices_.end(),
                     [](const auto& device) { return test_of(*device).passed(); });
}

void Source::require_trusted(const std::string& what) {
  for (const auto& device : devices_) vdvr::require_trusted(*device, what);
}

SafeSampler Source::take_sampler(SamplerKind asked, bool unverified) {
  if (drawn_ && drawn_->by_bricks()) asked = drawn_->sampler(asked);
  // Further devices are of the first one's kind.
  SafeSampler safe = safe_sampler(device(), scene_->volume, scene_->certificate, asked, unverified);
  here_ = safe.certificate;
  return safe;
}

const Certificate& Source::certificate() const {
  if (here_) return *here_;
  if (!scene_->certificate)
    throw InputError("--show error: the volume has no certificate to take bounds from");
  return *scene_->certificate;
}

RenderResult Source::draw(const RenderOptions& options, const Progress& progress) {
  if (!drawn_) return renderer_->render(options);
  if (options.output == RenderOutput::error && shown_.values.empty()) {
    const bool image3d = drawn_->sampler(options.sampler) == SamplerKind::image3d;
    shown_ = brick_values(scene_->volume, certificate(), image3d, shown_.quantity);
    drawn_->set_bounds(shown_.values);
  }
  return drawn_->draw(options, progress);
}

std::pair<float, float> Source::value_range() const { return drawn_->value_range(); }

std::uint64_t Source::bytes() const { return drawn_ ? drawn_->bytes() : field_->bytes(); }

std::optional<PagingCounts> Source::paging() const { return drawn_ ? drawn_->paging() : std::nullopt; }

}  // namespace vdvr::cli
