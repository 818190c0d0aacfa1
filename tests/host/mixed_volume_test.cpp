#define BOOST_TEST_MODULE mixed_volume
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <cstring>
#include <random>

#include "host/volume/brick_layout.hpp"
#include "tests/reference/mixed_field.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/expert/mixed_volume.hpp"

using namespace vdvr;

namespace {

// Cell coordinates on a lattice of 1/64 cell: exact in fp32, together with spacings and origins that are
// powers of two.
constexpr double lattice = 0x1p-6;

const std::vector<LevelTriple> mixed_triples{{0, 0, 0}, {1, 1, 1}, {0, 2, 1},
                                             {3, 0, 0}, {2, 2, 2}, {0, 0, 1}};

Grid grid_of(const Index3& cells) { return {cells, {-0.5, 2.0, 0.25}, {0.25, 0.5, 2.0}, "pixel"}; }

Vec3 world(const Grid& grid, const Vec3& cell) {
  Vec3 p{};
  for (std::size_t a = 0; a < 3; ++a) p[a] = grid.origin[a] + grid.spacing[a] * cell[a];
  return p;
}

// Three lerps, each a subtraction, a product and a sum: nine roundings on the way of any sample.
double trilinear_tolerance(double largest) { return tolerance::fp32_sum(9, largest); }

bool agrees(const MixedVolume& v, const Vec3& cell, double expected, double largest) {
  const double err = std::abs(static_cast<double>(sample_at(v, world(v.grid, cell))) - expected);
  return err <= trilinear_tolerance(largest);
}

struct Case {
  Index3 cells;
  int granularity;
  int rate;
  std::vector<LevelTriple> triples;
  LevelTriple coarsening{};
};

const std::vector<Case>& cases() {
  static const std::vector<Case> all{
      {{8, 8, 8}, 4, 8, mixed_triples},
      {{9, 5, 7}, 4, 8, mixed_triples},  // partial last bricks on every axis
      {{1, 1, 1}, 4, 8, {{3, 3, 3}}},    // one cell, one brick
      {{3, 17, 2}, 2, 4, {{0, 0, 0}, {2, 1, 0}, {0, 2, 2}}},
      {{5, 4, 3},
       1,
       64,
       {{0, 0, 0}, {6, 0, 0}, {0, 6, 0}, {0, 0, 6}, {1, 2, 3}}},  // finest levels, brick = cell
      {{13, 10, 9}, 8, 2, {{0, 0, 0}, {1, 0, 1}}},
      {{12, 10, 9}, 4, 8, {{0, 0, 0}, {0, 1, 0}, {2, 0, 3}, {3, 4, 5}}, {0, 1, 2}},
      {{8, 24, 12}, 8, 2, {{0, 0, 0}, {1, 0, 0}, {0, 2, 4}, {3, 2, 4}}, {2, 1, 3}},
  };
  return all;
}

}  // namespace

BOOST_AUTO_TEST_CASE(samples_equal_the_double_precision_reference_inside_bricks_and_on_their_borders) {
  unsigned seed = 7;
  for (const Case& c : cases()) {
    const MixedVolume v =
        support::random_mixed(grid_of(c.cells), c.granularity, c.rate, c.triples, seed++, c.coarsening);
    std::mt19937 random(seed);
    int wrong = 0;
    for (int i = 0; i < 20000; ++i) {
      Vec3 cell{};
      for (std::size_t a = 0; a < 3; ++a) {
        // Every third coordinate on a cell boundary, so that faces, edges and corners of bricks are hit
        // often.
        const auto steps =
            static_cast<double>(std::uniform_int_distribution<std::int64_t>(0, c.cells[a] * 64)(random)) *
            lattice;
        cell[a] = random() % 3 == 0 ? std::floor(steps) : steps;
      }
      if (!agrees(v, cell, reference::mixed_field(v, cell), 1.0)) ++wrong;
    }
    BOOST_TEST(wrong == 0);
  }
}

BOOST_AUTO_TEST_CASE(a_point_on_a_shared_face_belongs_to_the_brick_above_it) {
  const MixedVolume v = support::random_mixed(grid_of({8, 8, 8}), 4, 8, {{1, 1, 1}, {2, 1, 2}}, 3);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Vec3 cell{1.25, 2.5, 1.75};
    cell[axis] = 4;
    Index3 above{0, 0, 0};
    above[axis] = 1;
    const double expected = reference::field_of_brick(v, above, cell);
    BOOST_TEST(std::abs(expected - reference::field_of_brick(v, {0, 0, 0}, cell)) > trilinear_tolerance(1.0));
    BOOST_TEST(agrees(v, cell, expected, 1.0));
    // One fp32 step below the face the lower brick answers; the field moves by at most its slope, 2 * 2^level
    // per cell.
    cell[axis] = static_cast<double>(std::nextafter(4.0f, 0.0f));
    BOOST_TEST(agrees(v, cell, reference::field_of_brick(v, {0, 0, 0}, cell), 1.0));
  }
}

BOOST_AUTO_TEST_CASE(points_on_an_edge_and_on_a_corner_belong_to_the_brick_above_on_every_axis) {
  const MixedVolume v = support::random_mixed(grid_of({8, 8, 8}), 4, 8, mixed_triples, 11);
  BOOST_TEST(agrees(v, {4, 4, 1.5}, reference::field_of_brick(v, {1, 1, 0}, {4, 4, 1.5}), 1.0));
  BOOST_TEST(agrees(v, {4, 1.5, 4}, reference::field_of_brick(v, {1, 0, 1}, {4, 1.5, 4}), 1.0));
  BOOST_TEST(agrees(v, {4, 4, 4}, reference::field_of_brick(v, {1, 1, 1}, {4, 4, 4}), 1.0));
}

BOOST_AUTO_TEST_CASE(a_stored_sample_is_returned_to_the_bit) {
  const MixedVolume v = support::random_mixed(grid_of({9, 5, 7}), 4, 4, {{0, 0, 0}, {1, 2, 0}, {2, 2, 2}}, 5);
  const Index3 bricks = v.bricks();
  int wrong = 0;
  for (std::int64_t z = 0; z < v.grid.cells[2] * 4; ++z)
    for (std::int64_t y = 0; y < v.grid.cells[1] * 4; ++y)
      for (std::int64_t x = 0; x < v.grid.cells[0] * 4; ++x) {
        const Index3 quarter{x, y, z}, brick{x / 16, y / 16, z / 16};
        const LevelTriple l =
            v.level[static_cast<std::size_t>(brick[0] + bricks[0] * (brick[1] + bricks[1] * brick[2]))];
        Index3 sample{};
        bool on_sample = true;
        for (std::size_t a = 0; a < 3; ++a) {
          const std::int64_t step = 4 >> l[2 - a], local = quarter[a] - 16 * brick[a];
          on_sample = on_sample && local % step == 0;
          sample[a] = local / step;
        }
        if (!on_sample) continue;
        const Vec3 cell{static_cast<double>(x) / 4, static_cast<double>(y) / 4, static_cast<double>(z) / 4};
        if (static_cast<double>(sample_at(v, world(v.grid, cell))) !=
            reference::stored_sample(v, brick, sample))
          ++wrong;
      }
  BOOST_TEST(wrong == 0);
}

BOOST_AUTO_TEST_CASE(an_affine_function_is_reproduced_by_every_level_at_any_point) {
  const auto f = [](double x, double y, double z) { return 0.125 + 0.25 * x - 0.5 * y + 0.0625 * z; };
  // Spacing and origin without short binary fractions: the cell coordinate itself is rounded.
  const Grid grid{{9, 6, 11}, {0.1, -3.3, 7.7}, {0.7, 1.1, 0.3}, "mm"};
  const Grid even{{8, 6, 12}, {0.1, -3.3, 7.7}, {0.7, 1.1, 0.3}, "mm"};
  const MixedVolume plain = support::sampled_mixed(grid, 4, 8, mixed_triples, 2, f),
                    coarse = support::sampled_mixed(even, 4, 8, mixed_triples, 2, f, {2, 1, 2});
  double largest = 0;
  for (int corner = 0; corner < 8; ++corner)
    largest = std::max(largest, std::abs(f(corner & 1 ? 9 : 0, corner & 2 ? 6 : 0, corner & 4 ? 11 : 0)));
  // One rounding of each cell coordinate times the slope, one of each stored sample, nine of the
  // interpolation.
  const double bound =
      tolerance::unit_roundoff * (0.25 * 9 + 0.5 * 6 + 0.0625 * 11) + tolerance::fp32_sum(10, largest);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const MixedVolume* v : {&plain, &coarse}) {
    double worst = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 cell{8 * unit(random), 6 * unit(random), 11 * unit(random)};
      worst = std::max(worst, std::abs(static_cast<double>(sample_at(*v, world(v->grid, cell))) -
                                       f(cell[0], cell[1], cell[2])));
    }
    BOOST_TEST(worst <= tolerance::bound(bound));
  }
}

BOOST_AUTO_TEST_CASE(a_point_outside_is_clamped_to_the_box) {
  const MixedVolume v = support::random_mixed(grid_of({5, 6, 7}), 4, 2, {{0, 0, 0}, {1, 1, 1}}, 8);
  BOOST_TEST(sample_at(v, world(v.grid, {-3, 2, 9})) == sample_at(v, world(v.grid, {0, 2, 7})));
  BOOST_TEST(sample_at(v, world(v.grid, {8, 8, 8})) == sample_at(v, world(v.grid, {5, 6, 7})));
}

BOOST_AUTO_TEST_CASE(one_sampler_for_packed_records_and_for_single_points) {
  for (const auto& types :
       {std::vector{SampleType::f32}, std::vector{SampleType::u16}, std::vector{SampleType::u8},
        std::vector{SampleType::u8, SampleType::f32, SampleType::u16}}) {
    const MixedVolume random_floats =
        types.front() == SampleType::u16
            ? support::random_mixed(grid_of({8, 6, 7}), 4, 8, mixed_triples, 21, {0, 1, 2})
            : support::random_mixed(grid_of({9, 5, 7}), 4, 8, mixed_triples, 21);
    const MixedVolume v = types.size() > 1 ? support::in_types_by_tile(random_floats, types)
                                           : support::in_types(random_floats, types);
    BOOST_TEST(v.level.size() > 1u);
    const auto offsets = tile_offsets(v);
    std::vector<std::uint8_t> samples(sample_buffer_bytes(v));
    std::memcpy(samples.data(), v.base.data(), v.base.bytes());
    for (const auto& [triple, block] : v.tiles)
      std::memcpy(samples.data() + offsets.at(triple), block.data(), block.bytes());
    const Index3 bricks = v.bricks();
    const VdvrGrid grid = sampler_grid(v);
    for (const RecordKind kind : {record_kind(v), record_kind(v, true)}) {
      const PackedRecords records(v, offsets, kind);
      std::mt19937 random(4);
      std::uniform_real_distribution<float> unit(0, 1);
      int wrong = 0;
      for (int i = 0; i < 5000; ++i) {
        const float x = 8 * unit(random), y = 5 * unit(random), z = 7 * unit(random);
        const std::array<std::int32_t, 3> b{vdvr_brick_of(x, grid.granularity, grid.bricks_x),
                                            vdvr_brick_of(y, grid.granularity, grid.bricks_y),
                                            vdvr_brick_of(z, grid.granularity, grid.bricks_z)};
        const auto brick = static_cast<std::size_t>((b[2] * bricks[1] + b[1]) * bricks[0] + b[0]);
        const VdvrBrick r =
            vdvr_record(records.words().data() + words_of(kind) * brick, static_cast<int>(kind), grid);
        const float packed = vdvr_sample_in_brick(
            samples.data(), r, vdvr_local(x, b[0], r.level_x, grid.granularity, grid.cells_x, grid.coarse_x),
            vdvr_local(y, b[1], r.level_y, grid.granularity, grid.cells_y, grid.coarse_y),
            vdvr_local(z, b[2], r.level_z, grid.granularity, grid.cells_z, grid.coarse_z));
        const Vec3 cell{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
        if (packed != sample_at(v, world(v.grid, cell))) ++wrong;
      }
      BOOST_TEST(wrong == 0);
    }
  }
}

BOOST_AUTO_TEST_CASE(a_uniform_volume_becomes_a_mixed_one_without_tiles) {
  Volume volume{grid_of({5, 4, 3}), std::vector<float>(6 * 5 * 4)};
  for (std::size_t i = 0; i < volume.samples.size(); ++i) volume.samples[i] = static_cast<float>(i);
  const MixedVolume v = as_mixed(volume, 2);
  BOOST_TEST(v.granularity == 2);
  BOOST_TEST(v.rate == 1);
  BOOST_TEST(v.tiles.empty());
  BOOST_TEST((v.bricks() == Index3{3, 2, 2}));
  BOOST_TEST(v.level.size() == 12u);
  BOOST_TEST(v.tile == std::vector<std::uint32_t>(12, 0));
  BOOST_TEST(v.base.f32 == volume.samples);
  BOOST_TEST(sample_at(v, world(v.grid, {4, 3, 2})) == static_cast<float>(4 + 6 * (3 + 5 * 2)));
}

BOOST_AUTO_TEST_CASE(tiles_have_the_shape_of_their_triple) {
  MixedVolume v;
  v.granularity = 4;
  BOOST_TEST((v.tile_shape({0, 2, 1}) == std::array<std::int64_t, 3>{5, 17, 9}));
  BOOST_TEST(v.tile_size({0, 2, 1}) == 5 * 17 * 9);
  BOOST_TEST(v.tile_size({1, 1, 1}) == 729);
}

BOOST_AUTO_TEST_CASE(storage_of_a_uniform_volume_is_its_samples_and_its_index) {
  const MixedVolume v = support::random_mixed(grid_of({8, 8, 8}), 4, 1, {{0, 0, 0}}, 1);
  const Storage s =
      storage_of(v, false);  // 9^3 = 729 samples, 8 index entries of 8 bytes and one of distance
  BOOST_TEST(s.samples_ratio == (729.0 + 8.0) / 729.0);
  BOOST_TEST(s.device_bytes == 729u * 4 + 8 * 9);
  BOOST_TEST(s.bytes_ratio == (729.0 * 4 + 8 * 9) / (729.0 * 4));
}

BOOST_AUTO_TEST_CASE(storage_counts_tiles_whole_even_beyond_the_grid) {
  MixedVolume v = support::empty_mixed(grid_of({5, 4, 4}), 4, 4, {{0, 0, 0}}, 1);  // two bricks along x
  v.level = {{0, 2, 1}, {1, 1, 1}};
  v.tiles[{0, 2, 1}].f32.assign(5 * 17 * 9, 0.0f);
  v.tiles[{1, 1, 1}].f32.assign(729, 0.0f);
  const double base = 6 * 5 * 5, tiles = 5 * 17 * 9 + 729;
  const Storage s = storage_of(v, false);
  BOOST_TEST(s.samples_ratio == (base + 2 + tiles) / base);
  BOOST_TEST(s.bytes_ratio == (4 * (base + tiles) + 9 * 2) / (4 * base));
}

BOOST_AUTO_TEST_CASE(storage_of_a_coarse_base_counts_what_is_stored_against_the_grid) {
  MixedVolume v = support::random_mixed(grid_of({8, 8, 8}), 4, 1, {{0, 0, 0}}, 1, {2, 1, 0});
  v.level[0] = {2, 1, 0};
  v.tiles[{2, 1, 0}].f32.assign(125, 0.0f);
  const double grid = 9 * 9 * 9, base = 9 * 5 * 3;
  const Storage s = storage_of(v, false);
  BOOST_TEST(s.samples_ratio == (base + 8 + 125) / grid);
  BOOST_TEST(s.bytes_ratio == (4 * (base + 125) + 9 * 8) / (4 * grid));
}

BOOST_AUTO_TEST_CASE(samples_on_the_grid_are_the_field_there_whatever_the_base) {
  for (const LevelTriple& coarsening : {LevelTriple{0, 0, 0}, {1, 2, 0}}) {
    const MixedVolume v = support::random_mixed(grid_of({8, 4, 6}), 4, 2, {{0, 0, 0}}, 9, coarsening);
    const Volume on = on_grid(v);
    const Index3 n = v.grid.samples();
    BOOST_REQUIRE(static_cast<std::int64_t>(on.samples.size()) == v.grid.sample_count());
    for (std::int64_t i = 0; i < v.grid.sample_count(); ++i) {
      const Vec3 p = v.grid.position({i % n[0], i / n[0] % n[1], i / n[0] / n[1]});
      BOOST_TEST(on.samples[static_cast<std::size_t>(i)] == sample_at(v, p));
    }
  }
}

BOOST_AUTO_TEST_CASE(interior_storage_counts_bricks_within_seven_eighths_in_x_and_y) {
  MixedVolume v = support::empty_mixed(grid_of({16, 16, 8}), 4, 2, {{0, 0, 0}}, 1);
  // Of 4 x 4 x 2 bricks the inner 2 x 2 in x and y count, both layers: 8 bricks of 64 cells.
  v.level[0] = {1, 1, 1};          // a corner: not counted
  v.level[1 + 4 * 1] = {1, 1, 1};  // brick x = 1, y = 1, z = 0: counted
  v.tile[1 + 4 * 1] = 1;
  v.tiles[{1, 1, 1}].f32.assign(2 * 729, 0.0f);
  const Storage s = storage_of(v, true);
  BOOST_TEST(s.samples_ratio == (512.0 + 8 + 729) / 512.0);
  BOOST_TEST(s.bytes_ratio == (4.0 * (512 + 729) + 9 * 8) / (4.0 * 512));
}

BOOST_AUTO_TEST_CASE(integer_samples_are_decoded_exactly_on_the_host) {
  for (const SampleType type : {SampleType::u16, SampleType::u8}) {
    const MixedVolume v = support::in_types(
        support::random_mixed(grid_of({9, 5, 7}), 4, 4, {{0, 0, 0}, {1, 1, 1}, {0, 2, 1}}, 6), {type});
    const std::vector<float> base = decoded(v.base, v.step);
    for (std::size_t i = 0; i < base.size(); ++i)
      BOOST_REQUIRE(static_cast<double>(base[i]) == reference::sample_of(v, v.base, i));
    for (const auto& [triple, block] : v.tiles) {
      const std::vector<float> tile = decoded(block, v.step);
      for (std::size_t i = 0; i < tile.size(); ++i)
        BOOST_REQUIRE(static_cast<double>(tile[i]) == reference::sample_of(v, block, i));
    }
    const Index3 bricks = v.bricks();
    for (std::int64_t b = 0; b < v.brick_count(); ++b) {
      const Index3 brick{b % bricks[0], b / bricks[0] % bricks[1], b / bricks[0] / bricks[1]};
      const BrickSamples samples(v, brick);
      for (std::int64_t z = 0; z <= samples.end()[2]; ++z)
        for (std::int64_t y = 0; y <= samples.end()[1]; ++y)
          for (std::int64_t x = 0; x <= samples.end()[0]; ++x)
            BOOST_REQUIRE(static_cast<double>(samples(x, y, z)) ==
                          reference::stored_sample(v, brick, {x, y, z}));
    }
  }
}

BOOST_AUTO_TEST_CASE(an_offset_of_15_bits_fits_a_compact_record_and_one_of_16_does_not) {
  MixedVolume v =
      support::in_types(support::random_mixed(grid_of({8, 8, 8}), 4, 2, {{1, 1, 1}}, 1), {SampleType::u8});
  SampleBlock& tiles = v.tiles.begin()->second;
  const std::size_t brick = 3;
  const auto kind_with = [&](std::int32_t units, int shift) {
    tiles.shift[v.tile[brick]] = static_cast<std::uint8_t>(shift);
    tiles.offset[v.tile[brick]] = units * (1 << shift);
    return record_kind(v);
  };
  for (const int shift : {0, 7})
    for (const std::int32_t units : {-(1 << 14), -1, 0, (1 << 14) - 1}) {
      BOOST_TEST((kind_with(units, shift) == RecordKind::compact));
      const PackedRecords records(v, tile_offsets(v), RecordKind::compact);
      const VdvrBrick r =
          vdvr_record(records.words().data() + 2 * brick, VDVR_RECORDS_COMPACT, sampler_grid(v));
      BOOST_TEST(static_cast<double>(r.bias) == v.step * units * (1 << shift));
      BOOST_TEST(static_cast<double>(r.scale) == v.step * (1 << shift));
      BOOST_TEST(r.level_x == 1u);
    }
  BOOST_TEST((kind_with(-(1 << 14) - 1, 7) == RecordKind::wide));
  BOOST_TEST((kind_with(1 << 14, 0) == RecordKind::wide));
  BOOST_TEST((record_kind(v, true) == RecordKind::wide));  // texels need more than 32 bits
}

BOOST_AUTO_TEST_CASE(storage_counts_integers_by_their_bytes_and_longer_records_only_where_needed) {
  MixedVolume v =
      support::in_types(support::random_mixed(grid_of({8, 8, 8}), 4, 2, {{1, 1, 1}}, 1), {SampleType::u8});
  // 9^3 base samples, 8 tiles, 8 records and one byte of distance each
  const Storage s = storage_of(v, false);
  BOOST_TEST(s.device_bytes == 729u + 8 * 729 + 8 * 9);
  BOOST_TEST(s.bytes_ratio == (729.0 + 8 * 729 + 8 * 9) / (729.0 * 4));
  BOOST_TEST(s.samples_ratio == (729.0 + 8 + 8 * 729) / 729.0);
  v.tiles.begin()->second.offset.front() = 1 << 23;
  v.tiles.begin()->second.shift.front() = 0;
  BOOST_TEST(storage_of(v, false).device_bytes == 729u + 8 * 729 + 8 * 13);
}
