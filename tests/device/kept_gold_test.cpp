// Gold from kept nodes against F in double precision, wherever the lattice, its boxes and the detector lie.
#define BOOST_TEST_MODULE kept_gold
#include "host/certify/kept/kept_gold.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <random>
#include <string>

#include "host/base/system/casts.hpp"
#include "host/field/fbp/back_project.hpp"
#include "tests/support/attack_chain.hpp"
#include "tests/support/scans.hpp"
#include "tests/support/tolerance.hpp"

namespace vdvr {
namespace {

using attacks::Chain;
using attacks::device;
using testing::noise_scan;

// float[y][x][stride] of a box.
struct Nodes {
  GoldBox box;
  std::int64_t stride = 0;
  std::vector<float> values;
  [[nodiscard]] float at(std::int64_t x, std::int64_t y, std::int64_t z) const {  // nodes of the lattice
    return values[vdvr::at(((y - box.first[1]) * box.nodes[0] + x - box.first[0]) * stride + z -
                           box.first[2])];
  }
};

Nodes nodes_of(KeptGold& kept, const GoldLattice& lattice, const GoldBox& box, std::uint64_t before = 0) {
  kept.prepare(lattice, {box}, {});
  BOOST_TEST(kept.missing(lattice, {box}) == 0);
  const std::int64_t stride = column_stride(box.nodes[2]);
  const std::uint64_t size = count(box.nodes[0] * box.nodes[1] * stride);
  opencl::DeviceArray<float> out(device().state(), before + size + before, "gold of a box");
  constexpr float untouched = -1e30f;
  out.fill(untouched);
  kept.fill(lattice, box, out, before, stride);
  std::vector<float> all = out.to_host();
  for (std::size_t i = 0; i < before; ++i)
    BOOST_REQUIRE(all[i] == untouched && all[all.size() - 1 - i] == untouched);
  return {
      box,
      stride,
      {all.begin() + static_cast<std::ptrdiff_t>(before), all.end() - static_cast<std::ptrdiff_t>(before)}};
}

Grid grid_in(const Index3& cells, const Vec3& spacing, const Vec3& origin) {
  Grid grid;
  grid.cells = cells;
  grid.spacing = spacing;
  grid.origin = origin;
  return grid;
}

GoldBox whole(const Grid& grid, int rate, std::int64_t around) {
  GoldBox box;
  for (std::size_t a = 0; a < 3; ++a) {
    box.first[a] = -around;
    box.nodes[a] = grid.cells[a] * rate + 1 + 2 * around;
  }
  return box;
}

struct Case {
  std::string name;
  ProjectionSet scan;
  Grid grid;
  double reach = 1;  // beyond the covered region, world units
  std::vector<int> rates{2, 4, 8, 16};
};

ProjectionSet oblong() {
  ProjectionSet scan = noise_scan(13, 6, 25, 7);
  scan.geometry.pitch_u = 0.7;
  scan.geometry.pitch_v = 1.3;
  scan.geometry.center = 10.8;
  return scan;
}

std::vector<Case> cases() {
  const ProjectionSet noise = noise_scan(15, 9, 33, 1);
  return {
      {"spacing of .3 pixels", noise, grid_in({3, 3, 3}, {0.3, 0.3, 0.3}, {1.1, -3, -0.4})},
      {"spacing of 1 / sqrt 2 pixels", noise, grid_in({3, 3, 3}, {0.7071, 0.7071, 0.7071}, {1.1, -3, -1.2})},
      {"spacing of a pixel", noise, grid_in({3, 3, 2}, {1, 1, 1}, {1.1, -3, -1.2})},
      {"spacing of two pixels", noise, grid_in({3, 2, 2}, {2, 2, 2}, {1.1, -3, -1.2})},
      {"spacing of five pixels", noise, grid_in({6, 6, 1}, {5, 5, 5}, {-15, -15, -2}), 2, {2, 4, 8}},
      {"spacing of five pixels, at 32x", noise, grid_in({1, 1, 1}, {5, 5, 5}, {-2, -3, -2}), 2, {16, 32}},
      {"over the detector's edge", noise, grid_in({3, 3, 2}, {1, 1, 1}, {9.5, 10.5, -1}), 4, {2, 4, 8}},
      {"far over the detector's edge", noise, grid_in({12, 2, 1}, {1, 1, 1}, {9.5, -1, -1}), 7, {2, 4}},
      {"all of the covered region", noise, grid_in({34, 34, 1}, {1, 1, 1}, {-17, -17, 0}), 1, {2}},
      {"over the first and last row", noise, grid_in({1, 2, 12}, {1, 1, 1}, {-2, 3, -6})},
      {"oblong pixels and cells", oblong(), grid_in({3, 2, 3}, {0.5, 0.8, 1.1}, {-2, -3, -1.5})},
      {"one row", noise_scan(31, 1, 24, 3), grid_in({3, 3, 1}, {1, 1, 1}, {-1.2, 2, -0.5})},
      {"two rows", noise_scan(14, 2, 25, 4), grid_in({3, 3, 2}, {0.9, 0.9, 0.9}, {-1.2, 2, -0.9})},
      {"three columns and rows", noise_scan(4, 3, 3, 4), grid_in({2, 2, 2}, {1, 1, 1}, {-1, -1, -1})},
      {"20 rows", noise_scan(11, 20, 24, 5), grid_in({2, 2, 5}, {1, 1, 1}, {-1.3, 0.2, 4.3})},
      {"33 rows", noise_scan(11, 33, 24, 5), grid_in({2, 2, 5}, {1, 1, 1}, {-1.3, 0.2, 4.3})},
      {"40 rows, over the last", noise_scan(11, 40, 24, 5),
       grid_in({2, 2, 6}, {0.7, 0.7, 0.7}, {-1.3, 0.2, 17})},
      {"40 rows, over the first", noise_scan(11, 40, 24, 5),
       grid_in({2, 2, 9}, {0.3, 0.3, 0.3}, {-1.3, 0.2, -21})},
      {"40 rows, spacing of three", noise_scan(11, 40, 24, 5),
       grid_in({2, 2, 8}, {1, 1, 3}, {-1.3, 0.2, -12})},
      {"uneven angles",
       [] {
         ProjectionSet scan = noise_scan(11, 5, 24, 9);
         for (std::size_t k = 0; k < 11; ++k)
           scan.geometry.theta_rad[k] = std::numbers::pi * std::pow(static_cast<double>(k) / 11, 1.7);
         return scan;
       }(),
       grid_in({3, 3, 2}, {1, 1, 1}, {1.1, -3, -1.2})},
  };
}

struct Compared {
  std::int64_t nodes = 0, beyond = 0;  // compared, and of these those outside the covered region
  double worst = 0;                    // error over bound
};

// Every node that may be asked for; of many, a sample of columns.
Compared compare(Chain& chain, const Grid& grid, int rate, const Nodes& nodes, double reach, double bound) {
  const Coverage coverage(chain.filtered.geometry);
  const std::int64_t columns = nodes.box.nodes[0] * nodes.box.nodes[1];
  std::mt19937 random(11);
  std::vector<Vec3> points;
  std::vector<double> found;
  Compared out;
  for (std::int64_t y = nodes.box.first[1]; y < nodes.box.first[1] + nodes.box.nodes[1]; ++y)
    for (std::int64_t x = nodes.box.first[0]; x < nodes.box.first[0] + nodes.box.nodes[0]; ++x) {
      if (static_cast<std::int64_t>(random() % 65536) * columns > std::int64_t{65536} * 900) continue;
      Vec3 p{grid.origin[0] + static_cast<double>(x) / rate * grid.spacing[0],
             grid.origin[1] + static_cast<double>(y) / rate * grid.spacing[1], 0};
      const double margin = coverage.margin(p[0], p[1]);
      if (margin < -reach) continue;
      for (std::int64_t z = nodes.box.first[2]; z < nodes.box.first[2] + nodes.box.nodes[2]; ++z) {
        p[2] = grid.origin[2] + static_cast<double>(z) / rate * grid.spacing[2];
        points.push_back(p);
        found.push_back(static_cast<double>(nodes.at(x, y, z)));
        ++out.nodes;
        out.beyond += margin < 0;
      }
    }
  const auto F = chain.exact.at(points);
  for (std::size_t i = 0; i < F.size(); ++i) {
    const double ratio = std::abs(found[i] - F[i]) / (bound + chain.exact.rounding());
    if (!(ratio <= out.worst)) out.worst = std::isnan(ratio) ? double{INFINITY} : ratio;
  }
  return out;
}

BOOST_AUTO_TEST_CASE(gold_of_any_lattice_is_within_its_errors_of_the_field) {
  std::int64_t beyond = 0;
  for (const Case& c : cases()) {
    Chain chain(c.scan);
    KeptGold kept(device().state(), chain.filtered, chain.sups, c.grid, c.reach, 8, Interpolation::six_taps);
    for (const int rate : c.rates) {
      const GoldLattice lattice = kept.lattice(c.grid, rate);
      const GoldErrors e = kept.errors(lattice);
      // What docs/error-bounds.md, section 16, allows the filters along one axis. Of parallel beam all three
      // together stay below it, so that gold's share of a tolerance does not grow unseen.
      constexpr double most_of_filters = 2e-5;
      BOOST_TEST(e.interpolation <= most_of_filters * chain.sups.value);
      const Nodes nodes = nodes_of(kept, lattice, whole(c.grid, rate, 3), 64);
      const Compared r = compare(chain, c.grid, rate, nodes, c.reach, e.interpolation + e.rounding + e.ramp);
      BOOST_TEST_MESSAGE(c.name << ", " << rate << "x (" << lattice.phases[0] << " / " << lattice.step[0]
                                << " across, " << lattice.phases[2] << " / " << lattice.step[2]
                                << " along): " << r.nodes << " nodes, error / bound " << r.worst);
      BOOST_TEST(r.nodes > 0);
      BOOST_TEST(r.worst <= 1, c.name << ", " << rate << "x: error / bound " << r.worst);
      beyond += r.beyond;
    }
  }
  BOOST_TEST(beyond > 1000);
}

// Linear and cubic interpolation in u err by more than all that follows.
BOOST_AUTO_TEST_CASE(gold_of_columns_interpolated_otherwise_is_within_its_errors_too) {
  const ProjectionSet scan = noise_scan(15, 9, 33, 1);
  Chain chain(scan);
  const Grid grid = grid_in({3, 3, 2}, {1, 1, 1}, {1.1, -3, -1.2});
  double closest = 0;
  for (const int upsampling : {2, 4, 16})
    for (const Interpolation filter : {Interpolation::linear, Interpolation::cubic}) {
      KeptGold kept(device().state(), chain.filtered, chain.sups, grid, 1, upsampling, filter);
      for (const int rate : {1, 2, 4, 8}) {
        const GoldLattice lattice = kept.lattice(grid, rate);
        const GoldErrors e = kept.errors(lattice);
        const Compared r = compare(chain, grid, rate, nodes_of(kept, lattice, whole(grid, rate, 2)), 1,
                                   e.interpolation + e.rounding + e.ramp);
        BOOST_TEST(r.worst <= 1, text_of(filter) << " " << upsampling << ", " << rate << "x: " << r.worst);
        closest = std::max(closest, r.worst);
      }
    }
  BOOST_TEST_MESSAGE("  error / bound " << closest);
  BOOST_TEST(closest >= 0.1);  // the bound is not idle
}

// A coarser grid's gold is made of the same nodes.
BOOST_AUTO_TEST_CASE(lattices_of_coarser_grids_share_nodes_and_other_grids_are_refused) {
  const ProjectionSet scan = noise_scan(15, 9, 33, 1);
  Chain chain(scan);
  const Grid grid = grid_in({8, 8, 4}, {1, 1, 1}, {-4, -4, -2});
  KeptGold kept(device().state(), chain.filtered, chain.sups, grid, 1, 8, Interpolation::six_taps);
  Grid coarse = grid_in({4, 8, 1}, {2, 1, 4}, {-4, -4, -2});
  const GoldLattice lattice = kept.lattice(coarse, 2);
  BOOST_TEST((lattice.step == std::array{2, 1, 4}));
  BOOST_TEST((lattice.phases == std::array{1, 1, 1}));
  const GoldErrors e = kept.errors(lattice);
  const Compared r = compare(chain, coarse, 2, nodes_of(kept, lattice, whole(coarse, 2, 0)), 1,
                             e.interpolation + e.rounding + e.ramp);
  BOOST_TEST(r.worst <= 1);
  coarse.spacing[0] = 1.5;
  BOOST_CHECK_THROW(static_cast<void>(kept.lattice(coarse, 2)), std::logic_error);
  BOOST_CHECK_THROW(static_cast<void>(kept.lattice(grid, 3)), std::logic_error);
}

// Blocks of a pass, bricks of a repair, in whatever order tiles were asked for: to the bit.
BOOST_AUTO_TEST_CASE(a_block_computed_alone_is_the_block_in_the_whole) {
  for (const std::int64_t rows : {9, 40}) {
    const ProjectionSet scan = noise_scan(11, rows, 40, 3);
    Chain chain(scan);
    const Grid grid = grid_in({20, 20, 6}, {1, 1, 1}, {-10, -10, -3});
    KeptGold together(device().state(), chain.filtered, chain.sups, grid, 1, 8, Interpolation::six_taps);
    for (const int rate : {2, 4, 8}) {
      const GoldLattice lattice = together.lattice(grid, rate);
      const GoldBox all{{-3, -2, -1}, {20 * rate + 5, 20 * rate + 5, 4 * rate + 3}};
      const Nodes in_whole = nodes_of(together, lattice, all);
      const std::vector<GoldBox> parts{{{-3, -2, -1}, {7, 5, all.nodes[2]}},
                                       {{5 * rate + 1, 3, -1}, {4 * rate, 1, all.nodes[2]}},
                                       {{7, 9 * rate - 1, -1}, {2, 3 * rate + 2, all.nodes[2]}},
                                       {{8 * rate, 8 * rate, rate + 1}, {2 * rate + 1, rate + 1, rate + 1}}};
      for (const GoldBox& part : parts) {
        KeptGold alone(device().state(), chain.filtered, chain.sups, grid, 1, 8, Interpolation::six_taps);
        const Nodes found = nodes_of(alone, lattice, part);
        BOOST_TEST(alone.tiles() <= together.tiles());
        std::int64_t different = 0;
        for (std::int64_t y = part.first[1]; y < part.first[1] + part.nodes[1]; ++y)
          for (std::int64_t x = part.first[0]; x < part.first[0] + part.nodes[0]; ++x)
            for (std::int64_t z = part.first[2]; z < part.first[2] + part.nodes[2]; ++z)
              different += found.at(x, y, z) != in_whole.at(x, y, z) ? 1 : 0;
        BOOST_TEST(different == 0);
      }
    }
  }
}

// The same bits, however often their pages are let go.
// OpenCL promises no more than an eighth of a gigabyte in one buffer, which heights of many tiles would pass.
BOOST_AUTO_TEST_CASE(heights_lie_in_buffers_that_the_device_allows) {
  const ProjectionSet scan = noise_scan(11, 40, 40, 3);
  Chain chain(scan);
  const Grid grid = grid_in({20, 20, 6}, {1, 1, 1}, {-10, -10, -3});
  KeptGold kept(device().state(), chain.filtered, chain.sups, grid, 1, 8, Interpolation::six_taps),
      in_parts(device().state(), chain.filtered, chain.sups, grid, 1, 8, Interpolation::six_taps);
  const GoldLattice lattice = kept.lattice(grid, 2);
  const Nodes at_once = nodes_of(kept, lattice, whole(grid, 2, 2));
  in_parts.prepare(lattice, {whole(grid, 2, 2)}, {});
  struct Limit {
    std::uint64_t& most = device().state().info.max_allocation;
    const std::uint64_t before = std::exchange(most, std::uint64_t{1} << 20);
    ~Limit() { most = before; }
  } limit;
  BOOST_TEST((nodes_of(in_parts, lattice, whole(grid, 2, 2)).values == at_once.values));
}

BOOST_AUTO_TEST_CASE(gold_kept_in_scratch_is_that_kept_in_memory) {
  if (device().state().info.is_gpu) return;
  for (const std::int64_t rows : {9, 40}) {
    const ProjectionSet scan = noise_scan(11, rows, 40, 3);
    Chain chain(scan);
    FilteredScan filtered = chain.filtered;
    filtered.samples =
        SampleArray(chain.filtered.samples.size(), std::make_shared<Scratch>(".", 1 << 16), "filtered");
    std::copy(chain.filtered.samples.begin(), chain.filtered.samples.end(), filtered.samples.begin());
    const Grid grid = grid_in({20, 20, 6}, {1, 1, 1}, {-10, -10, -3});
    KeptGold in_memory(device().state(), chain.filtered, chain.sups, grid, 1, 8, Interpolation::six_taps);
    KeptGold in_scratch(device().state(), filtered, chain.sups, grid, 1, 8, Interpolation::six_taps);
    const std::uint64_t before = filtered.samples.scratch()->peak_bytes();
    for (const int rate : {2, 8}) {
      const GoldLattice lattice = in_memory.lattice(grid, rate);
      const Nodes a = nodes_of(in_memory, lattice, whole(grid, rate, 2)),
                  b = nodes_of(in_scratch, lattice, whole(grid, rate, 2));
      std::int64_t different = 0;
      for (std::int64_t y = a.box.first[1]; y < a.box.first[1] + a.box.nodes[1]; ++y)
        for (std::int64_t x = a.box.first[0]; x < a.box.first[0] + a.box.nodes[0]; ++x)
          for (std::int64_t z = a.box.first[2]; z < a.box.first[2] + a.box.nodes[2]; ++z)
            different += a.at(x, y, z) != b.at(x, y, z);
      BOOST_TEST(different == 0);
    }
    BOOST_TEST(filtered.samples.scratch()->peak_bytes() > before);
  }
}

// Tiles are asked for piece by piece; what is there already stays.
BOOST_AUTO_TEST_CASE(tiles_are_made_once_and_those_beyond_reach_never) {
  const ProjectionSet scan = noise_scan(11, 5, 40, 3);
  Chain chain(scan);
  const Grid grid = grid_in({80, 80, 4}, {1, 1, 1}, {-40, -40, -2});
  KeptGold kept(device().state(), chain.filtered, chain.sups, grid, 1, 8, Interpolation::six_taps);
  const GoldLattice lattice = kept.lattice(grid, 4);
  // Filters of the second reach over a corner of tiles.
  const GoldBox corner{{0, 0, 0}, {9, 9, 5}}, middle{{190, 190, 0}, {9, 9, 5}}, all = whole(grid, 4, 1);
  BOOST_TEST(kept.missing(lattice, {corner}) == 0);  // 35 pixels from the axis, both ways
  BOOST_TEST(kept.missing(lattice, {middle}) == 4);
  const Nodes first = nodes_of(kept, lattice, middle);
  BOOST_TEST(kept.tiles() == 4);
  const std::int64_t missing = kept.missing(lattice, {all, middle});
  kept.prepare(lattice, {all}, {});
  BOOST_TEST(kept.tiles() == 4 + missing);
  BOOST_TEST(kept.missing(lattice, {all}) == 0);
  BOOST_TEST((nodes_of(kept, lattice, middle).values == first.values));
  bool finite = true;
  for (const float v : nodes_of(kept, lattice, corner).values) finite = finite && std::isfinite(v);
  BOOST_TEST(finite);
}

// Of many rows heights are made in two steps, the second in groups of 16 from where the box begins: the
// groups' terms must not show.
BOOST_AUTO_TEST_CASE(node_is_the_same_in_every_box) {
  for (const std::int64_t rows : {5, 70}) {
    const ProjectionSet scan = noise_scan(11, rows, 40, 3);
    Chain chain(scan);
    const Grid grid = grid_in({8, 8, 8}, {1, 1, 1}, {-4, -4, -4});
    KeptGold kept(device().state(), chain.filtered, chain.sups, grid, 1, 8, Interpolation::six_taps);
    for (const int rate : {1, 2, 4, 8}) {
      const GoldLattice lattice = kept.lattice(grid, rate);
      const GoldBox all = whole(grid, rate, 0);
      const Nodes expected = nodes_of(kept, lattice, all);
      std::int64_t different = 0;
      for (const std::int64_t skipped : {1, 3, 4, 7}) {
        GoldBox part = all;
        for (std::size_t a = 0; a < 3; ++a) {
          part.first[a] += skipped;
          part.nodes[a] = std::min<std::int64_t>(19, all.nodes[a] - skipped);
        }
        const Nodes made = nodes_of(kept, lattice, part);
        for (std::int64_t z = part.first[2]; z < part.first[2] + part.nodes[2]; ++z)
          for (std::int64_t y = part.first[1]; y < part.first[1] + part.nodes[1]; ++y)
            for (std::int64_t x = part.first[0]; x < part.first[0] + part.nodes[0]; ++x)
              different += made.at(x, y, z) != expected.at(x, y, z) ? 1 : 0;
      }
      BOOST_TEST(different == 0, different << " nodes of " << rows << " rows at rate " << rate);
    }
  }
}

// Of few rows and of many, more boxes than go through the device together, on several tiles.
BOOST_AUTO_TEST_CASE(boxes_made_together_are_those_made_alone) {
  for (const std::int64_t rows : {5, 70}) {
    const ProjectionSet scan = noise_scan(11, rows, 60, 3);
    Chain chain(scan);
    const Grid grid = grid_in({40, 40, 8}, {1, 1, 1}, {-20, -20, -4});
    KeptGold kept(device().state(), chain.filtered, chain.sups, grid, 1, 8, Interpolation::six_taps);
    const GoldLattice lattice = kept.lattice(grid, 8);
    std::vector<GoldBox> boxes;
    for (std::int64_t y = 0; y < 8; ++y)
      for (std::int64_t x = 0; x < 8; ++x) boxes.push_back({{x * 40 - 3, y * 40 - 3, 5}, {23, 23, 21}});
    kept.prepare(lattice, boxes, {});
    const std::int64_t stride = column_stride(21);
    const std::uint64_t size = count(23 * 23 * stride), apart = size + 32, before = 16;
    opencl::DeviceArray<float> together(device().state(), before + boxes.size() * apart, "boxes");
    together.fill(-1e30f);
    kept.fill(lattice, boxes, together, before, apart, stride);
    const std::vector<float> all = together.to_host();
    std::int64_t different = 0;
    for (std::size_t b = 0; b < boxes.size(); ++b) {
      const std::vector<float> alone = nodes_of(kept, lattice, boxes[b]).values;
      for (std::size_t i = 0; i < size; ++i) different += all[before + b * apart + i] != alone[i] ? 1 : 0;
      for (std::size_t i = size; i < apart; ++i) different += all[before + b * apart + i] != -1e30f ? 1 : 0;
    }
    BOOST_TEST(different == 0, different << " nodes of " << rows << " rows");
    boxes[1].first[0] += 1;
    BOOST_CHECK_THROW(kept.fill(lattice, boxes, together, before, apart, stride), std::logic_error);
  }
}

// Rows go through the device in runs where memory is short.
BOOST_AUTO_TEST_CASE(little_memory_changes_no_bit) {
  const ProjectionSet scan = noise_scan(24, 70, 40, 3);
  const Grid grid = grid_in({8, 8, 8}, {1, 1, 1}, {-4, -4, -4});
  const auto made = [&](std::uint64_t max_memory) {
    Device own("", max_memory);
    const FilteredScan filtered = filter_projections(own.state(), scan, {});
    Upsampler upsampler(own.state(), filtered);
    const FieldSups sups = field_sups(own.state(), upsampler, filtered);
    KeptGold kept(own.state(), filtered, sups, grid, 1, 8, Interpolation::six_taps);
    const GoldLattice lattice = kept.lattice(grid, 4);
    const GoldBox box = whole(grid, 4, 0);
    kept.prepare(lattice, {box}, {});
    const std::int64_t stride = column_stride(box.nodes[2]);
    opencl::DeviceArray<float> out(own.state(), count(box.nodes[0] * box.nodes[1] * stride), "gold");
    out.fill(0.0f);
    kept.fill(lattice, box, out, 0, stride);
    if (max_memory > 0) BOOST_TEST(own.peak_memory() <= max_memory);
    return out.to_host();
  };
  // All rows of the upsampled columns take 24 x 400 x 80 floats, 3 MB; so do the tiles.
  BOOST_TEST((made(std::uint64_t{12} << 20) == made(0)));
}

}  // namespace
}  // namespace vdvr
