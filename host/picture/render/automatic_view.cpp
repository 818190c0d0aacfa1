// Views that suit what is in a volume.
#include "vdvr/automatic_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "vdvr/error.hpp"
#include "vdvr/expert/framing.hpp"

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

/// Of the samples for which `counts` is true, to a hundredth of a cell: a slice's place is read.
template <class Counts>
Vec3 centroid_of(const Grid& grid, const std::vector<float>& base, Counts&& counts) {
  const Index3 n = grid.samples();
  std::array<double, 3> sum{};
  double count = 0;
  std::size_t i = 0;
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x, ++i) {
        if (!counts(static_cast<double>(base[i]))) continue;
        const Vec3 p = grid.position({x, y, z});
        for (std::size_t a = 0; a < 3; ++a) sum[a] += p[a];
        count += 1;
      }
  if (count == 0) return grid.position({n[0] / 2, n[1] / 2, n[2] / 2});
  Vec3 out{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double cells = (sum[a] / count - grid.origin[a]) / grid.spacing[a];
    out[a] = grid.origin[a] + std::round(100 * cells) / 100 * grid.spacing[a];
  }
  return out;
}

// --- masks and label maps ---

/// The value that most samples of the grid's faces have: what lies around the object, where many have one.
float commonest_on_faces(const Grid& grid, const std::vector<float>& base) {
  const Index3 n = grid.samples();
  std::unordered_map<float, std::int64_t> count;
  std::pair<std::int64_t, float> most{0, 0.0f};
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y) {
      // Of rows within the volume the ends alone.
      const bool on_face = z == 0 || z == n[2] - 1 || y == 0 || y == n[1] - 1;
      for (std::int64_t x = 0; x < n[0]; x += on_face ? 1 : n[0] - 1) {
        const float value = base[static_cast<std::size_t>((z * n[1] + y) * n[0] + x)];
        // What is 0 with either sign is one value.
        most = std::max(most, std::pair{++count[value == 0.0f ? 0.0f : value], value});
      }
    }
  return most.second;
}

/// Whether most neighbours along x that are not `background` have equal values. Measured and reconstructed
/// densities differ from sample to sample; labels do not.
bool holds_labels(const Grid& grid, const std::vector<float>& base, float background) {
  const std::size_t row = static_cast<std::size_t>(grid.samples()[0]);
  std::int64_t pairs = 0, equal = 0, alone = 0;
  for (std::size_t first = 0; first < base.size(); first += row)
    for (std::size_t i = first; i + 1 < first + row; ++i) {
      const bool here = base[i] != background, next = base[i + 1] != background;
      pairs += here && next;
      equal += here && next && base[i] == base[i + 1];
      alone += here != next;
    }
  // Specks of a sample have no such neighbours.
  return pairs > 0 ? 2 * equal > pairs : alone > 0;
}

struct Values {
  double least, largest;  ///< of all samples
};

/// Labels around which lies `background`: all of them show, parted where they part.
Brightness brightness_of_labels(const Grid& grid, const std::vector<float>& base, const Values& all,
                                double background) {
  std::int64_t above = 0, below = 0;
  for (const float s : base) {
    above += static_cast<double>(s) > background;
    below += static_cast<double>(s) < background;
  }
  // Seen from the background the object's values grow; below it they are mirrored.
  const double sign = below > above ? -1 : 1;
  const double from = sign * background, to = sign > 0 ? all.largest : -all.least;
  Histogram histogram{};
  std::array<Values, kBins> bins{};
  double faintest = to;
  const double scale = (kBins - 1) / (to - from);
  for (const float s : base) {
    const double value = sign * static_cast<double>(s);
    if (!(value > from)) continue;
    const auto bin = static_cast<std::size_t>((value - from) * scale);
    Values& range = bins[bin];
    range = histogram[bin] == 0 ? Values{value, value}
                                : Values{std::min(range.least, value), std::max(range.largest, value)};
    histogram[bin] += 1;
    faintest = std::min(faintest, value);
  }
  const double soft = 0.5 * (from + faintest);
  double threshold = soft;
  if (faintest < to) {
    const std::size_t split = otsu_bin(histogram, kBins);
    double low = faintest, high = to;
    for (std::size_t i = 0; i < kBins; ++i) {
      if (histogram[i] == 0) continue;
      if (i <= split) low = std::max(low, bins[i].largest);
      else high = std::min(high, bins[i].least);
    }
    threshold = 0.5 * (low + high);
  }
  Brightness b{std::min(sign * from, sign * to), std::max(sign * from, sign * to)};
  b.grey_lo = all.least;
  b.grey_hi = all.largest;
  b.threshold = sign * threshold;
  b.soft = sign * soft;
  b.dense_is_low = sign < 0;
  b.dense_center = centroid_of(grid, base, [&](double value) { return sign * value >= threshold; });
  return b;
}

// --- densities ---

constexpr double kLeastQuantile = 0.005, kMostQuantile = 0.999;

struct Bulk {
  Histogram histogram{};
  double from = 0, scale = 1;
  [[nodiscard]] double value(std::size_t bin) const {
    return from + (static_cast<double>(bin) + 0.5) / scale;
  }
};

/// Bins over all values; over those of the bulk where a few outliers leave it a handful of bins. What lies
/// beyond is counted in the outermost.
Bulk bulk_of(const std::vector<float>& base, Values range) {
  constexpr std::size_t least_bins = 16;
  constexpr int most_rounds = 8;  // each narrows the range by 50 at least, so float has no more
  for (int round = 1;; ++round) {
    Bulk bulk{{}, range.least, (kBins - 1) / (range.largest - range.least)};
    // Exact zeros are what was not covered, not part of the picture.
    for (const float s : base)
      if (s != 0.0f)
        bulk.histogram[static_cast<std::size_t>(std::clamp(
            (static_cast<double>(s) - range.least) * bulk.scale, 0.0, static_cast<double>(kBins - 1)))] += 1;
    const std::size_t first = quantile_bin(bulk.histogram, kLeastQuantile),
                      last = quantile_bin(bulk.histogram, kMostQuantile);
    const Values narrow{range.least + static_cast<double>(first) / bulk.scale,
                        range.least + static_cast<double>(last + 1) / bulk.scale};
    const bool is_narrow = last - first < least_bins;
    if (!is_narrow || round == most_rounds || !(narrow.largest > narrow.least)) return bulk;
    range = narrow;
  }
}

}  // namespace

Brightness brightness_of(const MixedVolume& volume) {
  const std::vector<float> base = on_grid(volume).samples;
  const auto [least, largest] = std::minmax_element(base.begin(), base.end());
  const Values all{static_cast<double>(*least), static_cast<double>(*largest)};
  const double lo = all.least, hi = all.largest;
  Brightness b{lo, hi, lo, hi, 0.5 * (lo + hi), lo, {}};
  if (hi > lo) {
    const float background = commonest_on_faces(volume.grid, base);
    if (holds_labels(volume.grid, base, background))
      return brightness_of_labels(volume.grid, base, all, static_cast<double>(background));
    const Bulk bulk = bulk_of(base, all);
    const std::size_t dense = otsu_bin(bulk.histogram, kBins);
    b.threshold = bulk.value(dense);
    b.soft = bulk.value(otsu_bin(bulk.histogram, dense + 1));
    b.lo = b.grey_lo = bulk.value(quantile_bin(bulk.histogram, kLeastQuantile));
    b.hi = std::max(bulk.value(quantile_bin(bulk.histogram, kMostQuantile)), b.threshold);
    b.grey_hi = std::max(bulk.value(quantile_bin(bulk.histogram, 0.99)), b.soft);
    if (!(b.grey_hi > b.grey_lo)) b.grey_hi = hi;
    // A bin is wider than what lies in it.
    b.lo = std::min(b.lo, b.soft);
    b.grey_lo = std::min(b.grey_lo, b.grey_hi);
  }
  b.dense_center = centroid_of(volume.grid, base, [&](double value) { return value >= b.threshold; });
  return b;
}

TransferFunction two_material_transfer(const Brightness& b) {
  if (b.dense_is_low) {
    Brightness mirrored{-b.hi, -b.lo};
    mirrored.threshold = -b.threshold;
    mirrored.soft = -b.soft;
    TransferFunction f = two_material_transfer(mirrored);
    for (TransferPoint& p : f.points) p.value = -p.value;
    std::reverse(f.points.begin(), f.points.end());
    return f;
  }
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
