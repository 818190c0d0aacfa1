#include "vdvr/expert/drawn_volume.hpp"

#include <fmt/format.h>

#include "vdvr/error.hpp"
#include "vdvr/expert/render_crew.hpp"
#include "vdvr/expert/resident_volume.hpp"

namespace vdvr {
namespace {

void require_one_kind(const std::vector<Device*>& devices) {
  if (devices.empty()) throw InputError("no device to draw on");
  for (const Device* device : devices) {
    const DeviceInfo &a = devices.front()->info(), &b = device->info();
    if (a.name != b.name || a.driver != b.driver)
      throw InputError(fmt::format(
          "`device`: '{}' ({}) and '{}' ({}) may round differently, and pictures are those of one "
          "device: name devices of one kind",
          a.name, a.driver, b.name, b.driver));
  }
}

/// The volume on one of the devices.
struct Placed {
  std::optional<ResidentVolume> whole;  ///< or
  std::optional<PagedVolume> by_bricks;
};

}  // namespace

struct DrawnVolume::Impl {
  std::vector<Device*> devices;
  const MixedVolume& volume;
  std::vector<std::unique_ptr<Placed>> placed;  ///< by device; the renderers refer to them
  std::optional<RenderCrew> crew;               ///< of several devices, or by bricks; or
  std::optional<Renderer> renderer;

  [[nodiscard]] const Placed& first() const { return *placed.front(); }
};

DrawnVolume::DrawnVolume(const std::vector<Device*>& devices, const MixedVolume& volume,
                         const Progress& progress)
    : impl_(new Impl{devices, volume, {}, {}, {}}) {
  require_one_kind(devices);
  // A volume without tiles has nothing that could come brick by brick: what it lacks, its own error says.
  const bool whole = volume.tiles.empty() || fits(*devices.front(), volume);
  std::vector<RenderCrew::Member> members;
  for (Device* device : devices) {
    if (device != devices.front()) report(progress, "open devices", 0);
    else if (!whole) report(progress, "find ranges", 0);
    impl_->placed.push_back(std::make_unique<Placed>());
    Placed& placed = *impl_->placed.back();
    if (whole) placed.whole.emplace(*device, volume);
    else placed.by_bricks.emplace(*device, volume);
    members.push_back({device, whole ? &*placed.whole : nullptr, whole ? nullptr : &*placed.by_bricks});
  }
  if (whole) impl_->renderer.emplace(*devices.front(), *impl_->first().whole);
  if (!whole || devices.size() > 1) impl_->crew.emplace(members);
}

DrawnVolume::~DrawnVolume() = default;

RenderResult DrawnVolume::draw(const RenderOptions& options, const Progress& progress) {
  return impl_->crew ? impl_->crew->render(options, progress) : impl_->renderer->render(options);
}

PixelBounds DrawnVolume::certify(const std::vector<float>& bounds, const RenderOptions& options,
                                 const CertifyPictureOptions& certify, const Progress& progress) const {
  Device& device = *impl_->devices.front();
  const Placed& first = impl_->first();
  return by_bricks() ? certify_pixels(device, *first.by_bricks, bounds, options, certify, progress)
                     : certify_pixels(device, *first.whole, bounds, options, certify, progress);
}

SamplerKind DrawnVolume::sampler(SamplerKind asked) const {
  if (!by_bricks()) return impl_->renderer->sampler(asked);
  return asked == SamplerKind::automatic ? SamplerKind::buffer : asked;
}

void DrawnVolume::set_bounds(const std::vector<float>& bounds) {
  if (impl_->crew) impl_->crew->set_bounds(bounds);
  else impl_->renderer->set_bounds(bounds);
}

const std::vector<Device*>& DrawnVolume::devices() const { return impl_->devices; }
const MixedVolume& DrawnVolume::volume() const { return impl_->volume; }
bool DrawnVolume::by_bricks() const { return impl_->first().by_bricks.has_value(); }

std::pair<float, float> DrawnVolume::value_range() const {
  return by_bricks() ? impl_->first().by_bricks->value_range() : impl_->first().whole->value_range();
}

std::uint64_t DrawnVolume::bytes() const {
  return by_bricks() ? impl_->devices.front()->peak_memory() : impl_->first().whole->bytes();
}

std::optional<PagingCounts> DrawnVolume::paging() const {
  return by_bricks() ? std::optional(impl_->first().by_bricks->counts()) : std::nullopt;
}

}  // namespace vdvr
