#define BOOST_TEST_MODULE attack_fields
#include <boost/test/unit_test.hpp>

#include <random>

#include "host/volume/sampler/sampler_terms.hpp"
#include "tests/reference/mixed_field.hpp"
#include "tests/support/attack_chain.hpp"
#include "tests/support/attack_scans.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/verify.hpp"
#include "vdvr/raycast.hpp"

// Attacks on what comes after gold: the sampler's term, the rim of the covered region, and stored fields
// measured end to end. Without slack.
using namespace vdvr;
using namespace vdvr::attacks;

namespace {

std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

}  // namespace

BOOST_AUTO_TEST_CASE(buffer_sampler_stays_within_its_term) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  double closest = 0;
  for (const std::int64_t cells : {5, 67, 1025, 4097})
    for (const char* kind : {"random", "comb", "constant"}) {
      Grid grid;
      grid.cells = {cells, 3, 2};
      grid.spacing = {0.7, 1.1, 0.9};
      grid.origin = {-0.35 * static_cast<double>(cells), 2.2, -7.7};
      MixedVolume v = support::random_mixed(grid, 4, 4, {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {0, 0, 2}}, 11);
      // A comb has the largest slope there is, everywhere; constants have none, so that only interpolation
      // rounds.
      const bool constant = kind == std::string("constant");
      const auto comb = [&](Samples<float>& s) {
        for (std::size_t i = 0; i < s.size(); ++i) s[i] = constant ? 1.9999999f : i % 2 == 0 ? 1.0f : -1.0f;
      };
      if (kind != std::string("random")) {
        comb(v.base.f32);
        for (auto& [level, tile] : v.tiles) comb(tile.f32);
      }
      const double bound = sampler_terms(field_slopes(v), grid, SamplerProbe{}, 1, 0, 1).buffer.value;
      for (int i = 0; i < 4000; ++i) {
        Vec3 cell{}, p{};
        for (std::size_t a = 0; a < 3; ++a) {
          cell[a] = unit(random) * static_cast<double>(grid.cells[a]);
          // Mostly at the far end, where a coordinate rounds most.
          if (a == 0 && i % 4 != 0) cell[a] = static_cast<double>(cells) - unit(random) * 0.999;
          p[a] = grid.origin[a] + cell[a] * grid.spacing[a];
          cell[a] = (p[a] - grid.origin[a]) / grid.spacing[a];
        }
        // The brick that answers is the sampler's; at faces, where bricks disagree, the coordinate decides.
        const double truth = reference::field_of_brick(v, brick_at(v, p), cell);
        const double error = std::abs(static_cast<double>(sample_at(v, p)) - truth);
        closest = std::max(closest, error / bound);
        BOOST_TEST(error <= tolerance::bound(bound), kind << ", " << cells << " cells, at cell " << cell[0]
                                                          << ", " << cell[1] << ", " << cell[2] << ": error "
                                                          << error << ", bound " << bound);
      }
    }
  BOOST_TEST_MESSAGE("  sampler: error / bound " << closest);
}

BOOST_AUTO_TEST_CASE(every_gold_cell_with_a_covered_point_is_tested) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const std::int64_t rows : {4, 1}) {
    const Scan scan{"edge", noise(geometry(rows == 1 ? 44 : 11, rows, 24), 21), {}, 0};
    Chain chain(scan.data);
    for (const int gold : {2, 4, 8})
      for (int i = 0; i < 24; ++i) {
        // On the rim of the covered disk, and at the first and last row.
        const double angle = 0.26 * i, r = 12;
        const double z = rows == 1 ? 0.0 : i % 3 == 0 ? 1.5 : i % 3 == 1 ? -1.5 : 0.1;
        const Rates rates{8, Interpolation::six_taps, gold};
        const GoldNodes l =
            stream_nodes(chain,
                         grid_at(scan.data.geometry, {r * std::cos(angle), r * std::sin(angle), z}, 0.9, gold,
                                 Place::cell),
                         rates);
        std::int64_t missed = 0, covered = 0;
        for (std::int64_t cz = 0; cz + 1 < l.nodes[2]; ++cz)
          for (std::int64_t y = 0; y + 1 < l.nodes[1]; ++y)
            for (std::int64_t x = 0; x + 1 < l.nodes[0]; ++x) {
              // Near the corners, where a sliver of the cell may be covered; one row covers a plane only.
              const auto near = [&] {
                const double f = 0.02 * unit(random);
                return random() % 2 == 0 ? f : 1 - f;
              };
              Vec3 p = l.position(x, y, cz);
              for (std::size_t a = 0; a < 3; ++a) p[a] += near() * l.grid.spacing[a] / gold;
              if (rows == 1 && l.position(x, y, cz)[2] <= 0 && l.position(x, y, cz + 1)[2] >= 0) p[2] = 0;
              if (!chain.exact.covered(p)) continue;
              ++covered;
              for (std::int64_t c = 0; c < 8; ++c)
                if (!(l.above[l.at(x + (c & 1), y + (c >> 1 & 1), cz + (c >> 2))] >= 0)) {
                  ++missed;
                  break;
                }
            }
        BOOST_TEST(missed == 0, missed << " of " << covered << " gold cells with a covered point have an "
                                       << "untested corner; gold " << gold << ", angle " << angle << ", z "
                                       << z);
      }
  }
}

BOOST_AUTO_TEST_CASE(measured_totals_bound_stored_fields_everywhere) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  std::int64_t fields = 0;
  double closest = 0;
  std::vector<Scan> scans{axis_peak(4, 12, 1, true), axis_peak(8, 20, -1, false), wave(17, 2, 8, 1),
                          axis_peak(2, 12, 1, false), axis_peak(2, 12, -1, false)};
  for (const Scan& s : awkward_scans())
    if (scans.size() < 22) scans.push_back(s);
  for (const Scan& scan : scans) {
    Chain chain(scan.data);
    for (const Rates& rates : {Rates{4, Interpolation::linear, 4},
                               {8, Interpolation::cubic, 8},
                               {8, Interpolation::six_taps, 8},
                               {16, Interpolation::linear, 2},
                               {2, Interpolation::linear, 16}}) {
      Grid grid = grid_at(scan.data.geometry, scan.target, 0.8, rates.gold, Place::cell);
      grid.cells = {4, 4, 2};
      GoldStream stream(device().state(), chain.filtered, chain.sups,
                        {grid, 2, rates.gold, rates.upsampling, rates.interpolation, {}});
      const int top = rates.gold == 2 ? 1 : 2;
      const auto t = static_cast<std::uint8_t>(top);
      for (int kind = 0; kind < 6; ++kind, ++fields) {
        // F itself at the stored samples; F with an offset, either sign; F with noise; F with a ridge across
        // the middle of the bricks, either sign, that dwarfs the slack.
        const double size = (kind == 0 ? 0 : kind < 4 ? 0.02 : 0.5) * chain.sups.value;
        MixedVolume v = support::sampled_mixed(
            grid, 2, rates.gold, {{0, 0, 0}, {1, 1, 1}, {t, t, t}, {1, 0, t}}, static_cast<unsigned>(fields),
            [&](double x, double y, double z) {
              const Vec3 p{grid.origin[0] + x * grid.spacing[0], grid.origin[1] + y * grid.spacing[1],
                           grid.origin[2] + z * grid.spacing[2]};
              const double ridge = 1 - std::abs(std::fmod(z, 2.0) - 1);
              const double change = kind == 1   ? 1
                                    : kind == 2 ? -1
                                    : kind == 4 ? ridge
                                    : kind == 5 ? -ridge
                                                : 2 * unit(random) - 1;
              return chain.exact.at(std::span(&p, 1))[0] + size * change;
            });
        const std::vector<std::uint8_t> all(v.level.size(), 1);
        const opencl::DeviceArray<std::uint8_t> selected(device().state(), std::span<const std::uint8_t>(all),
                                                         "all bricks");
        const DeviceField field(device().state(), v);
        const double others =
            stream.arithmetic() + sampler_terms(field_slopes(v), grid, SamplerProbe{}, 1, 0, 1).buffer.value;
        std::vector<double> total(v.level.size(), -1.0);
        stream.run(
            all,
            [&](GoldStream::Batch& batch) {
              for (const BrickMeasure& m : batch.measure(field, 1.0f, selected))
                total[at(m.brick)] = static_cast<double>(m.total);
            },
            {}, "measure");
        const double middle = grid.origin[2] + grid.spacing[2];
        std::vector<Vec3> points{scan.target, {scan.target[0], scan.target[1], middle}};
        for (int i = 0; i < 300; ++i) {
          Vec3 p{};
          for (std::size_t a = 0; a < 3; ++a)
            p[a] =
                grid.origin[a] +
                grid.spacing[a] *
                    (i < 100 ? (std::floor(unit(random) * static_cast<double>(grid.cells[a] * rates.gold)) +
                                0.5) /
                                   rates.gold
                             : unit(random) * static_cast<double>(grid.cells[a]));
          if (chain.exact.covered(p)) points.push_back(p);
        }
        const auto F = chain.exact.at(points);
        for (std::size_t i = 0; i < points.size(); ++i) {
          const Index3 b = brick_at(v, points[i]), n = v.bricks();
          const double bound = total[at((b[2] * n[1] + b[1]) * n[0] + b[0])] + others,
                       error = std::abs(static_cast<double>(sample_at(v, points[i])) - F[i]);
          if (error > 0) closest = std::max(closest, error / bound);
          BOOST_TEST(error <= tolerance::bound(bound), scan.name << ", " << name_of(rates) << ", kind "
                                                                 << kind << ": |V - F| " << error
                                                                 << ", certified " << bound);
        }
      }
    }
  }
  BOOST_TEST_MESSAGE("  " << fields << " stored fields: |V - F| / certified " << closest);
}

BOOST_AUTO_TEST_CASE(stored_nan_never_passes_verification) {
  const ProjectionSet scan = noise(geometry(11, 4, 24), 30);
  Grid grid = grid_at(scan.geometry, {1, 1, 0}, 0.8, 4, Place::cell);
  grid.cells = {4, 4, 2};
  grid.origin[2] = -0.8;
  MixedVolume v =
      support::sampled_mixed(grid, 2, 4, {{1, 1, 1}}, 1, [](double, double, double) { return 0.0; });
  v.tiles.begin()->second.f32[7] = std::numeric_limits<float>::quiet_NaN();
  Certificate stored;
  stored.epsilon_abs = 1e6;  // anything finite passes
  stored.rates.upsampling = 4;
  stored.rates.gold = 4;
  VerifyOptions options;
  options.exhaustive = true;
  const VerifyResult result = verify(device(), scan, v, stored, options);
  BOOST_TEST(!result.holds, "a field with a NaN sample is certified to " << result.total);
}
