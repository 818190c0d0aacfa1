// What filters between kept nodes of cone beam err along three axes, in double precision: F at the nodes that
// they read, filtered, against F. Beside computed gold, tables and rounding hide it.
#define BOOST_TEST_MODULE cone_filters
#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <span>
#include <string>

#include "host/certify/kept/cone_tiles.hpp"
#include "tests/support/attack_chain.hpp"
#include "tests/support/cone_attacks.hpp"
#include "tests/support/cone_scans.hpp"
#include "tests/support/tolerance.hpp"

namespace vdvr {
namespace {

using attacks::Chain;
using attacks::device;

constexpr int taps = 20;
using Filters = std::array<GoldFilter, 3>;

// Nodes half a pixel apart, with bounds as far around the region as filters read.
ConeLattice lattice_of(const Coverage& coverage, double spacing) {
  ConeLattice out;
  out.spacing = {spacing, spacing, spacing};
  out.claimed = out.reach = taps * spacing;
  out.claimed_z = {coverage.heights().first - taps * spacing, coverage.heights().second + taps * spacing};
  out.groups = 1;
  out.stride = 32;
  return out;
}

// At a place in the middle between nodes along the axes whose filters have two phases.
double filtered(const Chain& chain, const Filters& filters, const Vec3& place, double spacing) {
  std::vector<Vec3> points;
  std::vector<double> weights;
  const auto along = [&](std::size_t a) { return filters[a].rate == 1 ? 1 : filters[a].taps; };
  const auto step = [&](std::size_t a, int i) {
    return filters[a].rate == 1 ? 0.0 : (filters[a].first() + i - 0.5) * spacing;
  };
  const auto weight = [&](std::size_t a, int i) {
    return filters[a].rate == 1
               ? 1.0
               : static_cast<double>(filters[a].weights[static_cast<std::size_t>(filters[a].taps + i)]);
  };
  for (int z = 0; z < along(2); ++z)
    for (int y = 0; y < along(1); ++y)
      for (int x = 0; x < along(0); ++x) {
        points.push_back({place[0] + step(0, x), place[1] + step(1, y), place[2] + step(2, z)});
        weights.push_back(weight(0, x) * weight(1, y) * weight(2, z));
      }
  const auto F = chain.exact.at(points);
  double sum = 0;
  for (std::size_t i = 0; i < F.size(); ++i) sum += weights[i] * F[i];
  return sum;
}

// One wave of one view, which a crest of meets the isocentre, or little more.
ProjectionSet wave_of(const testing::ConeShape& s, std::size_t view, std::size_t m, std::size_t l) {
  ProjectionSet scan = testing::noisy_cone(s);
  const auto rows = static_cast<std::size_t>(s.rows), columns = static_cast<std::size_t>(s.columns);
  attacks::FilteredViews q(scan.cone->views.size(), std::vector<double>(rows * columns, 0.0));
  for (std::size_t v = 0; v < rows; ++v)
    for (std::size_t u = 0; u < columns; ++u)
      q[view][v * columns + u] = std::cos(reference::frequency(m, columns) * (static_cast<double>(u) + 0.5)) *
                                 std::cos(reference::frequency(l, rows) * (static_cast<double>(v) + 0.5));
  attacks::take_views(scan, q);
  return scan;
}

struct Case {
  std::string name;
  testing::ConeShape shape;
  std::size_t axis = 0, view = 0;  // views 0 and 6 of 24 stand at -y and at x
  std::array<std::size_t, 2> waves{14, 23}, row_waves{0, 0};
};

std::vector<Case> cases() {
  const auto orbit = [](double source, std::int64_t rows) {
    testing::ConeShape s;
    s.source_to_axis = source;
    s.rows = rows;
    return s;
  };
  return {{"fan beam of 5 degrees, x", orbit(137, 1), 0, 0},
          {"fan beam of 5 degrees, y", orbit(137, 1), 1, 6},
          {"fan beam of 7 degrees, y", orbit(100, 1), 1, 6},
          {"cone of 5 degrees, z", orbit(137, 12), 2, 0, {0, 1}, {7, 11}}};
}

// From the axis towards the source as far as bounds hold.
Vec3 place_of(const Case& c, double r) {
  return c.view == 0 ? Vec3{0.13, -r, c.shape.rows > 1 ? 0.21 : 0.0} : Vec3{r, 0.13, 0};
}

BOOST_AUTO_TEST_CASE(filters_of_cone_beam_err_no_more_than_is_charged) {
  constexpr double spacing = 0.5;
  for (const Case& c : cases()) {
    double closest = 0;
    for (std::size_t m = c.waves[0]; m <= c.waves[1]; ++m)
      for (std::size_t l = c.row_waves[0]; l <= c.row_waves[1]; ++l) {
        const ProjectionSet scan = wave_of(c.shape, c.view, m, l);
        Chain chain(scan);
        const Coverage coverage(chain.filtered.geometry, chain.filtered.views);
        const ConeLattice lattice = lattice_of(coverage, spacing);
        ConeTiles tiles(device().state(), chain.filtered, chain.upsampler, chain.sups, coverage, lattice);
        Filters filters;
        for (std::size_t a = 0; a < 3; ++a)
          filters[a] = tiles.best_filter(a == c.axis ? 2 : 1, a, taps).filter.value();
        const double bound = tiles.filter_error(filters[0], filters[1], filters[2]);
        // What F rounds by, at the place and in the sum; lambda^-2 is below 2 there.
        const double rounding = 2 * (1 + filters[c.axis].norm) * chain.exact.rounding();
        for (int i = 0; i <= 20; ++i) {
          const Vec3 place = place_of(c, i * (coverage.inner_radius() + 0.9 * lattice.claimed) / 20);
          const double error = std::abs(filtered(chain, filters, place, spacing) -
                                        chain.exact.at(std::span(&place, 1)).front());
          BOOST_TEST(error <= tolerance::bound(bound + rounding),
                     c.name << ", wave " << m << ", " << l << ": error " << error << ", bound " << bound);
          closest = std::max(closest, error / bound);
        }
      }
    BOOST_TEST_MESSAGE(c.name << ": closest " << closest);
    // One view alone, seen in one direction: nothing else is charged that could hide it.
    BOOST_TEST(closest > 0.1, c.name << ": " << closest);
  }
}

}  // namespace
}  // namespace vdvr
