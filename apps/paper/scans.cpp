#include "apps/paper/scans.hpp"

#include <algorithm>

namespace vdvr::paper {
namespace {

double extent(const Grid& g, std::size_t axis) {
  return static_cast<double>(g.cells[axis]) * g.spacing[axis];
}

Grid centred_box(const Index3& cells, const Vec3& length, const std::string& unit) {
  Grid g;
  g.cells = cells;
  g.unit = unit;
  for (std::size_t a = 0; a < 3; ++a) {
    g.spacing[a] = length[a] / static_cast<double>(cells[a]);
    g.origin[a] = -0.5 * length[a];
  }
  return g;
}

Volume centred(Volume volume) {
  for (std::size_t a = 0; a < 3; ++a) volume.grid.origin[a] = -0.5 * extent(volume.grid, a);
  return volume;
}

}  // namespace

TestScan carp_sized_scan(Volume volume, std::uint64_t max_memory_bytes, const Progress& progress) {
  volume = centred(std::move(volume));
  const Grid box = volume.grid;
  const double width = std::max(extent(box, 0), extent(box, 1)), height = extent(box, 2);
  SimulateOptions o;
  o.angles = 142;
  o.columns = 129;
  o.rows = 257;
  o.pitch_u = width / 128;
  o.pitch_v = height / 256;
  o.unit = box.unit;
  o.band_limited = false;
  o.noise_sigma = 0.05;
  o.median = 5;
  o.gaussian_u = 0.1;
  o.gaussian_v = 4;
  o.binning = 8;
  o.max_memory_bytes = max_memory_bytes;
  TestScan t;
  t.object = volume_phantom(std::move(volume));
  t.scan = simulate(t.object, o, progress);
  t.grid = centred_box({128, 128, 256}, {128 * o.pitch_u, 128 * o.pitch_u, height}, box.unit);
  return t;
}

TestScan beetle_sized_scan(const Volume& volume, const Progress& progress) {
  const Index3 cells{102, 62, 128};
  const MixedVolume source = as_mixed(centred(volume));
  Volume small{centred_box(cells, {102, 62, 128}, "pixel"), {}};
  Grid at = small.grid;  // the same samples, in the source's lengths
  for (std::size_t a = 0; a < 3; ++a) {
    at.spacing[a] = extent(source.grid, a) / static_cast<double>(cells[a]);
    at.origin[a] = source.grid.origin[a];
  }
  small.samples = stored_on(source, at, progress);
  SimulateOptions o;
  o.columns = 121;  // the diagonal of 102 x 62
  o.rows = 129;
  o.angles = 190;  // pi / 2 times the columns
  TestScan t;
  t.object = volume_phantom(small);
  t.scan = simulate(t.object, o, progress);
  t.grid = small.grid;
  return t;
}

std::vector<Tumour> tumours(const Phantom& object, const std::function<double(const Vec3&)>& value) {
  struct Place {
    const char* name;
    double x, y, half_x, half_y;  // phantom units of 64 pixels (docs/phantoms.md)
  };
  constexpr Place places[] = {{"thick", .0078125, -.1, .046, .046},
                              {"thin, left", -.0703125, .08, .012, .07},
                              {"thin, middle", .0078125, .08, .012, .07},
                              {"thin, right", .0859375, .08, .012, .07}};
  constexpr double unit = 64;
  std::vector<Tumour> found;
  for (const Place& p : places) {
    Tumour t{p.name, object.density({unit * p.x, unit * p.y, 0}), 0};
    // The middle third in y, where a tumour is near its full width; across x as far as one pixel outside.
    constexpr int lines = 21, steps = 81;
    const double reach = unit * p.half_x + 1;
    for (int j = 0; j < lines; ++j) {
      const double y = unit * (p.y + p.half_y / 3 * (2.0 * j / (lines - 1) - 1));
      double most = -1e300;
      for (int i = 0; i < steps; ++i)
        most = std::max(most, value({unit * p.x + reach * (2.0 * i / (steps - 1) - 1), y, 0}));
      t.peak += most / lines;
    }
    found.push_back(t);
  }
  return found;
}

}  // namespace vdvr::paper
