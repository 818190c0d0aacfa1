#include "apps/vdvr/pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/vdvr/inputs.hpp"
#include "vdvr/error.hpp"
#include "vdvr/volume_file.hpp"

namespace vdvr::cli {

Scene open_scene(const std::filesystem::path& path, const Arguments& args, const std::string& method,
                 bool unverified) {
  const std::uint64_t max_memory = common_options(args).max_memory;
  switch (kind_of(path, args)) {
    case InputKind::certified: {
      VdvrFile file = read_vdvr(path, max_memory);
      if (!unverified) check_certificate(path, file);
      // The base samples alone are an ordinary volume; the certificate says nothing about their
      // interpolation.
      if (method == "dvr")
        return {as_mixed({file.volume.grid, std::move(file.volume.base)}), std::nullopt, false};
      return {std::move(file.volume), std::move(file.certificate), !unverified};
    }
    case InputKind::volume:
      return {as_mixed(read_volume(path, max_memory)), std::nullopt, false};
    case InputKind::scan:
      break;
  }
  throw InputError(
      fmt::format("{}: is neither a certified volume nor an MHA/NRRD volume; build or reconstruct it first",
                  path.string()));
}

namespace {

constexpr std::size_t kBins = 1024;
using Histogram = std::array<double, kBins>;

/// The bin below which the object's background lies: the split with the largest variance between the two
/// classes.
std::size_t otsu_bin(const Histogram& histogram) {
  double count = 0, sum = 0;
  for (std::size_t i = 0; i < kBins; ++i) {
    count += histogram[i];
    sum += histogram[i] * static_cast<double>(i);
  }
  double below = 0, sum_below = 0, best = -1;
  std::size_t split = 0;
  for (std::size_t i = 0; i + 1 < kBins; ++i) {
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

}  // namespace

Brightness brightness_of(const MixedVolume& volume) {
  const auto& base = volume.base;
  const auto [least, largest] = std::minmax_element(base.begin(), base.end());
  const double lo = static_cast<double>(*least), hi = static_cast<double>(*largest);
  Brightness b{lo, hi, 0.5 * (lo + hi), {}};
  const std::int64_t index = largest - base.begin();
  const Index3 n = volume.grid.samples();
  b.brightest = volume.grid.position({index % n[0], index / n[0] % n[1], index / (n[0] * n[1])});
  if (!(hi > lo)) return b;

  // Exact zeros are what was not covered, not part of the picture.
  Histogram histogram{};
  double count = 0;
  const double scale = (kBins - 1) / (hi - lo);
  for (const float s : base) {
    if (s == 0.0f) continue;
    histogram[static_cast<std::size_t>((static_cast<double>(s) - lo) * scale)] += 1;
    count += 1;
  }
  const auto value = [&](std::size_t bin) { return lo + (static_cast<double>(bin) + 0.5) / scale; };
  const auto quantile = [&](double q) {
    double sum = 0;
    std::size_t bin = 0;
    for (; bin + 1 < kBins && sum + histogram[bin] < q * count; ++bin) sum += histogram[bin];
    return value(bin);
  };
  b.lo = quantile(0.005);
  b.hi = std::min(hi, quantile(0.999));
  b.threshold = value(otsu_bin(histogram));
  if (!(b.hi > b.lo)) {
    b.lo = lo;
    b.hi = hi;
  }
  return b;
}

SamplerKind safe_sampler(SamplerKind asked, const std::optional<Certificate>& certificate) {
  const bool automatic = asked == SamplerKind::automatic;
  if (automatic && certificate && !certificate->holds_image3d.value_or(false)) return SamplerKind::buffer;
  return asked;
}

const char* sampler_name(SamplerKind kind) {
  return kind == SamplerKind::image3d ? "image3d" : kind == SamplerKind::buffer ? "buffer" : "auto";
}

bool is_thin(const Grid& grid) {
  const double height = static_cast<double>(grid.cells[2]) * grid.spacing[2];
  const double width = static_cast<double>(std::max(grid.cells[0], grid.cells[1])) * grid.spacing[0];
  return grid.cells[2] <= 2 || height < 0.02 * width;
}

}  // namespace vdvr::cli
