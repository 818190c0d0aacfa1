// Sums over samples as planes come, and a search that halves its step.
#include "host/verify/audit/audit_points.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <span>
#include <utility>

#include "host/base/system/casts.hpp"
#include "vdvr/expert/reconstruct.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr {
namespace {

constexpr std::size_t kWorstSamples = 24;
constexpr double kMostWork = 1e10;  // multiply-adds of one round

/// A height costs the coefficients of all views, of cone beam a point does.
std::size_t affordable(const ExactField& exact) {
  const ParallelGeometry& g = exact.geometry();
  return at(static_cast<std::int64_t>(
      std::clamp(kMostWork / static_cast<double>(g.views() * g.rows * g.columns), 12.0, 1e4)));
}

struct Candidate {
  double error = -1, w = 0, f = 0;
  Vec3 cells{0, 0, 0};
};

Vec3 world(const Grid& grid, const Vec3& cells) {
  Vec3 p{};
  for (std::size_t a = 0; a < 3; ++a) p[a] = grid.origin[a] + cells[a] * grid.spacing[a];
  return p;
}

/// As many of the points, the first ones, as can be afforded; the worst first.
std::vector<Candidate> evaluate(const ExactField& exact, const AuditedVolume& w,
                                const std::vector<Vec3>& points, const Progress& progress) {
  const std::size_t most = affordable(exact);
  std::set<double> heights;
  std::vector<Vec3> taken, places;
  for (const Vec3& p : points) {
    const bool known = heights.count(p[2]) > 0;
    if (exact.views().empty() ? heights.size() >= most && !known : taken.size() >= most) continue;
    heights.insert(p[2]);
    taken.push_back(p);
    places.push_back(world(w.grid(), p));
  }
  const std::vector<double> f = exact.at(places, progress);
  std::vector<Candidate> out(taken.size());
  for (std::size_t i = 0; i < taken.size(); ++i) {
    const double value = w.value_at(taken[i]);
    out[i] = {std::abs(value - f[i]), value, f[i], taken[i]};
  }
  std::sort(out.begin(), out.end(), [](const Candidate& a, const Candidate& b) { return a.error > b.error; });
  return out;
}

/// Places in a box, ends included. Nearest jumps in the middle of cells and is looked at from either side.
void add_lattice(std::vector<Vec3>& points, const AuditedVolume& w, const Vec3& low, const Vec3& high) {
  static const std::vector<double> halves{0, 0.5, 1}, sides{0, 0.25, 0.499999, 0.500001, 0.75, 1};
  const std::vector<double>& parts = w.between() == Between::nearest ? sides : halves;
  for (const double z : parts)
    for (const double y : parts)
      for (const double x : parts) {
        const Vec3 part{x, y, z};
        Vec3 p{};
        for (std::size_t a = 0; a < 3; ++a)
          p[a] =
              std::clamp(low[a] + part[a] * (high[a] - low[a]), 0.0, static_cast<double>(w.grid().cells[a]));
        const auto cell = [&](std::size_t a) {
          return std::min(static_cast<std::int64_t>(p[a]), w.grid().cells[a] - 1);
        };
        if (w.cell_counts(cell(0), cell(1))) points.push_back(p);
      }
}

void take(const AuditedVolume& w, const Candidate& c, AuditFigures& figures) {
  if (c.error <= figures.lower) return;
  figures.lower = c.error;
  figures.lower_at = world(w.grid(), c.cells);
  figures.w_there = c.w;
  figures.f_there = c.f;
}

}  // namespace

std::vector<Vec3> compare_samples(Device& device, const ProjectionSet& scan, const FieldOptions& field,
                                  const ExactField& exact, const AuditedVolume& w, AuditFigures& figures,
                                  const Progress& progress) {
  // What its interpolation errs lies far below what programs differ by; the worst samples are looked at
  // again.
  const ReconstructOptions fine{field, 16, scan.cone ? Interpolation::linear : Interpolation::cubic};
  const Index3 n = w.grid().samples();
  const Samples<float>& samples = w.field().base.f32;
  std::vector<std::pair<double, Vec3>> worst;
  double squares = 0;
  figures.range = {INFINITY, -INFINITY};
  const auto planes = [&](std::int64_t first_z, std::span<const float> f) {
    throw_if_stopped();
    const std::int64_t count_z = static_cast<std::int64_t>(f.size()) / (n[0] * n[1]);
    for (std::int64_t z = 0; z < count_z; ++z)
      for (std::int64_t y = 0; y < n[1]; ++y)
        for (std::int64_t x = 0; x < n[0]; ++x) {
          if (!w.sample_counts(x, y)) continue;
          const auto truth = static_cast<double>(f[at((z * n[1] + y) * n[0] + x)]),
                     error = static_cast<double>(samples[at(((z + first_z) * n[1] + y) * n[0] + x)]) - truth;
          ++figures.samples;
          squares += error * error;
          figures.range = {std::min(figures.range.first, truth), std::max(figures.range.second, truth)};
          if (worst.size() == kWorstSamples && std::abs(error) <= worst.back().first) continue;
          if (worst.size() == kWorstSamples) worst.pop_back();
          const std::pair<double, Vec3> found{
              std::abs(error),
              {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z + first_z)}};
          worst.insert(std::upper_bound(worst.begin(), worst.end(), found,
                                        [](const auto& a, const auto& b) { return a.first > b.first; }),
                       found);
        }
  };
  reconstruct_planes(device, scan, w.grid(), fine, planes, progress);
  figures.rms = figures.samples > 0 ? std::sqrt(squares / static_cast<double>(figures.samples)) : 0;
  std::vector<Vec3> points;
  for (const auto& [error, place] : worst) points.push_back(place);
  const std::vector<Candidate> found = evaluate(exact, w, points, progress);
  figures.largest = found.front().error;
  figures.largest_at = world(w.grid(), found.front().cells);
  take(w, found.front(), figures);
  return points;
}

void search_worst(const ExactField& exact, const AuditedVolume& w, const std::vector<WorstBox>& boxes,
                  const std::vector<Vec3>& points, AuditFigures& figures, const Progress& progress) {
  std::vector<Vec3> places;
  for (const WorstBox& b : boxes) add_lattice(places, w, b.low, b.high);
  // Around samples that are far off: halfway to their neighbours.
  for (const Vec3& p : points) {
    constexpr double half = 0.5;
    add_lattice(places, w, {p[0] - half, p[1] - half, p[2] - half}, {p[0] + half, p[1] + half, p[2] + half});
  }
  std::vector<Candidate> found = evaluate(exact, w, places, progress);
  double step = 0.25;
  for (int round = 0; round < 4 && !found.empty(); ++round, step /= 2) {
    take(w, found.front(), figures);
    places.clear();
    for (std::size_t i = 0; i < std::min<std::size_t>(found.size(), 4); ++i) {
      const Vec3& c = found[i].cells;
      add_lattice(places, w, {c[0] - step, c[1] - step, c[2] - step},
                  {c[0] + step, c[1] + step, c[2] + step});
    }
    found = evaluate(exact, w, places, progress);
  }
  if (!found.empty()) take(w, found.front(), figures);
}

}  // namespace vdvr
