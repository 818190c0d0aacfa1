#define BOOST_TEST_MODULE close_boundaries
#include "host/certify/closing/close_boundaries.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cstring>
#include <optional>
#include <random>

#include "host/verify/seams.hpp"
#include "host/volume/brick_layout.hpp"
#include "tests/reference/mixed_field.hpp"
#include "tests/support/open_bricks.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;
using support::anisotropic;
using support::Case;
using support::id_of;
using support::isotropic;
using support::largest_sample;
using support::random_bricks;
using support::store_as;

namespace {

// Two bricks and the closed box they share, in fine nodes (rate per cell).
struct Shared {
  Index3 a, b, low, high;
};

// Calls visit for every pair of bricks that share a face, an edge or a corner.
template <class Visit>
void for_each_pair(const OpenBricks& b, const MixedVolume& v, Visit&& visit) {
  const Index3 n = v.bricks();
  for (std::int64_t i = 0; i < v.brick_count(); ++i)
    for (int direction = 14; direction < 27; ++direction) {  // each pair once
      const Index3 p{i % n[0], i / n[0] % n[1], i / n[0] / n[1]},
          q{p[0] + direction % 3 - 1, p[1] + direction / 3 % 3 - 1, p[2] + direction / 9 - 1};
      bool inside = true;
      Shared s{p, q, {}, {}};
      for (std::size_t a = 0; a < 3; ++a) {
        inside = inside && q[a] >= 0 && q[a] < n[a];
        const std::int64_t width = b.granularity * b.rate, last = b.grid.cells[a] * b.rate;
        s.low[a] = std::max(p[a], q[a]) * width;
        s.high[a] = std::min((std::min(p[a], q[a]) + 1) * width, last);
      }
      if (inside && b.involved[static_cast<std::size_t>(i)] &&
          b.involved[static_cast<std::size_t>(id_of(n, q))])
        visit(s);
    }
}

LevelTriple level_of(const MixedVolume& v, const Index3& brick) {
  return v.level[static_cast<std::size_t>(id_of(v.bricks(), brick))];
}

// The stored sample of a brick at a fine node, if it has one there.
std::optional<float> stored_at(const MixedVolume& v, const Index3& brick, const Index3& node) {
  const LevelTriple l = level_of(v, brick);
  Index3 sample{};
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t local = node[a] - brick[a] * v.granularity * v.rate,
                       spacing = std::int64_t{v.rate} << v.coarsening[2 - a] >> l[2 - a];
    if (local % spacing != 0) return std::nullopt;
    sample[a] = local / spacing;
  }
  return static_cast<float>(reference::stored_sample(v, brick, sample));
}

// The shared sampler's value at a cell coordinate, from a chosen brick's side.
float sampled_from(const MixedVolume& v, const Index3& brick, const Vec3& cell) {
  return BrickSamples(v, brick).at(static_cast<float>(cell[0]), static_cast<float>(cell[1]),
                                   static_cast<float>(cell[2]));
}

// What the samples of a brick round to; 0 for float32.
double step_of(const MixedVolume& v, const Index3& brick) {
  const VdvrBrick r = BrickSamples(v, brick).record();
  return r.type == VDVR_F32 ? 0.0 : static_cast<double>(r.scale);
}

double coarsest_step_around(const MixedVolume& v, const Shared& s) {
  double step = 0;
  Index3 low{}, high{};
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t width = v.granularity * v.rate, last = v.bricks()[a] - 1;
    low[a] = std::max<std::int64_t>((s.low[a] + width - 1) / width - 1, 0);
    high[a] = std::min(s.high[a] / width, last);
  }
  for (std::int64_t z = low[2]; z <= high[2]; ++z)
    for (std::int64_t y = low[1]; y <= high[1]; ++y)
      for (std::int64_t x = low[0]; x <= high[0]; ++x) step = std::max(step, step_of(v, {x, y, z}));
  return step;
}

struct Setting {
  Closing closing = Closing::coarse;
  StorageChoice storage = StorageChoice::f32;
};

void check_closed(const Case& c, const Setting& setting = {}) {
  OpenBricks open = random_bricks(c);
  store_as(open, setting.storage);
  const MixedVolume v = close_boundaries(open, setting.closing);
  if (setting.closing == Closing::coarse) BOOST_TEST((v.level == open.level));

  std::int64_t shared = 0, different_bits = 0, jumps = 0, steps = 0;
  const double arithmetic = 14 * tolerance::unit_roundoff * largest_sample(v);
  std::mt19937 random(c.seed + 7);
  for_each_pair(open, v, [&](const Shared& s) {
    const LevelTriple la = level_of(v, s.a), lb = level_of(v, s.b);
    const bool same_level = la == lb;
    // A sample that one brick stores and the other interpolates lies within half of the coarsest step of the
    // bricks that store it; these touch the shared part. On an edge where a third level lies between the two
    // its rounding adds half of that, and so on: less than one step.
    int a_finer = 0, b_finer = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      a_finer = std::max(a_finer, la[a] - lb[a]);
      b_finer = std::max(b_finer, lb[a] - la[a]);
    }
    const double rounding = coarsest_step_around(v, s) / 2 * (std::min(a_finer, 2) + std::min(b_finer, 2));
    const auto compare = [&](const Vec3& cell) {
      const double difference = std::abs(static_cast<double>(sampled_from(v, s.a, cell)) -
                                         static_cast<double>(sampled_from(v, s.b, cell)));
      if (!(difference <= arithmetic + rounding)) ++jumps;
      if (same_level && difference != 0) ++steps;
    };
    for (std::int64_t z = s.low[2]; z <= s.high[2]; ++z)
      for (std::int64_t y = s.low[1]; y <= s.high[1]; ++y)
        for (std::int64_t x = s.low[0]; x <= s.high[0]; ++x) {
          const auto a = stored_at(v, s.a, {x, y, z}), b = stored_at(v, s.b, {x, y, z});
          const double h = 1.0 / c.rate;
          compare({static_cast<double>(x) * h, static_cast<double>(y) * h, static_cast<double>(z) * h});
          if (!a || !b) continue;
          ++shared;
          if (std::memcmp(&*a, &*b, sizeof(float)) != 0) ++different_bits;
        }
    for (int i = 0; i < 16; ++i) {  // between samples; multiples of 2^-12 of a cell are exact in fp32
      Vec3 cell{};
      for (std::size_t a = 0; a < 3; ++a) {
        std::uniform_int_distribution<std::int64_t> at(s.low[a] * 4096 / c.rate, s.high[a] * 4096 / c.rate);
        cell[a] = static_cast<double>(at(random)) / 4096;
      }
      compare(cell);
    }
  });
  BOOST_TEST_CONTEXT("closing " << static_cast<int>(setting.closing) << ", storage "
                                << static_cast<int>(setting.storage) << ", granularity " << c.granularity
                                << ", seed " << c.seed) {
    BOOST_TEST(shared > 0);
    BOOST_TEST(different_bits == 0);
    BOOST_TEST(jumps == 0);
    BOOST_TEST(steps == 0);
    BOOST_TEST(compare_seams(v).different == 0);  // outsiders too
  }
}

const std::vector<StorageChoice> storages{StorageChoice::f32, StorageChoice::u16, StorageChoice::u8,
                                          StorageChoice::automatic};

}  // namespace

BOOST_AUTO_TEST_CASE(closed_field_is_continuous_and_shares_its_bits) {
  for (const StorageChoice storage : storages)
    for (const int g : {1, 2, 4, 8})
      for (const unsigned seed : {1u, 2u}) {
        const std::int64_t n = g == 8 ? 2 : 3;
        const Case c{{n * g + g, n * g, n * g}, g, 4, isotropic, 1.0, seed};
        for (const Closing closing : {Closing::coarse, Closing::paper}) check_closed(c, {closing, storage});
        Case d = c;
        d.triples = anisotropic;
        check_closed(d, {Closing::coarse, storage});
      }
}

BOOST_AUTO_TEST_CASE(partial_last_bricks_close_too) {
  for (const StorageChoice storage : storages) {
    for (const Index3& cells : {Index3{10, 7, 5}, {5, 9, 13}, {4, 1, 6}}) {
      check_closed({cells, 4, 4, isotropic, 1.0, 5}, {Closing::coarse, storage});
      check_closed({cells, 4, 4, isotropic, 1.0, 5}, {Closing::paper, storage});
      check_closed({cells, 4, 4, anisotropic, 1.0, 5}, {Closing::coarse, storage});
    }
    check_closed({{7, 3, 5}, 2, 8, {{0, 0, 0}, {3, 3, 3}, {1, 1, 1}, {2, 2, 2}}, 1.0, 6},
                 {Closing::paper, storage});
    check_closed({{7, 3, 5}, 2, 8, {{0, 0, 0}, {3, 3, 3}, {1, 1, 1}, {0, 3, 2}}, 1.0, 6},
                 {Closing::coarse, storage});
  }
}

BOOST_AUTO_TEST_CASE(bases_coarser_than_the_grid_close_too) {
  // Up to gold at 4x.
  const auto triples = [](const LevelTriple& coarsening) {
    std::vector<LevelTriple> all{{0, 0, 0}, {1, 2, 0}, {0, 0, 2}, {2, 1, 1}, {4, 1, 2}, {0, 3, 0}};
    for (LevelTriple& l : all)
      for (std::size_t a = 0; a < 3; ++a) l[a] = std::min<std::uint8_t>(l[a], 2 + coarsening[a]);
    return all;
  };
  for (const StorageChoice storage : storages) {
    for (const LevelTriple& coarsening : {LevelTriple{2, 0, 1}, {0, 2, 2}, {1, 1, 0}})
      for (const double involved : {1.0, 0.7})
        check_closed({{12, 12, 12}, 4, 4, triples(coarsening), involved, 8, 0, coarsening},
                     {Closing::coarse, storage});
    check_closed({{14, 12, 10}, 4, 4, triples({1, 2, 1}), 1.0, 9, 0, {1, 2, 1}}, {Closing::coarse, storage});
  }
}

BOOST_AUTO_TEST_CASE(bricks_that_take_part_close_among_themselves_and_all_share_bits) {
  for (const StorageChoice storage : storages)
    for (const unsigned seed : {11u, 12u}) {
      check_closed({{14, 12, 10}, 2, 4, isotropic, 0.7, seed}, {Closing::coarse, storage});
      check_closed({{14, 12, 10}, 2, 4, isotropic, 0.7, seed}, {Closing::paper, storage});
      check_closed({{14, 12, 10}, 2, 4, anisotropic, 0.7, seed}, {Closing::coarse, storage});
    }
}

BOOST_AUTO_TEST_CASE(base_samples_that_a_brick_of_the_certificate_reads_stay) {
  for (const StorageChoice storage : storages) {
    OpenBricks open = random_bricks({{10, 7, 6}, 2, 4, anisotropic, 0.6, 3});
    store_as(open, storage);
    const MixedVolume v = close_boundaries(open);
    const std::vector<float> base = decoded(v.base, v.step);
    const Index3 n = v.bricks(), samples = v.grid.samples();
    for (std::int64_t i = 0; i < v.brick_count(); ++i) {
      if (!open.involved[static_cast<std::size_t>(i)] ||
          open.level[static_cast<std::size_t>(i)] != LevelTriple{0, 0, 0})
        continue;
      const Index3 p{i % n[0], i / n[0] % n[1], i / n[0] / n[1]};
      const auto last = [&](std::size_t a) { return std::min(v.grid.cells[a], (p[a] + 1) * v.granularity); };
      for (std::int64_t z = p[2] * v.granularity; z <= last(2); ++z)
        for (std::int64_t y = p[1] * v.granularity; y <= last(1); ++y)
          for (std::int64_t x = p[0] * v.granularity; x <= last(0); ++x) {
            const auto at = static_cast<std::size_t>((z * samples[1] + y) * samples[0] + x);
            BOOST_REQUIRE(base[at] == open.base[at]);
          }
    }
  }
}

BOOST_AUTO_TEST_CASE(coefficients_that_differ_between_levels_close_too) {
  for (const StorageChoice storage : storages)
    for (const double involved : {1.0, 0.7}) {
      Case c{{12, 9, 7}, 4, 4, isotropic, involved, 21};
      c.offset_of_levels = 0.1;
      check_closed(c, {Closing::coarse, storage});
      c.granularity = 2;
      c.triples = anisotropic;
      check_closed(c, {Closing::coarse, storage});
    }
}

BOOST_AUTO_TEST_CASE(bricks_with_tolerances_of_their_own_close_too) {
  for (const StorageChoice storage : storages)
    for (const double involved : {1.0, 0.7})
      for (const unsigned seed : {31u, 32u})
        check_closed({{12, 10, 8}, 2, 4, anisotropic, involved, seed, 0.1, {}, true},
                     {Closing::coarse, storage});
}

BOOST_AUTO_TEST_CASE(the_strictest_that_is_not_of_the_base_owns_what_is_shared) {
  // Two bricks side by side along x, alike along the face; what they fitted differs.
  Case c{{4, 2, 2}, 2, 4, {{1, 1, 1}, {1, 1, 2}}, 1.0, 1, 0.1};
  OpenBricks open = random_bricks(c);
  while (open.level[0] == open.level[1]) {
    ++c.seed;
    open = random_bricks(c);
  }
  const std::size_t coarse = open.level[0] == LevelTriple{1, 1, 1} ? 0 : 1, fine = 1 - coarse;
  const auto on_face = [&](std::size_t brick, const MixedVolume& v) {
    return *stored_at(v, {static_cast<std::int64_t>(brick), 0, 0}, {8, 2, 2});
  };
  const auto own = [&](std::size_t brick) { return on_face(brick, close_boundaries(open, Closing::none)); };
  BOOST_REQUIRE(own(coarse) != own(fine));
  BOOST_TEST(on_face(fine, close_boundaries(open)) == own(coarse));
  open.tolerance.assign(2, 0.25f);
  BOOST_TEST(on_face(fine, close_boundaries(open)) == own(coarse));
  open.tolerance[fine] = 0.01f;
  BOOST_TEST(on_face(fine, close_boundaries(open)) == own(fine));
  BOOST_TEST(on_face(coarse, close_boundaries(open)) == own(fine));
  // Nobody can give the base another value.
  open.level[coarse] = {0, 0, 0};
  open.samples.put(coarse, {});
  const MixedVolume v = close_boundaries(open);
  BOOST_TEST(*stored_at(v, {static_cast<std::int64_t>(fine), 0, 0}, {8, 4, 4}) ==
             open.base[(1 * 3 + 1) * 5 + 2]);
}

BOOST_AUTO_TEST_CASE(integers_are_within_half_a_step_of_what_float32_stores) {
  // All bricks at one level, so that nothing but rounding differs.
  for (const StorageChoice storage : {StorageChoice::u16, StorageChoice::u8}) {
    OpenBricks open = random_bricks({{10, 7, 6}, 2, 4, {{2, 2, 2}}, 1.0, 3});
    const MixedVolume exact = close_boundaries(open);
    store_as(open, storage);
    const MixedVolume v = close_boundaries(open);
    BOOST_TEST(v.step > 0);
    const Index3 n = v.bricks();
    double coarsest = 0;
    for (std::int64_t i = 0; i < v.brick_count(); ++i)
      coarsest = std::max(coarsest, step_of(v, {i % n[0], i / n[0] % n[1], i / n[0] / n[1]}));
    BOOST_TEST(coarsest > 0);
    BOOST_TEST(coarsest <= open.lattice.base_step());
    for (std::int64_t i = 0; i < v.brick_count(); ++i) {
      const BrickSamples a(exact, {i % n[0], i / n[0] % n[1], i / n[0] / n[1]}),
          b(v, {i % n[0], i / n[0] % n[1], i / n[0] / n[1]});
      for (std::int64_t z = 0; z <= a.end()[2]; ++z)
        for (std::int64_t y = 0; y <= a.end()[1]; ++y)
          for (std::int64_t x = 0; x <= a.end()[0]; ++x)
            BOOST_REQUIRE(std::abs(static_cast<double>(a(x, y, z)) - static_cast<double>(b(x, y, z))) <=
                          tolerance::bound(coarsest / 2));
    }
  }
}

BOOST_AUTO_TEST_CASE(samples_inside_a_brick_stay_gold_and_planes_beyond_the_grid_repeat) {
  const OpenBricks open = random_bricks({{10, 7, 6}, 4, 4, anisotropic, 1.0, 4});
  const MixedVolume v = close_boundaries(open);
  const Index3 n = v.bricks();
  for (std::int64_t i = 0; i < v.brick_count(); ++i) {
    const LevelTriple l = v.level[static_cast<std::size_t>(i)];
    if (l == LevelTriple{0, 0, 0}) continue;
    const Index3 p{i % n[0], i / n[0] % n[1], i / n[0] / n[1]};
    const auto side = v.tile_shape(l);
    const float* tile = v.tiles.at(l).f32.data() +
                        static_cast<std::int64_t>(v.tile[static_cast<std::size_t>(i)]) * v.tile_size(l);
    Index3 end{};
    for (std::size_t a = 0; a < 3; ++a)
      end[a] = std::min<std::int64_t>(v.granularity, v.grid.cells[a] - p[a] * v.granularity) << l[2 - a];
    const auto index = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
      return (z * side[1] + y) * side[2] + x;
    };
    for (std::int64_t z = 0; z < side[0]; ++z)
      for (std::int64_t y = 0; y < side[1]; ++y)
        for (std::int64_t x = 0; x < side[2]; ++x) {
          const bool beyond = x > end[0] || y > end[1] || z > end[2];
          const bool border = x == 0 || y == 0 || z == 0 || x == end[0] || y == end[1] || z == end[2];
          if (beyond)
            BOOST_REQUIRE(tile[index(x, y, z)] ==
                          tile[index(std::min(x, end[0]), std::min(y, end[1]), std::min(z, end[2]))]);
          else if (!border)
            BOOST_REQUIRE(
                tile[index(x, y, z)] ==
                open.samples[static_cast<std::size_t>(i)][static_cast<std::size_t>(index(x, y, z))]);
        }
  }
}

BOOST_AUTO_TEST_CASE(neighbours_that_take_no_part_lower_nothing) {
  OpenBricks open = random_bricks({{6, 6, 6}, 2, 4, {{2, 2, 2}}, 1.0, 8});
  constexpr std::size_t middle = 13;  // of 3 x 3 x 3
  for (std::size_t i = 0; i < open.level.size(); ++i) {
    if (i == middle) continue;
    open.involved[i] = 0;
    open.level[i] = {0, 0, 0};
    open.samples.drop(i);
  }
  const MixedVolume v = close_boundaries(open);
  const auto& tile = v.tiles.at({2, 2, 2}).f32;
  for (std::size_t i = 0; i < tile.size(); ++i) {
    BOOST_REQUIRE(tile[i] == open.samples[middle][i]);
  }
  for (int part = 0; part < 27; ++part) {
    const auto incident = incident_bricks(open, middle, {part % 3, part / 3 % 3, part / 9});
    BOOST_TEST(incident.size() == 1);
    BOOST_TEST(incident.front() == static_cast<std::int64_t>(middle));
  }
}

BOOST_AUTO_TEST_CASE(a_coarse_neighbour_decides_the_shared_face) {
  OpenBricks open = random_bricks({{4, 2, 2}, 2, 4, {{2, 2, 2}}, 1.0, 9});
  open.level[0] = {0, 0, 0};
  open.samples.drop(0);
  const MixedVolume v = close_boundaries(open);
  for (std::int64_t z = 0; z <= 8; ++z)
    for (std::int64_t y = 0; y <= 8; ++y) {
      const double coarse = reference::field_of_brick(
          v, {0, 0, 0}, {2, static_cast<double>(y) / 4, static_cast<double>(z) / 4});
      BOOST_TEST(std::abs(static_cast<double>(stored_at(v, {1, 0, 0}, {8, y, z}).value()) - coarse) <=
                 14 * tolerance::unit_roundoff * largest_sample(v));
    }
}
