// Lit samples against the stored field and its central differences in double precision.
#define BOOST_TEST_MODULE lit_samples
#include <boost/test/unit_test.hpp>

#include <bit>
#include <cmath>

#include "host/picture/render/raycast.hpp"
#include "host/volume/sampler/lit_samples.hpp"
#include "host/volume/sampler/resident_volume.hpp"
#include "tests/reference/mixed_field.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "tests/support/rendering.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;
using fields::centred_grid;
using support::device, support::scattered_levels, support::u;

namespace {

/// Lit samples read back, with what says where they lie.
struct Lit {
  explicit Lit(const MixedVolume& v) : field(&v), resident(device(), v) {
    const LitSamples& lit = resident.impl().lit();
    auto& queue = resident.impl().state->queue;
    words.resize(4 * resident.impl().lit_layout.samples());
    records.resize(2 * v.level.size());
    queue.enqueueReadBuffer(lit.samples(), CL_TRUE, 0, words.size() * 4, words.data());
    queue.enqueueReadBuffer(lit.bricks(), CL_TRUE, 0, records.size() * 4, records.data());
    unit = static_cast<double>(lit.grid().step) * 0x1p22;
  }
  /// Sample number x, y, z of a brick: where it stands.
  [[nodiscard]] std::size_t place(std::size_t brick, const Index3& sample) const {
    return records[2 * brick] +
           static_cast<std::size_t>(sample[0] + side(brick, 0) * (sample[1] + side(brick, 1) * sample[2]));
  }
  /// Samples along an axis of what stores the brick: its tile, or the base.
  [[nodiscard]] std::int64_t side(std::size_t brick, std::size_t axis) const {
    const LevelTriple l = field->level[brick];
    return l == LevelTriple{0, 0, 0} ? field->base_samples()[axis] : field->tile_shape(l)[2 - axis];
  }
  /// Nothing of what stores the brick is behind that along y.
  [[nodiscard]] bool is_in_last_row(std::size_t brick, std::size_t at) const {
    const std::size_t first = field->level[brick] == LevelTriple{0, 0, 0} ? 0 : records[2 * brick];
    return static_cast<std::int64_t>(at - first) / side(brick, 0) % side(brick, 1) == side(brick, 1) - 1;
  }
  [[nodiscard]] float value(std::size_t at) const { return std::bit_cast<float>(words[2 * at]); }
  /// Whether the words beside a value and a gradient are those of sample number `next`.
  [[nodiscard]] bool stands_beside(std::size_t at, std::size_t next) const {
    const std::size_t gradients = words.size() / 2;
    return words[2 * at + 1] == words[2 * next] &&
           words[gradients + 2 * at + 1] == words[gradients + 2 * next];
  }
  [[nodiscard]] Vec3 gradient(std::size_t at) const {
    Vec3 g{};
    for (std::size_t a = 0; a < 3; ++a) {
      const int bits = static_cast<int>(words[words.size() / 2 + 2 * at] >> (10 * a) & 1023u);
      g[a] = unit * (bits > 511 ? bits - 1024 : bits);
    }
    return g;
  }

  const MixedVolume* field;
  ResidentVolume resident;
  std::vector<std::uint32_t> words, records;
  double unit = 0;
};

Index3 brick_position(const MixedVolume& v, std::size_t i) {
  const auto k = static_cast<std::int64_t>(i);
  const Index3 n = v.bricks();
  return {k % n[0], k / n[0] % n[1], k / (n[0] * n[1])};
}

Index3 brick_of(const MixedVolume& v, const Vec3& c) {
  return {reference::brick_of(v, 0, c[0]), reference::brick_of(v, 1, c[1]), reference::brick_of(v, 2, c[2])};
}

/// The field at p for someone in the brick of c: on that brick's far faces its own samples count. Only fields
/// that were not closed can tell.
double field_seen_from(const MixedVolume& v, const Vec3& c, const Vec3& p) {
  const Index3 brick = brick_of(v, c);
  for (std::size_t a = 0; a < 3; ++a) {
    const double low = static_cast<double>(brick[a] * v.granularity);
    if (p[a] < low || p[a] > low + v.granularity) return reference::field_of_brick(v, brick_of(v, p), p);
  }
  return reference::field_of_brick(v, brick, p);
}

/// Central differences over one base cell, one-sided at the grid's faces; per smallest spacing.
Vec3 central(const MixedVolume& v, const Vec3& c) {
  const double unit = *std::min_element(v.grid.spacing.begin(), v.grid.spacing.end());
  Vec3 g{};
  for (std::size_t a = 0; a < 3; ++a) {
    Vec3 lo = c, hi = c;
    lo[a] = std::max(c[a] - 0.5, 0.0);
    hi[a] = std::min(c[a] + 0.5, static_cast<double>(v.grid.cells[a]));
    g[a] =
        (field_seen_from(v, c, hi) - field_seen_from(v, c, lo)) / (hi[a] - lo[a]) * unit / v.grid.spacing[a];
  }
  return g;
}

/// log2 of samples a cell along axis x, y or z.
int density(const MixedVolume& v, std::size_t brick, std::size_t axis) {
  return v.level[brick][2 - axis] - v.coarsening[2 - axis];
}

/// f(brick, sample, cell coordinate) for every stored sample within the grid.
template <class F>
void each_sample(const MixedVolume& v, F&& f) {
  for (std::size_t b = 0; b < v.level.size(); ++b) {
    const Index3 at = brick_position(v, b);
    Index3 end{};
    for (std::size_t a = 0; a < 3; ++a)
      end[a] = std::min<std::int64_t>(v.granularity, v.grid.cells[a] - at[a] * v.granularity)
                   << v.level[b][2 - a] >>
               v.coarsening[2 - a];
    for (std::int64_t z = 0; z <= end[2]; ++z)
      for (std::int64_t y = 0; y <= end[1]; ++y)
        for (std::int64_t x = 0; x <= end[0]; ++x) {
          const Index3 s{x, y, z};
          Vec3 c{};
          for (std::size_t a = 0; a < 3; ++a)
            c[a] = static_cast<double>(at[a] * v.granularity) +
                   std::ldexp(static_cast<double>(s[a]), -density(v, b, a));
          f(b, s, c);
        }
  }
}

/// Lowest density along `axis` of the bricks whose closed boxes hold cell coordinate c.
int lowest_density(const MixedVolume& v, const Vec3& c, std::size_t axis) {
  int lowest = 7;
  const Index3 n = v.bricks();
  for (std::size_t b = 0; b < v.level.size(); ++b) {
    const Index3 at = brick_position(v, b);
    bool holds = true;
    for (std::size_t a = 0; a < 3; ++a) {
      const double low = static_cast<double>(at[a] * v.granularity);
      holds = holds && c[a] >= low && c[a] <= low + v.granularity;
    }
    if (holds) lowest = std::min(lowest, density(v, b, axis));
  }
  return n[0] > 0 ? lowest : 0;
}

bool on_lattice(const MixedVolume& v, const Vec3& c) {
  for (std::size_t a = 0; a < 3; ++a) {
    const double scaled = std::ldexp(c[a], lowest_density(v, c, a));
    if (scaled != std::floor(scaled)) return false;
  }
  return true;
}

double wave(double x, double y, double z) {
  return std::sin(0.9 * x + 0.2 * y) * std::cos(0.7 * z - 0.3 * y);
}

/// Of scattered levels, unequal spacings and bricks that the grid cuts; the second with a coarser base.
std::vector<MixedVolume> waves() {
  return {fields::mixed(centred_grid({14, 13, 10}, {1, 1.25, 0.8}), 4, scattered_levels, wave),
          fields::mixed(centred_grid({14, 12, 13}, {1, 1.25, 0.8}), 4, scattered_levels, wave, {0, 2, 1})};
}

void check_values(const MixedVolume& v) {
  const Lit lit(v);
  int wrong = 0, apart = 0;
  each_sample(v, [&](std::size_t b, const Index3& s, const Vec3&) {
    const std::size_t at = lit.place(b, s);
    if (!(static_cast<double>(lit.value(at)) == reference::stored_sample(v, brick_position(v, b), s)))
      ++wrong;
    if (!lit.stands_beside(at, lit.is_in_last_row(b, at) ? at : lit.place(b, {s[0], s[1] + 1, s[2]})))
      ++apart;
  });
  BOOST_TEST(wrong == 0);
  BOOST_TEST(apart == 0);
}

RenderOptions seen(const MixedVolume& v) {
  RenderOptions o;
  o.width = o.height = 65;
  o.camera = orbit_camera(v.grid, 37, 21, 1);
  o.transfer = transfer_preset("default", -1, 1);
  o.sampler = SamplerKind::buffer;
  return o;
}

bool same_colours(const std::vector<cl_float4>& a, const std::vector<cl_float4>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const cl_float4& p, const cl_float4& q) {
    return p.s[0] == q.s[0] && p.s[1] == q.s[1] && p.s[2] == q.s[2] && p.s[3] == q.s[3];
  });
}

}  // namespace

BOOST_AUTO_TEST_CASE(values_are_the_stored_samples_to_the_bit) {
  const MixedVolume v = support::random_mixed(centred_grid({14, 13, 10}), 4, 8,
                                              {{0, 0, 0}, {1, 1, 1}, {2, 0, 1}, {0, 3, 0}}, 3);
  check_values(v);
  check_values(support::random_mixed(centred_grid({16, 14, 10}), 4, 8,
                                     {{0, 0, 0}, {1, 1, 1}, {2, 0, 1}, {0, 3, 0}}, 3, {0, 1, 2}));
}

BOOST_AUTO_TEST_CASE(gradients_are_central_differences_rounded_to_their_unit) {
  for (const MixedVolume& v : waves()) {
    const Lit lit(v);
    double worst = 0;
    int compared = 0;
    each_sample(v, [&](std::size_t b, const Index3& s, const Vec3& c) {
      if (!on_lattice(v, c)) return;
      const Vec3 stored = lit.gradient(lit.place(b, s)), truth = central(v, c);
      ++compared;
      for (std::size_t a = 0; a < 3; ++a) worst = std::max(worst, std::abs(stored[a] - truth[a]));
    });
    BOOST_TEST(compared > 1000);
    // Half a unit, and differences over half a cell at least of values of at most 1 that err by 14 u each.
    BOOST_TEST(worst <= lit.unit / 2 + 2 * 2 * 14 * u / 0.8);
  }
}

BOOST_AUTO_TEST_CASE(gradients_that_are_too_long_keep_their_direction) {
  // One sample of 1 in zeros: half the range over one cell would do, one-sided differences at faces are
  // longer.
  MixedVolume v =
      as_mixed(fields::uniform(centred_grid({4, 4, 4}), [](double, double, double) { return 0; }));
  v.base.f32[0] = 1;
  const Lit lit(v);
  const Vec3 g = lit.gradient(lit.place(0, {0, 0, 0}));
  const Vec3 truth = central(v, {0, 0, 0});
  BOOST_TEST(truth[0] == -1);
  for (std::size_t a = 0; a < 3; ++a) BOOST_TEST(g[a] == -511 * lit.unit);
}

BOOST_AUTO_TEST_CASE(no_gradient_jumps_where_levels_meet) {
  for (const MixedVolume& v : waves()) {
    const Lit lit(v);
    // On faces, edges and corners that bricks share, interpolated from either side's samples.
    const auto of_brick = [&](std::size_t b, const Vec3& c) {
      const Index3 at = brick_position(v, b);
      Index3 low{};
      Vec3 t{};
      for (std::size_t a = 0; a < 3; ++a) {
        const double scale = std::ldexp(1.0, density(v, b, a));
        const double local = (c[a] - static_cast<double>(at[a] * v.granularity)) * scale;
        const double last = static_cast<double>(std::min<std::int64_t>(
                                v.granularity, v.grid.cells[a] - at[a] * v.granularity)) *
                                scale -
                            1;
        low[a] = static_cast<std::int64_t>(std::min(std::floor(local), last));
        t[a] = local - static_cast<double>(low[a]);
      }
      Vec3 g{};
      for (int corner = 0; corner < 8; ++corner) {
        Index3 s = low;
        double weight = 1;
        for (std::size_t a = 0; a < 3; ++a) {
          const bool far = (corner >> a & 1) != 0;
          s[a] += far ? 1 : 0;
          weight *= far ? t[a] : 1 - t[a];
        }
        if (weight == 0) continue;
        const Vec3 sample = lit.gradient(lit.place(b, s));
        for (std::size_t a = 0; a < 3; ++a) g[a] += weight * sample[a];
      }
      return g;
    };
    double worst = 0;
    int met = 0;
    const Index3 n = v.bricks();
    for (std::size_t b = 0; b < v.level.size(); ++b) {
      const Index3 at = brick_position(v, b);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (at[axis] + 1 == n[axis]) continue;
        const std::size_t next = b + static_cast<std::size_t>(axis == 0 ? 1 : axis == 1 ? n[0] : n[0] * n[1]);
        for (int i = 0; i <= 24; ++i)
          for (int k = 0; k <= 24; ++k) {
            Vec3 c{};
            c[axis] = static_cast<double>((at[axis] + 1) * v.granularity);
            const std::size_t p = (axis + 1) % 3, q = (axis + 2) % 3;
            c[p] = static_cast<double>(at[p] * v.granularity) + i / 6.0;
            c[q] = static_cast<double>(at[q] * v.granularity) + k / 6.0;
            if (c[p] > static_cast<double>(v.grid.cells[p]) || c[q] > static_cast<double>(v.grid.cells[q]))
              continue;
            ++met;
            const Vec3 here = of_brick(b, c), there = of_brick(next, c);
            for (std::size_t a = 0; a < 3; ++a) worst = std::max(worst, std::abs(here[a] - there[a]));
          }
      }
    }
    BOOST_TEST(met > 10000);
    // What is interpolated on edges and then on faces is rounded to the unit each time. Weighted sums of
    // eight gradients of up to 512 units, in double.
    BOOST_TEST(worst <= lit.unit + tolerance::fp64_sum(16, 512 * lit.unit));
    BOOST_TEST(worst > 0);
  }
}

BOOST_AUTO_TEST_CASE(pictures_from_lit_samples_have_the_bits_of_the_field_in_everything_but_light) {
  for (const MixedVolume& v : waves()) {
    const ResidentVolume resident(device(), v);
    RenderOptions o = seen(v);
    o.shading = false;
    for (const Classification classification : {Classification::post, Classification::preintegrated}) {
      o.classification = classification;
      o.gradient = GradientKind::central;
      const auto stored = raycast_float(device(), resident, o).pixels;
      o.gradient = GradientKind::stored;
      for (const int lanes : {1, 4, 8, 16}) {
        RaycastTuning tuning;
        tuning.lanes = lanes;
        const auto lit = raycast_float(device(), resident, o, tuning).pixels;
        BOOST_TEST(same_colours(stored, lit));
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(lanes_change_no_bit_of_the_light) {
  for (const MixedVolume& v : waves()) {
    const ResidentVolume resident(device(), v);
    RenderOptions o = seen(v);
    o.gradient = GradientKind::stored;
    RaycastTuning tuning;
    tuning.lanes = 1;
    const auto one = raycast_float(device(), resident, o, tuning).pixels;
    for (const int lanes : {4, 8, 16}) {
      tuning.lanes = lanes;
      const auto many = raycast_float(device(), resident, o, tuning).pixels;
      BOOST_TEST(same_colours(one, many));
    }
  }
}

BOOST_AUTO_TEST_CASE(integers_are_lit_as_what_they_stand_for) {
  MixedVolume v = support::random_mixed(centred_grid({9, 8, 7}), 4, 2, {{0, 0, 0}, {1, 1, 1}}, 5);
  v.step = 0x1p-8;
  const auto to_integers = [](SampleBlock& b, std::size_t tiles, SampleType type) {
    const std::size_t n = b.f32.size();
    b.type = type;
    for (std::size_t i = 0; i < n; ++i) {
      if (type == SampleType::u16) b.u16.push_back(static_cast<std::uint16_t>(i * 7 % 1000));
      else b.u8.push_back(static_cast<std::uint8_t>(i * 7 % 251));
    }
    b.f32.clear();
    for (std::size_t t = 0; t < tiles; ++t) {
      b.shift.push_back(static_cast<std::uint8_t>(t % 3));
      b.offset.push_back(static_cast<std::int32_t>(t) * 4 - 8);
    }
  };
  auto& tiles = v.tiles.at({1, 1, 1});
  to_integers(tiles, tiles.f32.size() / static_cast<std::size_t>(v.tile_size({1, 1, 1})), SampleType::u16);
  to_integers(v.base, 1, SampleType::u8);
  check_values(v);
}

BOOST_AUTO_TEST_CASE(automatic_takes_what_there_is_room_for) {
  const MixedVolume v = waves().front();
  RenderOptions o;
  o.width = o.height = 9;
  o.camera = orbit_camera(v.grid, 37, 21, 1);
  o.transfer = transfer_preset("default", -1, 1);
  o.sampler = SamplerKind::buffer;
  o.gradient = GradientKind::automatic;
  const ResidentVolume roomy(device(), v);
  BOOST_TEST((raycast(device(), roomy, o).gradient == GradientKind::stored));
  const std::uint64_t lit = roomy.impl().lit().bytes();
  BOOST_TEST(roomy.bytes() > lit);
  o.mode = RenderMode::mip;
  BOOST_TEST((raycast(device(), roomy, o).gradient == GradientKind::central));
  o.mode = RenderMode::dvr;
  o.shading = false;
  BOOST_TEST((raycast(device(), roomy, o).gradient == GradientKind::central));
  o.shading = true;

  // As much as such a picture takes without stored gradients.
  Device measured;
  o.gradient = GradientKind::central;
  static_cast<void>(raycast(measured, ResidentVolume(measured, v), o));
  o.gradient = GradientKind::automatic;
  Device small("", measured.peak_memory());
  const ResidentVolume tight(small, v);
  BOOST_TEST((raycast(small, tight, o).gradient == GradientKind::central));
  o.gradient = GradientKind::stored;
  BOOST_CHECK_THROW(raycast(small, tight, o), ResourceError);
  o.sampler = SamplerKind::image3d;
  if (roomy.has_image3d()) BOOST_CHECK_THROW(raycast(device(), roomy, o), InputError);
}
