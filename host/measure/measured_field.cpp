#include "host/measure/measured_field.hpp"

#include <fmt/format.h>

#include <cmath>

#include "host/base/system/casts.hpp"
#include "host/volume/brick_layout.hpp"
#include "vdvr/error.hpp"

namespace vdvr::measured {
namespace {

std::vector<float> bounds_of(const Certificate& certificate) {
  if (certificate.window)
    throw InputError(
        "the volume was built with a window: beside it nothing bounds |V - F|, and nothing can be measured; "
        "build "
        "without --window");
  return brick_bounds(certificate, false);
}

}  // namespace

Field::Field(const MixedVolume& volume, const Certificate& certificate, const MeasureRegion& region)
    : volume_(volume),
      certificate_(certificate),
      bounds_(bounds_of(certificate)),
      bricks_(volume.grid, volume.granularity),
      region_(volume.grid, certificate, region) {
  if (at(bricks_.size()) != bounds_.size())
    throw InputError(fmt::format("the certificate has bounds of {} bricks, and the volume has {}",
                                 bounds_.size(), bricks_.size()));
}

bool Field::read(const Index3& brick, BrickCells& out) const {
  const auto [low, high] = bricks_.box(brick);
  out.place = region_.place(low, high);
  if (out.place == Place::outside) return false;
  out.bound = static_cast<double>(bounds_[at(bricks_.number(brick))]);
  if (!std::isfinite(out.bound)) {
    // Nothing was tested there, since it holds no covered point; a box may touch the region by rounding.
    if (out.place == Place::cut) return false;
    throw FileError(fmt::format(
        "brick_total: nothing bounds |V - F| in brick {} {} {}, which is covered; `vdvr verify` the file",
        brick[0], brick[1], brick[2]));
  }
  const BrickSamples samples(volume_, brick);
  out.brick = brick;
  out.count = samples.end();
  const Grid& g = volume_.grid;
  for (std::size_t a = 0; a < 3; ++a) {
    out.face[a].resize(at(out.count[a] + 1));
    for (std::int64_t i = 0; i <= out.count[a]; ++i)
      out.face[a][at(i)] = g.origin[a] + (static_cast<double>(brick[a] * volume_.granularity) +
                                          std::ldexp(static_cast<double>(i), -samples.per_cell()[a])) *
                                             g.spacing[a];
  }
  out.value.resize(at((out.count[0] + 1) * (out.count[1] + 1) * (out.count[2] + 1)));
  std::size_t next = 0;
  for (std::int64_t z = 0; z <= out.count[2]; ++z)
    for (std::int64_t y = 0; y <= out.count[1]; ++y)
      for (std::int64_t x = 0; x <= out.count[0]; ++x) out.value[next++] = samples(x, y, z);
  const auto [least, largest] = std::minmax_element(out.value.begin(), out.value.end());
  out.least = *least;
  out.largest = *largest;
  return true;
}

}  // namespace vdvr::measured
