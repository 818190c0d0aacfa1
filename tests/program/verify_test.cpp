// Verify against the truth in double precision, against tampering, and through the program.
#define BOOST_TEST_MODULE verify
#include "vdvr/expert/verify.hpp"

#include <sys/wait.h>

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "host/verify/seams.hpp"
#include "host/verify/verify_field.hpp"
#include "host/verify/verify_points.hpp"
#include "tests/support/places.hpp"
#include "tests/support/scans.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/build.hpp"
#include "vdvr/expert/certified_region.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/vdvr_file.hpp"

using namespace vdvr;
using vdvr::testing::empty_scan;
using vdvr::testing::noise_scan;

namespace {

std::size_t at(std::int64_t n) { return static_cast<std::size_t>(n); }

template <class Value>
ProjectionSet scan_of(std::int64_t views, std::int64_t rows, std::int64_t columns, Value&& value) {
  ProjectionSet scan = empty_scan(views, rows, columns);
  for (std::int64_t k = 0; k < views; ++k)
    for (std::int64_t v = 0; v < rows; ++v)
      for (std::int64_t i = 0; i < columns; ++i)
        scan.data[at((k * rows + v) * columns + i)] = static_cast<float>(value(k, v, i));
  return scan;
}

// The hardest scans for a bound: energy at the highest frequencies, and none anywhere else.
std::vector<std::pair<std::string, ProjectionSet>> hard_scans() {
  return {
      {"noise", noise_scan(13, 6, 21, 3)},
      {"wave", scan_of(11, 5, 20, [](auto, auto v, auto i) { return std::cos(2.9 * i + 1.3 * v + 0.4); })},
      {"spike", scan_of(9, 5, 17, [](auto k, auto v, auto i) { return k == 4 && v == 2 && i == 9; })},
      {"checkerboard", scan_of(10, 6, 18, [](auto, auto v, auto i) { return (v + i) % 2 == 0 ? 1 : -1; })},
      {"one row", noise_scan(12, 1, 19, 4)},
      {"two rows", noise_scan(12, 2, 19, 5)}};
}

// Every brick at the gold rate, its samples F itself to fp32.
MixedVolume gold_volume(const ExactField& field, const Grid& grid, int granularity, int rate) {
  MixedVolume v;
  v.grid = grid;
  v.granularity = granularity;
  v.rate = rate;
  v.base.f32.assign(at(grid.sample_count()), 0.0f);
  const auto top = static_cast<std::uint8_t>(std::countr_zero(static_cast<unsigned>(rate)));
  const Index3 n = v.bricks();
  std::vector<Vec3> points;
  for (std::int64_t b = 0; b < v.brick_count(); ++b) {
    v.level.push_back({top, top, top});
    v.tile.push_back(static_cast<std::uint32_t>(b));
    const Index3 place{b % n[0], b / n[0] % n[1], b / n[0] / n[1]};
    const std::int64_t side = std::int64_t{granularity} * rate + 1;
    for (std::int64_t i = 0; i < side * side * side; ++i) {
      const Index3 node{i % side, i / side % side, i / side / side};
      Vec3 p{};
      for (std::size_t a = 0; a < 3; ++a)
        p[a] = grid.origin[a] + grid.spacing[a] * (static_cast<double>(place[a] * granularity) +
                                                   static_cast<double>(node[a]) / rate);
      points.push_back(p);
    }
  }
  const auto values = field.at(points);
  auto& tiles = v.tiles[{top, top, top}].f32;
  tiles.assign(values.begin(), values.end());
  return v;
}

struct Made {
  ProjectionSet scan;
  MixedVolume volume;
  Certificate certificate;
};

Made made(const ProjectionSet& scan, const Index3& size, double epsilon, const RateOptions& rates = {},
          BuildOptions options = {}) {
  Device device;
  options.storage = StorageChoice::f32;  // tests alter single samples
  GridOptions grid;
  grid.size = size;
  grid.spacing = 0.9;
  const Plan plan = make_plan(device, scan, make_grid(scan.geometry, grid), {}, rates, {epsilon, {}});
  BuildResult built = build(device, scan, plan, options);
  return {scan, std::move(built.volume), std::move(built.certificate)};
}

const Made& small() {
  static const Made one = made(noise_scan(19, 9, 33, 10), {8, 8, 8}, 0.02);
  return one;
}

VerifyResult measured(const Made& m, const MixedVolume& volume, const Certificate& c,
                      bool exhaustive = true) {
  Device device;
  const VerifyResult r = verify(device, m.scan, volume, c, {exhaustive, 0.1, 3});
  BOOST_TEST(r.holds == r.failure.empty());
  return r;
}
VerifyResult measured(const Made& m, bool exhaustive = true) {
  return measured(m, m.volume, m.certificate, exhaustive);
}

// The brick with a tile that is nearest to the middle: well inside the covered region.
std::size_t brick_with_tile(const MixedVolume& v) {
  const Index3 n = v.bricks();
  std::size_t nearest = v.level.size();
  std::int64_t least = INT64_MAX;
  for (std::size_t i = 0; i < v.level.size(); ++i) {
    if (v.level[i] == LevelTriple{0, 0, 0}) continue;
    const auto b = static_cast<std::int64_t>(i);
    const Index3 p{b % n[0], b / n[0] % n[1], b / n[0] / n[1]};
    std::int64_t distance = 0;
    for (std::size_t a = 0; a < 3; ++a) distance += (2 * p[a] - n[a] + 1) * (2 * p[a] - n[a] + 1);
    if (distance > least) continue;  // the last of several: its low corner is shared
    least = distance;
    nearest = i;
  }
  BOOST_REQUIRE(nearest < v.level.size());
  return nearest;
}

float& middle_sample(MixedVolume& v, std::size_t brick) {
  const LevelTriple l = v.level[brick];
  return v.tiles.at(l).f32[at(v.tile[brick] * v.tile_size(l) + v.tile_size(l) / 2)];
}

}  // namespace

BOOST_AUTO_TEST_CASE(bound_of_every_column_of_cells_covers_the_interpolation_error) {
  Device device;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const auto& [name, scan] : hard_scans())
    for (const int rate : {1, 2, 8}) {
      const ExactField exact(scan, {});
      GridOptions options;
      options.size = Index3{4, 4, scan.geometry.rows == 1 ? 1 : scan.geometry.rows == 2 ? 2 : 4};
      options.spacing = 1.0;
      options.origin = Vec3{-1.3, -2.1, -0.5 * static_cast<double>((*options.size)[2])};
      const MixedVolume v = gold_volume(exact, make_grid(scan.geometry, options), 2, rate);
      // Clustered heights: each costs the reference a pass over all coefficients.
      std::vector<double> heights;
      for (int i = 0; i < 40; ++i)
        heights.push_back(scan.geometry.rows == 1
                              ? 0.0
                              : v.grid.origin[2] + unit(random) * static_cast<double>(v.grid.cells[2]));
      std::vector<Vec3> points;
      for (int i = 0; i < 12000; ++i)
        points.push_back(
            {v.grid.origin[0] + 4 * unit(random), v.grid.origin[1] + 4 * unit(random), heights[at(i % 40)]});
      const auto F = exact.at(points);
      std::map<std::array<std::int64_t, 4>, double> worst;  // brick, cell y, cell x
      double largest = 0, bound = 0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        if (!exact.covered(points[i])) continue;
        const Index3 b = brick_at(v, points[i]), n = v.bricks();
        Index3 cell{};
        for (std::size_t a = 0; a < 3; ++a)
          cell[a] = static_cast<std::int64_t>(
              ((points[i][a] - v.grid.origin[a]) - static_cast<double>(2 * b[a])) * rate);
        double& w = worst[{(b[2] * n[1] + b[1]) * n[0] + b[0], cell[1], cell[0], 0}];
        w = std::max(w, std::abs(static_cast<double>(sample_at(v, points[i])) - F[i]));
        largest = std::max(largest, w);
      }
      VerifyField field(device.state(), exact, v, {}, {});
      double magnitude = 0;
      for (const float s : v.tiles.begin()->second.f32)
        magnitude = std::max(magnitude, std::abs(static_cast<double>(s)));
      const double sampler = 14 * tolerance::unit_roundoff * magnitude;  // docs/error-bounds.md, section 8
      std::int64_t compared = 0;
      field.run(std::vector<std::uint8_t>(at(v.brick_count()), 1), v.rate,
                [&](const VerifyField::Piece& brick) {
                  bound = std::max(bound, brick.total);
                  const std::int64_t side = 2 * rate;
                  for (const auto& [key, error] : worst) {
                    if (key[0] != brick.brick) continue;
                    const VerifyField::Column& c = brick.columns[at(key[1] * side + key[2])];
                    ++compared;
                    const double limit = static_cast<double>(c.total) + brick.constant + sampler;
                    if (!(c.total >= 0) || !(error <= tolerance::bound(limit)))
                      BOOST_ERROR(name << " at rate " << rate << ": " << error << " above " << limit);
                  }
                },
                {});
      BOOST_TEST(compared == static_cast<std::int64_t>(worst.size()), name << " at rate " << rate);
      BOOST_TEST_MESSAGE(name << " at rate " << rate << ": error " << largest << ", bound " << bound
                              << ", arithmetic " << field.arithmetic());
    }
}

// What a certificate says of nodes it says of covered ones: corners of coarse cells beyond the rim do not
// count.
BOOST_AUTO_TEST_CASE(errors_count_where_nodes_are_covered) {
  Device device;
  const ProjectionSet scan = noise_scan(12, 4, 9, 6);
  const ExactField exact(scan, {});
  GridOptions options;
  options.size = Index3{8, 8, 4};
  options.spacing = 1.3;
  MixedVolume v = gold_volume(exact, make_grid(scan.geometry, options), 2, 4);
  // V is F but for a hundred wherever F is not covered.
  const Index3 n = v.bricks();
  std::int64_t wrong = 0;
  for (std::int64_t b = 0; b < v.brick_count(); ++b)
    for (std::int64_t i = 0; i < 9 * 9 * 9; ++i) {
      const Index3 place{b % n[0], b / n[0] % n[1], b / n[0] / n[1]}, node{i % 9, i / 9 % 9, i / 81};
      Vec3 p{};
      for (std::size_t a = 0; a < 3; ++a)
        p[a] = v.grid.origin[a] + 1.3 * static_cast<double>(place[a] * 8 + node[a]) / 4;
      if (exact.covered(p)) continue;
      v.tiles.begin()->second.f32[at(b * 9 * 9 * 9 + i)] += 100;
      ++wrong;
    }
  BOOST_TEST(wrong > 0);
  VerifyField field(device.state(), exact, v, {}, {});
  double total = 0, error = 0;
  field.run(std::vector<std::uint8_t>(at(v.brick_count()), 1), v.rate,
            [&](const VerifyField::Piece& b) {
              total = std::max(total, b.total);
              error = std::max(error, b.error);
            },
            {});
  // Cells across the rim hold covered points between: their bound speaks of them.
  BOOST_TEST(total > 99);
  BOOST_TEST(error < 1);
  BOOST_TEST(error > 0);
}

BOOST_AUTO_TEST_CASE(a_wrong_F_of_verify_is_told_by_nodes) {
  const Made& m = small();
  const ExactField exact(m.scan, m.certificate.field);
  const std::vector<std::uint8_t> all(m.volume.level.size(), 1);
  const FieldPoints chosen(exact, CertifiedRegion(m.scan, m.certificate.field), m.volume, all, 1);
  BOOST_TEST(!chosen.bricks().empty());
  Device device;
  VerifyField field(device.state(), exact, m.volume, {}, {});
  field.look_at(chosen.bricks(), chosen.nodes_each(), 1);
  const std::array<int, 2> rates{8, 16};
  field.run(
      all, rates, [](std::size_t, int) { return true; }, [](const VerifyField::Piece&) {}, {});
  std::vector<VerifyField::Node> nodes = field.seen();
  const FieldPoints::Outcome right = FieldPoints::compare(exact, nodes, {});
  BOOST_TEST(right.failure.empty(), right.failure);
  BOOST_TEST(right.points > 1000);
  BOOST_TEST(right.worst_share > 0);
  // One node that errs by half more than it may.
  nodes[nodes.size() / 2].value += 1.5 * nodes[nodes.size() / 2].arithmetic;
  const FieldPoints::Outcome wrong = FieldPoints::compare(exact, nodes, {});
  BOOST_TEST(wrong.worst_share > 1);
  BOOST_TEST(wrong.failure.find("verify computes F as") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(tested_cells_and_nodes_are_counted_exactly) {
  Device device;
  const ProjectionSet scan = noise_scan(12, 4, 9, 6);
  const ExactField exact(scan, {});
  GridOptions options;
  options.size = Index3{7, 6, 5};
  options.spacing = 1.3;
  const MixedVolume v = gold_volume(exact, make_grid(scan.geometry, options), 2, 4);
  const Coverage coverage(scan.geometry);
  const double h = 1.3 / 4;
  std::int64_t cells = 0, nodes = 0;
  for (std::int64_t b = 0; b < v.brick_count(); ++b) {
    const Index3 n = v.bricks(), p{b % n[0], b / n[0] % n[1], b / n[0] / n[1]};
    std::set<Index3> corners;
    Index3 end{};
    for (std::size_t a = 0; a < 3; ++a) end[a] = 4 * std::min<std::int64_t>(2, v.grid.cells[a] - 2 * p[a]);
    for (std::int64_t z = 0; z < end[2]; ++z)
      for (std::int64_t y = 0; y < end[1]; ++y)
        for (std::int64_t x = 0; x < end[0]; ++x) {
          const auto centre = [&](std::size_t a, std::int64_t i) {
            return v.grid.origin[a] + (static_cast<double>(8 * p[a] + i) + 0.5) * h;
          };
          if (coverage.margin(centre(0, x), centre(1, y)) < -0.5 * std::hypot(h, h) ||
              coverage.margin_z(centre(2, z)) < -0.5 * h)
            continue;
          ++cells;
          for (std::int64_t c = 0; c < 8; ++c) corners.insert({x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)});
        }
    nodes += static_cast<std::int64_t>(corners.size());
  }
  std::int64_t counted_cells = 0, counted_nodes = 0;
  VerifyField field(device.state(), exact, v, {}, {});
  field.run(std::vector<std::uint8_t>(at(v.brick_count()), 1), v.rate,
            [&](const VerifyField::Piece& b) {
              counted_cells += b.cells;
              counted_nodes += b.nodes;
            },
            {});
  BOOST_TEST(counted_cells == cells);
  BOOST_TEST(counted_nodes == nodes);
}

BOOST_AUTO_TEST_CASE(good_volume_holds) {
  const Made& m = small();
  const VerifyResult all = measured(m), some = measured(m, false);
  BOOST_TEST(all.holds, all.failure);
  BOOST_TEST(some.holds, some.failure);
  BOOST_TEST(all.total <= m.certificate.epsilon_abs);
  BOOST_TEST(all.seams == 0);
  BOOST_TEST(some.nodes_tested <= all.nodes_tested);
  BOOST_TEST(some.measured_total <= all.measured_total);
}

BOOST_AUTO_TEST_CASE(volumes_of_other_rates_windows_and_regions_hold) {
  const ProjectionSet scan = noise_scan(15, 7, 29, 9);
  BuildOptions window, roi;
  window.window = {0.0, 0.1};
  roi.roi = std::array<double, 6>{-2, -2, -1, 2, 1, 2};
  for (const Made& m : {made(scan, {8, 7, 6}, 0.3, {8, Interpolation::linear, 4}),
                        made(scan, {8, 7, 6}, 0.2, {8, Interpolation::cubic, 8}),
                        made(scan, {8, 7, 6}, 0.1, {}, window), made(scan, {8, 7, 6}, 0.1, {}, roi)}) {
    const VerifyResult r = measured(m);
    BOOST_TEST(r.holds, r.failure);
  }
}

// Noise that is much stronger in the first and last rows than where the grid lies.
ProjectionSet noise_between_stronger(unsigned seed) {
  ProjectionSet scan = noise_scan(15, 41, 29, seed);
  for (std::int64_t i = 0; i < scan.size(); ++i) {
    const std::int64_t row = i / scan.geometry.columns % scan.geometry.rows;
    if (row < 3 || row > 37) scan.data[at(i)] *= 20;
  }
  return scan;
}

// Build's T looks at each brick, verify's own at whole views: where these differ, finer gold decides.
BOOST_AUTO_TEST_CASE(right_certificates_of_coarse_gold_are_agreed_with) {
  std::int64_t finer = 0;
  for (const unsigned seed : {3u, 4u})
    for (const Interpolation filter : {Interpolation::cubic, Interpolation::six_taps})
      for (const int gold : {4, 8}) {
        const Made m =
            made(noise_between_stronger(seed), {8, 7, 6}, gold == 4 ? 0.2 : 0.05, {16, filter, gold});
        const VerifyResult r = measured(m);
        BOOST_TEST(r.holds, r.failure);
        BOOST_TEST(r.total <= m.certificate.epsilon_abs);
        finer += r.bricks_finer;
      }
  BOOST_TEST(finer > 0);
}

// F at the nodes of a finer gold, V as it is stored, and bricks cut into pieces.
BOOST_AUTO_TEST_CASE(finer_gold_bounds_the_same_bricks_by_less) {
  Device device;
  const Made& m = small();
  const ExactField exact(m.scan, m.certificate.field);
  VerifyField field(device.state(), exact, m.volume, {}, {});
  std::vector<std::uint8_t> selected(m.volume.level.size(), 0);
  selected[brick_with_tile(m.volume)] = 1;
  std::vector<double> totals, errors;
  for (const int factor : {1, 2, 4, 8}) {
    double total = 0, error = 0;
    std::int64_t cells = 0;
    field.run(selected, m.volume.rate * factor,
              [&](const VerifyField::Piece& p) {
                total = std::max(total, p.total);
                error = std::max(error, p.error);
                cells += p.cells;
              },
              {});
    const std::int64_t side = std::int64_t{m.volume.granularity} * m.volume.rate * factor;
    BOOST_TEST(cells == side * side * side);
    if (!totals.empty()) {
      BOOST_TEST(total <= totals.back() + 2 * field.arithmetic());
      BOOST_TEST(error >= errors.back() - 2 * field.arithmetic());
    }
    totals.push_back(total);
    errors.push_back(error);
    BOOST_TEST(error <= total);
  }
  // What is left is what F errs at nodes, in differences and between: docs/error-bounds.md, step 4.
  BOOST_TEST(totals.back() - errors.back() <
             0.02 * (totals.front() - errors.front()) + 5.25 * field.arithmetic());
}

BOOST_AUTO_TEST_CASE(little_memory_gives_the_same_verdict) {
  const Made& m = small();
  constexpr std::uint64_t limit = 24 << 20;
  Device device("", limit);
  const VerifyResult r = verify(device, m.scan, m.volume, m.certificate, {true, 0.1, 3});
  BOOST_TEST(r.holds, r.failure);
  BOOST_TEST(device.peak_memory() <= limit);
  BOOST_TEST(r.cells_tested == measured(m).cells_tested);
  Device tiny("", 1 << 18);
  BOOST_CHECK_THROW(verify(tiny, m.scan, m.volume, m.certificate), ResourceError);
}

BOOST_AUTO_TEST_CASE(altered_sample_is_found_and_named) {
  const Made& m = small();
  const std::size_t brick = brick_with_tile(m.volume);
  MixedVolume altered = m.volume;
  middle_sample(altered, brick) += static_cast<float>(1.5 * m.certificate.epsilon_abs);
  const VerifyResult r = measured(m, altered, m.certificate);
  BOOST_TEST(!r.holds);
  BOOST_TEST(r.worst.brick == static_cast<std::int64_t>(brick));
  BOOST_TEST(r.worst.tile == static_cast<std::int64_t>(m.volume.tile[brick]));
  const auto shape = m.volume.tile_shape(m.volume.level[brick]);
  BOOST_TEST((r.worst.sample == Index3{shape[2] / 2, shape[1] / 2, shape[0] / 2}));
  BOOST_TEST(r.failure.find(r.worst.dataset + " tile ") != std::string::npos, r.failure);
  BOOST_TEST(r.worst.value == static_cast<double>(middle_sample(altered, brick)));
}

BOOST_AUTO_TEST_CASE(every_sample_that_errs_by_more_than_epsilon_is_found) {
  const Made& m = small();
  std::mt19937 random(11);
  Device device;
  for (int trial = 0; trial < 6; ++trial) {
    MixedVolume altered = m.volume;
    auto entry = std::next(altered.tiles.begin(), trial % static_cast<int>(altered.tiles.size()));
    const std::size_t i = random() % entry->second.size();
    entry->second.f32[i] += static_cast<float>((trial % 2 == 0 ? 2 : -2) * m.certificate.epsilon_abs);
    BOOST_TEST(!verify(device, m.scan, altered, m.certificate, {true, 0.1, 3}).holds);
  }
}

BOOST_AUTO_TEST_CASE(swapped_tiles_are_found) {
  const Made& m = small();
  MixedVolume altered = m.volume;
  std::size_t first = 0;
  const auto other = [&] {
    const auto same = std::find(altered.level.begin() + static_cast<std::ptrdiff_t>(first) + 1,
                                altered.level.end(), altered.level[first]);
    return altered.level[first] == LevelTriple{0, 0, 0} ? altered.level.end() : same;
  };
  while (first + 1 < altered.level.size() && other() == altered.level.end()) ++first;
  BOOST_REQUIRE((other() != altered.level.end()));
  const auto second = other() - altered.level.begin();
  BOOST_REQUIRE(at(second) != first);
  std::swap(altered.tile[first], altered.tile[at(second)]);
  const VerifyResult r = measured(m, altered, m.certificate);
  BOOST_TEST(!r.holds);
  BOOST_TEST(r.seams > 0);
}

BOOST_AUTO_TEST_CASE(difference_on_a_shared_face_is_found_within_epsilon) {
  const Made& m = small();
  MixedVolume altered = m.volume;
  const std::size_t brick = brick_with_tile(altered);
  const LevelTriple l = altered.level[brick];
  float& corner = altered.tiles.at(l).f32[at(altered.tile[brick] * altered.tile_size(l))];
  corner = std::nextafter(corner, INFINITY);
  BOOST_TEST(compare_seams(m.volume).different == 0);
  BOOST_TEST(compare_seams(altered).different > 0);
  const VerifyResult r = measured(m, altered, m.certificate);
  BOOST_TEST(!r.holds);
  BOOST_TEST(r.failure.find("share") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(edited_epsilon_and_foreign_scan_are_found) {
  const Made& m = small();
  Certificate c = m.certificate;
  c.epsilon_abs = 0.9 * c.measured_max;  // |V - F| reaches more than that at a node
  BOOST_TEST(!measured(m, m.volume, c).holds);
  Made other = m;
  other.scan = noise_scan(19, 9, 33, 77);
  BOOST_TEST(!measured(other, other.volume, other.certificate, false).holds);
}

BOOST_AUTO_TEST_CASE(only_promised_samplers_of_the_device_are_judged) {
  const Made& m = small();
  Certificate c = m.certificate;
  c.holds_image3d.reset();
  c.total_image3d.reset();
  c.budget.sampler.image3d.reset();
  const VerifyResult buffer = measured(m, m.volume, c);
  BOOST_TEST(buffer.holds);
  BOOST_TEST(!buffer.holds_image3d.has_value());
  BOOST_TEST(buffer.total == buffer.total_buffer);
  c.holds_buffer = false;
  BOOST_TEST(!measured(m, m.volume, c).holds);
}

// --- the program ---

namespace {

struct Result {
  int code;
  std::string out, err;
};

Result run(const support::TemporaryFolder& folder, const std::string& words) {
  const auto out = folder / "out", err = folder / "err";
  const int status = std::system(
      (std::string(vdvr::support::vdvr_binary) + " " + words + " >" + out.string() + " 2>" + err.string())
          .c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, support::bytes_of(out), support::bytes_of(err)};
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

BOOST_AUTO_TEST_CASE(program_says_what_is_wrong_with_a_file_and_where) {
  const support::TemporaryFolder folder;
  const std::string scan = (folder / "s.h5").string(), file = (folder / "v.vdvr").string();
  BOOST_REQUIRE(run(folder, "simulate --phantom shepp-logan --detector 25x9 --angles 30 -o " + scan).code ==
                0);
  const Result built =
      run(folder, "build " + scan + " --epsilon 10% --storage f32 --size 12x12x6 -o " + file);
  BOOST_REQUIRE_MESSAGE(built.code == 0, built.err);
  const std::string with = " --projections " + scan;
  const Result good = run(folder, "verify " + file + with + " --exhaustive --json");
  BOOST_REQUIRE_MESSAGE(good.code == 0, good.err);
  const auto json = nlohmann::json::parse(good.out);
  BOOST_TEST(json["holds"].get<bool>());
  BOOST_TEST(json["cells_tested"].get<std::int64_t>() > 0);
  BOOST_TEST(json["samplers"]["buffer"]["holds"].get<bool>());
  const VdvrFile original = read_vdvr(file);
  const double epsilon = original.certificate.epsilon_abs;
  const std::string bad = (folder / "bad.vdvr").string();

  MixedVolume altered = original.volume;
  const std::size_t brick = brick_with_tile(altered);
  middle_sample(altered, brick) += static_cast<float>(1.5 * epsilon);
  write_vdvr(bad, altered, original.certificate);
  const Result mismatch = run(folder, "verify " + bad + with);
  BOOST_TEST(mismatch.code == 1);
  BOOST_TEST(has(mismatch.err, "does not match its hash"), mismatch.err);
  BOOST_TEST(has(mismatch.err, "tile " + std::to_string(altered.tile[brick]) + " sample"), mismatch.err);

  Certificate rehashed = original.certificate;
  rehashed.content_sha256.clear();
  write_vdvr(bad, altered, rehashed);
  const Result found = run(folder, "verify " + bad + with + " --exhaustive");
  BOOST_TEST(found.code == 1);
  BOOST_TEST(has(found.err, "tile " + std::to_string(altered.tile[brick]) + " sample"), found.err);

  altered = original.volume;
  middle_sample(altered, brick) = std::nextafter(middle_sample(altered, brick), INFINITY);
  write_vdvr(bad, altered, original.certificate);
  const Result within = run(folder, "verify " + bad + with);
  BOOST_TEST(within.code == 1);
  BOOST_TEST(has(within.err, "still within epsilon"), within.err);

  Certificate edited = original.certificate;
  edited.epsilon_abs *= 3;
  write_vdvr(bad, original.volume, edited);
  const Result contradiction = run(folder, "verify " + bad + with);
  BOOST_TEST(contradiction.code == 1);
  BOOST_TEST(has(contradiction.err, "contradicts itself"), contradiction.err);

  const std::string other = (folder / "other.h5").string();
  BOOST_REQUIRE(run(folder, "simulate --phantom sphere --detector 25x9 --angles 29 -o " + other).code == 0);
  const Result foreign = run(folder, "verify " + file + " --projections " + other);
  BOOST_TEST(foreign.code == 1);
  BOOST_TEST(has(foreign.err, "29 x 9 x 25"), foreign.err);
  BOOST_TEST(has(foreign.err, original.certificate.input_sha256), foreign.err);

  const std::string bytes = support::bytes_of(file);
  BOOST_TEST(
      run(folder, "verify " + folder.file("half.vdvr", bytes.substr(0, bytes.size() / 2)).string() + with)
          .code == 2);
}
