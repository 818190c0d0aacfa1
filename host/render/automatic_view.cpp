// Views that suit what is in a volume. Called by programs.
#include "vdvr/automatic_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "vdvr/error.hpp"
#include "vdvr/framing.hpp"

namespace vdvr {

namespace {

constexpr std::size_t kBins = 1024;
using Histogram = std::array<double, kBins>;

/// The split of bins [0, end) with the largest variance between the two classes.
std::size_t otsu_bin(const Histogram& histogram, std::size_t end) {
  double count = 0, sum = 0;
  for (std::size_t i = 0; i < end; ++i) {
    count += histogram[i];
    sum += histogram[i] * static_cast<double>(i);
  }
  double below = 0, sum_below = 0, best = -1;
  std::size_t split = 0;
  for (std::size_t i = 0; i + 1 < end; ++i) {
    below += histogram[i];
    sum_below += histogram[i] * static_cast<double>(i);
    if (below <= 0 || below >= count) continue;
    const double gap = sum_below / below - (sum - sum_below) / (count - below);
    const double between = below * (count - below) * gap * gap;
    if (between > best) {
      best = between;
      split = i;
    }
  }
  return split;
}

/// The bin below which a fraction q of all counts lies.
std::size_t quantile_bin(const Histogram& histogram, double q) {
  double count = 0, sum = 0;
  for (const double n : histogram) count += n;
  std::size_t bin = 0;
  for (; bin + 1 < kBins && sum + histogram[bin] < q * count; ++bin) sum += histogram[bin];
  return bin;
}

Vec3 centroid_above(const Grid& grid, const std::vector<float>& base, double threshold) {
  const Index3 n = grid.samples();
  std::array<double, 3> sum{};
  double count = 0;
  std::size_t i = 0;
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x, ++i) {
        if (!(static_cast<double>(base[i]) >= threshold)) continue;
        const Vec3 p = grid.position({x, y, z});
        for (std::size_t a = 0; a < 3; ++a) sum[a] += p[a];
        count += 1;
      }
  if (count == 0) return grid.position({n[0] / 2, n[1] / 2, n[2] / 2});
  return {sum[0] / count, sum[1] / count, sum[2] / count};
}

}  // namespace

Brightness brightness_of(const MixedVolume& volume) {
  const std::vector<float> base = on_grid(volume).samples;
  const auto [least, largest] = std::minmax_element(base.begin(), base.end());
  const double lo = static_cast<double>(*least), hi = static_cast<double>(*largest);
  Brightness b{lo, hi, lo, hi, 0.5 * (lo + hi), lo, {}};
  if (hi > lo) {
    // Exact zeros are what was not covered, not part of the picture.
    Histogram histogram{};
    const double scale = (kBins - 1) / (hi - lo);
    for (const float s : base)
      if (s != 0.0f) histogram[static_cast<std::size_t>((static_cast<double>(s) - lo) * scale)] += 1;
    const auto value = [&](std::size_t bin) { return lo + (static_cast<double>(bin) + 0.5) / scale; };
    const std::size_t dense = otsu_bin(histogram, kBins);
    b.threshold = value(dense);
    b.soft = value(otsu_bin(histogram, dense + 1));
    b.lo = b.grey_lo = value(quantile_bin(histogram, 0.005));
    b.hi = std::max(value(quantile_bin(histogram, 0.999)), b.threshold);
    b.grey_hi = std::max(value(quantile_bin(histogram, 0.99)), b.soft);
    if (!(b.grey_hi > b.grey_lo)) b.grey_hi = hi;
  }
  b.dense_center = centroid_above(volume.grid, base, b.threshold);
  return b;
}

TransferFunction two_material_transfer(const Brightness& b) {
  const double veil = b.threshold - b.soft, dense = b.hi - b.threshold;
  return {"two materials",
          {{b.lo, {0.30, 0.50, 0.70}, 0},
           {b.soft, {0.30, 0.50, 0.70}, 0},
           {b.soft + 0.2 * veil, {0.45, 0.68, 0.90}, 0.02},
           {b.soft + 0.6 * veil, {0.60, 0.75, 0.90}, 0.02},
           {b.threshold, {0.95, 0.70, 0.45}, 0.1},
           {b.threshold + 0.4 * dense, {0.99, 0.88, 0.70}, 0.6},
           {b.hi, {1.00, 1.00, 0.98}, 0.9}}};
}

TransferFunction preset_for(const std::string& name, const Brightness& b) {
  if (name != "iso" && name != "marschner-lobb") return transfer_preset(name, b.lo, b.hi);
  const double reach = std::min(b.threshold - b.lo, b.hi - b.threshold);
  return transfer_preset(name, b.threshold - reach, b.threshold + reach);
}

std::vector<IsoSurface> iso_surfaces(const std::vector<double>& densities,
                                     const std::optional<std::vector<double>>& opacities) {
  if (opacities && opacities->size() != densities.size())
    throw InputError(
        fmt::format("surfaces: {} opacities for {} densities", opacities->size(), densities.size()));
  constexpr std::array<std::array<double, 3>, 4> kVeils{
      {{0.55, 0.72, 0.90}, {0.90, 0.62, 0.50}, {0.60, 0.82, 0.58}, {0.86, 0.62, 0.86}}};
  std::vector<IsoSurface> surfaces;
  for (std::size_t i = 0; i < densities.size(); ++i) {
    // How many are lighter gives the place in the row of colours.
    const auto place = static_cast<std::size_t>(
        std::count_if(densities.begin(), densities.end(), [&](double v) { return v < densities[i]; }));
    const bool densest = densities[i] == *std::max_element(densities.begin(), densities.end());
    IsoSurface s{densities[i], opacities ? (*opacities)[i] : (densest ? 1 : 0.3)};
    if (!densest) s.rgb = kVeils[place % kVeils.size()];
    surfaces.push_back(s);
  }
  return surfaces;
}

RenderOptions automatic_view(const MixedVolume& volume, const std::optional<Certificate>& certificate) {
  const Brightness bright = brightness_of(volume);
  RenderOptions o;
  o.transfer = two_material_transfer(bright);
  o.surfaces = {{bright.threshold}};
  o.slice_range = std::pair{bright.grey_lo, bright.grey_hi};
  o.slice_position = bright.dense_center[static_cast<std::size_t>(o.slice_axis)];
  o.camera = orbit_camera(frame_view(volume, o, 30, 20), 30, 20, 1);
  o.step_mode = StepMode::adaptive;
  if (certificate) o.sampler = SamplerKind::buffer;
  return o;
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

}  // namespace vdvr
