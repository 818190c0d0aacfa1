#include "apps/paper/fields.hpp"

#include <cmath>

#include "apps/paper/parallel_rows.hpp"

namespace vdvr::paper {
namespace {

std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

/// Calls value(point) for every sample of a grid, plane by plane.
template <class Value>
std::vector<float> each_sample(const Grid& grid, const Progress& progress, Value&& value) {
  const Index3 n = grid.samples();
  std::vector<float> out(at(grid.sample_count()));
  parallel_rows(n[2] * n[1], progress, "sample", [&](std::int64_t row) {
    for (std::int64_t x = 0; x < n[0]; ++x)
      out[at(row * n[0] + x)] = static_cast<float>(value(grid.position({x, row % n[1], row / n[1]})));
  });
  return out;
}

Grid centred(const Index3& cells, double spacing) {
  Grid grid;
  grid.cells = cells;
  grid.spacing = {spacing, spacing, spacing};
  for (std::size_t a = 0; a < 3; ++a) grid.origin[a] = -0.5 * static_cast<double>(cells[a]) * spacing;
  return grid;
}

}  // namespace

TestScan marschner_lobb_scan(int angles, const Progress& progress) {
  const double half_side = 32 / std::sqrt(2.0);
  SimulateOptions o;
  o.angles = angles;
  o.columns = o.rows = 65;
  TestScan t;
  t.object = marschner_lobb(half_side);
  t.scan = simulate(t.object, o, progress);
  t.grid = centred({64, 64, 64}, half_side / 32);
  return t;
}

TestScan shepp_logan_scan(bool tumours, const Progress& progress) {
  SimulateOptions o;
  o.angles = 202;
  o.columns = o.rows = 129;
  TestScan t;
  t.object = shepp_logan(64);
  t.scan = simulate(t.object, o, progress);
  t.grid = tumours ? centred({32, 32, 16}, 1) : centred({128, 128, 128}, 1);
  return t;
}

Grid lattice(const Grid& grid, const Index3& samples, double part) {
  Grid out = grid;
  for (std::size_t a = 0; a < 3; ++a) {
    const double length = static_cast<double>(grid.cells[a]) * grid.spacing[a], used = a < 2 ? part : 1;
    out.cells[a] = samples[a] - 1;
    out.spacing[a] = length * used / static_cast<double>(samples[a]);
    out.origin[a] = grid.origin[a] + 0.5 * length * (1 - used) + 0.5 * out.spacing[a];
  }
  return out;
}

Grid slice_lattice(const Grid& grid, std::int64_t side, double z, double part) {
  Grid out = lattice(grid, {side, side, 2}, part);
  out.origin[2] = z;
  out.spacing[2] = 1e-3 * grid.spacing[2];
  return out;
}

std::vector<float> function_on(const Phantom& object, const Grid& grid) {
  return each_sample(grid, {}, object.density);
}

namespace {

std::vector<float> reconstructed(Device& device, const ProjectionSet& scan, const Grid& grid, int upsampling,
                                 Interpolation interpolation, const Progress& progress) {
  ReconstructOptions o;
  o.upsampling = upsampling;
  o.interpolation = interpolation;
  return reconstruct(device, scan, grid, o, progress).samples;
}

}  // namespace

std::vector<float> field_on(Device& device, const ProjectionSet& scan, const Grid& grid,
                            const Progress& progress) {
  return reconstructed(device, scan, grid, 16, Interpolation::cubic, progress);
}

std::vector<float> paper_field_on(Device& device, const ProjectionSet& scan, const Grid& grid,
                                  const Progress& progress) {
  return reconstructed(device, scan, grid, 8, Interpolation::linear, progress);
}

Volume uniform_volume(Device& device, const ProjectionSet& scan, const Grid& grid, const Progress& progress) {
  return {grid, paper_field_on(device, scan, grid, progress)};
}

std::vector<float> d2vr_on(const D2vrField& field, const Grid& grid, const Progress& progress) {
  // Plane by plane: points take six times the memory of their values.
  const Index3 n = grid.samples();
  std::vector<float> out;
  out.reserve(at(grid.sample_count()));
  std::vector<Vec3> points;
  for (std::int64_t z = 0; z < n[2]; ++z) {
    report(progress, "sample projections", static_cast<double>(z) / static_cast<double>(n[2]));
    points.clear();
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x) points.push_back(grid.position({x, y, z}));
    const std::vector<float> plane = field.at(points);
    out.insert(out.end(), plane.begin(), plane.end());
  }
  return out;
}

std::vector<float> stored_on(const MixedVolume& volume, const Grid& grid, const Progress& progress) {
  return each_sample(grid, progress, [&](const Vec3& p) { return sample_at(volume, p); });
}

}  // namespace vdvr::paper
