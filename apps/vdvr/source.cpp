#include "apps/vdvr/source.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "apps/vdvr/crew.hpp"
#include "apps/vdvr/inputs.hpp"
#include "vdvr/certify.hpp"
#include "vdvr/error.hpp"
#include "vdvr/trust.hpp"

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
  device_.emplace(selectors.front(), memory);
  // A volume without tiles has nothing that could come brick by brick: what it lacks, its own error says.
  if (scene_->volume.tiles.empty() || fits(*device_, scene_->volume)) {
    resident_.emplace(*device_, scene_->volume);
    renderer_.emplace(*device_, *resident_);
  } else {
    report(progress, "find ranges", 0);
    paged_.emplace(*device_, scene_->volume);
  }
  if (paged_ || selectors.size() > 1) open_others({selectors.begin() + 1, selectors.end()}, memory, progress);
}

void Source::open_others(const std::vector<std::string>& selectors, std::uint64_t memory,
                         const Progress& progress) {
  std::vector<RenderCrew::Member> members{
      {&*device_, resident_ ? &*resident_ : nullptr, paged_ ? &*paged_ : nullptr}};
  for (const std::string& selector : selectors) {
    others_.push_back(
        std::unique_ptr<Other>(new Other{Device(selector, memory), std::nullopt, std::nullopt}));
    Other& other = *others_.back();
    const DeviceInfo &a = device_->info(), &b = other.device.info();
    if (a.name != b.name || a.driver != b.driver)
      throw InputError(
          fmt::format("--device: '{}' ({}) and '{}' ({}) may round differently, and pictures are those of "
                      "one device: name "
                      "devices of one kind",
                      a.name, a.driver, b.name, b.driver));
    report(progress, "open devices", 0);
    if (resident_) other.resident.emplace(other.device, scene_->volume);
    else other.paged.emplace(other.device, scene_->volume);
    members.push_back(
        {&other.device, other.resident ? &*other.resident : nullptr, other.paged ? &*other.paged : nullptr});
  }
  crew_.emplace(members);
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
  device_.emplace(open_device(common));
  field_.emplace(*device_, scan, options, progress);
  projections_.emplace(*device_, *field_, grid, progress);
  renderer_.emplace(*device_, *projections_);
  scene_ = Scene{as_mixed(projections_->samples()), std::nullopt, false};
}

bool Source::trusted() {
  return test_of(*device_).passed() && std::all_of(others_.begin(), others_.end(), [](const auto& other) {
           return test_of(other->device).passed();
         });
}

void Source::require_trusted(const std::string& what) {
  vdvr::require_trusted(*device_, what);
  for (const auto& other : others_) vdvr::require_trusted(other->device, what);
}

SafeSampler Source::take_sampler(SamplerKind asked, bool unverified) {
  // By bricks it is always the buffer.
  if (paged_ && asked == SamplerKind::automatic) asked = SamplerKind::buffer;
  // Further devices are of the first one's kind.
  SafeSampler safe = safe_sampler(*device_, scene_->volume, scene_->certificate, asked, unverified);
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
  if (options.output == RenderOutput::error && shown_.values.empty()) {
    const bool image3d = renderer_ && renderer_->sampler(options.sampler) == SamplerKind::image3d;
    shown_ = brick_values(scene_->volume, certificate(), image3d, shown_.quantity);
    if (crew_) crew_->set_bounds(shown_.values);
    else renderer_->set_bounds(shown_.values);
  }
  return crew_ ? crew_->render(options, progress) : renderer_->render(options);
}

PixelBounds Source::certify(const RenderOptions& options, const CertifyPictureOptions& certify,
                            const Progress& progress) {
  if (paged_)
    return certify_pixels(*device_, *paged_, brick_bounds(certificate(), false), options, certify, progress);
  const bool image3d = renderer_->sampler(options.sampler) == SamplerKind::image3d;
  return certify_pixels(*device_, *resident_, brick_bounds(certificate(), image3d), options, certify,
                        progress);
}

std::pair<float, float> Source::value_range() const {
  return paged_ ? paged_->value_range() : resident_->value_range();
}

std::uint64_t Source::bytes() const {
  return field_ ? field_->bytes() : paged_ ? device_->peak_memory() : resident_->bytes();
}

std::optional<PagingCounts> Source::paging() const {
  return paged_ ? std::optional(paged_->counts()) : std::nullopt;
}

}  // namespace vdvr::cli
