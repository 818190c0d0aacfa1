// What the ray-caster samples is what sample_at returns, to the bit: random mixed volumes of every sample
// type and mixture, record width, granularity and coarsening, bricks of all levels, by 1, 4, 8 and 16
// lanes.
#define BOOST_TEST_MODULE one_sampler
#include <boost/test/unit_test.hpp>

#include <bit>
#include <cmath>
#include <fstream>
#include <set>
#include <sstream>
#include <stdexcept>

#include "host/base/opencl/embedded.hpp"
#include "host/picture/render/raycast.hpp"
#include "host/volume/validate_volume.hpp"
#include "tests/support/device.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "tests/support/places.hpp"

using namespace vdvr;
using support::device;

namespace {

using Random = std::mt19937;

std::int64_t below(Random& random, std::int64_t n) {
  return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(n));
}

// --- volumes ---

/// What a volume is to have; the rest is drawn.
struct Kind {
  int types = 1;  ///< the sum of 1 << SampleType
  RecordKind records = RecordKind::f32;
  int granularity = 4;
  bool uniform = false;  ///< no tiles, the base as fine as the grid
};

std::vector<SampleType> types_of(int mask) {
  std::vector<SampleType> types;
  for (const SampleType t : {SampleType::f32, SampleType::u16, SampleType::u8})
    if ((mask >> static_cast<int>(t) & 1) != 0) types.push_back(t);
  return types;
}

/// `far`: with the first offset beyond what a compact record holds.
SampleBlock random_block(Random& random, SampleType type, std::int64_t tiles, std::int64_t tile_size,
                         bool far) {
  SampleBlock b;
  b.type = type;
  const std::int64_t count = tiles * tile_size;
  if (type == SampleType::f32) {
    for (std::int64_t i = 0; i < count; ++i)
      b.f32.push_back(static_cast<float>(below(random, 1 << 25) - (1 << 24)) * 0x1p-24f);
    return b;
  }
  const int bits = type == SampleType::u16 ? 16 : 8;
  for (std::int64_t t = 0; t < tiles; ++t) {
    const bool beyond = far && t == 0;
    const std::int64_t shift = beyond ? 2 : below(random, 24 - bits);
    // In units of 2^shift: with the largest code still below 2^24.
    const std::int64_t room = ((code_limit - 1) >> shift) - (1 << bits), compact = (1 << 14) - 1;
    const std::int64_t most = far ? room : std::min(room, compact);
    const std::int64_t n =
        beyond ? compact + 1 + below(random, room - compact) : below(random, 2 * most + 1) - most;
    b.shift.push_back(static_cast<std::uint8_t>(shift));
    b.offset.push_back(static_cast<std::int32_t>(n * (std::int64_t{1} << shift)));
  }
  for (std::int64_t i = 0; i < count; ++i) {
    if (type == SampleType::u16) b.u16.push_back(static_cast<std::uint16_t>(random()));
    else b.u8.push_back(static_cast<std::uint8_t>(random()));
  }
  return b;
}

/// In turn, another along each axis.
LevelTriple coarsening_of(unsigned turn, int granularity) {
  const unsigned count = static_cast<unsigned>(std::bit_width(static_cast<unsigned>(granularity)));
  // Factors without a divisor in common with 2, 3 and 4: every count is gone through.
  return {static_cast<std::uint8_t>(turn % count), static_cast<std::uint8_t>((5 * turn + 1) % count),
          static_cast<std::uint8_t>((7 * turn + 2) % count)};
}

/// Triples up to the finest level whose tiles are not too large for a test.
std::vector<LevelTriple> triples_of(const MixedVolume& v) {
  const LevelTriple finest = finest_level(v.rate, v.coarsening);
  std::vector<LevelTriple> triples;
  for (std::uint8_t z = 0; z <= finest[0]; ++z)
    for (std::uint8_t y = 0; y <= finest[1]; ++y)
      for (std::uint8_t x = 0; x <= finest[2]; ++x)
        if (v.tile_size({z, y, x}) <= 5000) triples.push_back({z, y, x});
  return triples;
}

/// Base and tiles in the types of `mask`, parts of a triple in several; which is drawn.
void fill_blocks(MixedVolume& v, Random& random, const std::vector<SampleType>& types, bool far) {
  const auto any = [&] { return types[static_cast<std::size_t>(below(random, std::ssize(types)))]; };
  const auto tiles = std::exchange(v.tiles, {});
  const Index3 n = v.base_samples();
  v.base = random_block(random, any(), 1, n[0] * n[1] * n[2], far);
  for (const auto& [kind, block] : tiles) {
    std::int64_t left = static_cast<std::int64_t>(block.size()) / v.tile_size(kind);
    std::vector<SampleType> order = types;
    std::shuffle(order.begin(), order.end(), random);
    for (std::uint8_t part = 0; left > 0; ++part) {
      const bool last = part + 1u == order.size();
      const std::int64_t count = last ? left : 1 + below(random, left);
      v.tiles[{kind.level, part}] = random_block(random, order[part], count, v.tile_size(kind), far);
      left -= count;
    }
  }
}

/// Every triple of levels 0 to 3, one brick each.
MixedVolume volume_of_all_triples(unsigned seed) {
  Random random(seed);
  MixedVolume v;
  v.granularity = 2;
  v.rate = 8;
  v.grid.cells = {8, 8, 8};
  const Index3 n = v.base_samples();
  v.base = random_block(random, SampleType::f32, 1, n[0] * n[1] * n[2], false);
  v.tile.assign(64, 0);
  for (std::uint8_t z = 0; z < 4; ++z)
    for (std::uint8_t y = 0; y < 4; ++y)
      for (std::uint8_t x = 0; x < 4; ++x) {
        const LevelTriple level{z, y, x};
        v.level.push_back(level);
        if (level != LevelTriple{})
          v.tiles[level] = random_block(random, SampleType::f32, 1, v.tile_size(level), false);
      }
  std::shuffle(v.level.begin(), v.level.end(), random);
  return v;
}

MixedVolume random_volume(const Kind& kind, unsigned seed) {
  Random random(seed);
  MixedVolume shape;
  shape.granularity = kind.granularity;
  if (!kind.uniform) shape.coarsening = coarsening_of(seed / 4, kind.granularity);
  const int deepest = *std::max_element(shape.coarsening.begin(), shape.coarsening.end());
  // At least two levels, and now and then the finest that a record can name.
  if (!kind.uniform) shape.rate = 1 << (seed % 5 == 4 ? largest_level - deepest : 1 + below(random, 3));
  Grid grid;
  for (std::size_t a = 0; a < 3; ++a) {
    const int c = shape.coarsening[2 - a];
    // One to five bricks, the last of them often cut off.
    grid.cells[a] = (1 + below(random, 5 * (kind.granularity >> c))) << c;
    // Powers of two: a point in cells has an exact place in the world.
    grid.spacing[a] = std::ldexp(1.0, static_cast<int>(below(random, 5)) - 2);
  }
  const auto triples = kind.uniform ? std::vector<LevelTriple>{{}} : triples_of(shape);
  const int wanted = kind.types;
  for (unsigned attempt = 0; attempt < 100; ++attempt) {
    MixedVolume v = support::empty_mixed(grid, kind.granularity, shape.rate, triples, 100 * seed + attempt,
                                         shape.coarsening);
    fill_blocks(v, random, types_of(wanted), kind.records == RecordKind::wide);
    if (wanted != 1) v.step = std::ldexp(1.0, -12 - static_cast<int>(below(random, 12)));
    if (sample_types(v) == wanted) return v;
    // Too few bricks for so many types.
    for (std::size_t a = 0; a < 3; ++a)
      grid.cells[a] = std::min<std::int64_t>(grid.cells[a] + kind.granularity, 5 * kind.granularity);
  }
  throw std::logic_error("no such volume was drawn");
}

// --- points ---

constexpr int slots = 16, steps = 6;

/// A coordinate in or beside brick b: between samples, on samples, on faces, an ulp beside them, outside the
/// box.
float random_coordinate(Random& random, const MixedVolume& v, std::size_t a, std::int64_t b, int level) {
  const std::int64_t low = b * v.granularity, width = std::min(v.granularity + low, v.grid.cells[a]) - low;
  const int per_cell = level - v.coarsening[2 - a];
  const std::int64_t samples = per_cell >= 0 ? width << per_cell : width >> -per_cell;
  const auto sample = [&] {
    return static_cast<float>(static_cast<double>(low) +
                              std::ldexp(static_cast<double>(below(random, samples + 1)), -per_cell));
  };
  const auto cells = static_cast<float>(v.grid.cells[a]);
  switch (below(random, 12)) {
    case 0:
      return sample();
    case 1:
      return std::nextafter(sample(), -1e9f);
    case 2:
      return std::nextafter(sample(), 1e9f);
    case 3:
      return static_cast<float>(low + below(random, 2) * width);
    case 4:
      return std::nextafter(static_cast<float>(low + below(random, 2) * width), -1e9f);
    case 5:
      return std::nextafter(static_cast<float>(low + below(random, 2) * width), 1e9f);
    case 6:
      return below(random, 2) == 0 ? -static_cast<float>(below(random, 1 << 20)) * 0x1p-18f
                                   : cells + static_cast<float>(below(random, 1 << 20)) * 0x1p-18f;
    default:
      return static_cast<float>(low) +
             static_cast<float>(below(random, 1 << 24)) * 0x1p-24f * static_cast<float>(width);
  }
}

/// points[group][step][slot]: the points of a slot lie in one brick, for some of the steps or all.
std::vector<cl_float4> random_points(const MixedVolume& v, unsigned seed, int groups) {
  Random random(seed);
  const Index3 n = v.bricks();
  std::vector<cl_float4> points(static_cast<std::size_t>(groups * steps * slots));
  for (int group = 0; group < groups; ++group) {
    std::array<Index3, slots> brick{};
    for (int step = 0; step < steps; ++step) {
      const bool all_anew = step == 0 || below(random, 4) == 0;
      for (std::size_t slot = 0; slot < slots; ++slot) {
        if (all_anew || below(random, 40) == 0)
          for (std::size_t a = 0; a < 3; ++a) brick[slot][a] = below(random, n[a]);
        const Index3& b = brick[slot];
        const LevelTriple& level = v.level[static_cast<std::size_t>((b[2] * n[1] + b[1]) * n[0] + b[0])];
        cl_float4& p = points[static_cast<std::size_t>(group * steps + step) * slots + slot];
        // Half of the groups stay within bricks, so that packets keep them open.
        for (std::size_t a = 0; a < 3; ++a) {
          p.s[a] = random_coordinate(random, v, a, b[a], level[2 - a]);
          if (group % 2 == 1)
            p.s[a] = std::clamp(p.s[a], static_cast<float>(b[a] * v.granularity),
                                std::nextafter(static_cast<float>((b[a] + 1) * v.granularity), 0.0f));
        }
      }
    }
  }
  return points;
}

// --- sampling ---

cl::Program build_points(const opencl::Defines& defines) {
  std::ifstream file(std::string(vdvr::support::source_dir) + "/tests/device/one_sampler.cl");
  std::ostringstream text;
  text << file.rdbuf();
  const std::string points = text.str();
  BOOST_REQUIRE(!points.empty());
  opencl::State& state = device().state();
  cl::Program program(state.context, opencl::resolve_source("picture/render/raycast.cl") + points);
  const std::string options = opencl::build_options(defines);
  try {
    program.build({state.device}, options.c_str());
  } catch (const cl::Error&) {
    BOOST_FAIL(program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(state.device));
  }
  return program;
}

/// One volume on the device, its points, and what sample_at gives there.
class Sampled {
 public:
  Sampled(const MixedVolume& v, unsigned seed)
      : resident_(device(), v, ImageLimits{}),  // no atlas: what it would hold is another test's
        host_points_(random_points(v, seed, groups)),
        points_(device().state(), std::span<const cl_float4>(host_points_), "points") {
    for (const cl_float4& p : host_points_) {
      Vec3 world{};
      for (std::size_t a = 0; a < 3; ++a) world[a] = static_cast<double>(p.s[a]) * v.grid.spacing[a];
      truth_.push_back(sample_at(v, world));
    }
  }

  /// By the program that the ray-caster compiles for these lanes, and where they are one by the definition
  /// too, compiled for the device. `lit`: from samples with stored gradients.
  void check_by(int lanes, bool lit) {
    const ResidentVolume::Impl& v = resident_.impl();
    RenderOptions o;
    o.mode = RenderMode::slice;
    const cl::Program program = build_points(raycast_defines(
        v, o, SamplerKind::buffer, lit ? GradientKind::stored : GradientKind::central, {}, lanes));
    check_packets(program, lanes, lit);
    if (lanes == 1 && !lit) check_definition(program);
  }

 private:
  static constexpr int groups = 80;

  void check_packets(const cl::Program& program, int lanes, bool lit) const {
    const ResidentVolume::Impl& v = resident_.impl();
    opencl::DeviceArray<float> values(*v.state, truth_.size(), "values");
    cl::KernelFunctor<cl::Buffer, cl::Buffer, VdvrGrid, cl::Buffer, cl_int, cl_int, cl::Buffer> sample(
        program, "sample_points");
    sample(cl::EnqueueArgs(v.state->queue, cl::NDRange(static_cast<std::size_t>(groups * slots / lanes))),
           lit ? v.lit().samples() : v.field.samples.buffer(),
           lit ? v.lit().bricks() : v.field.bricks.buffer(), lit ? v.lit().grid() : v.field.grid,
           points_.buffer(), groups, steps, values.buffer());
    check(fmt::format("{} lanes{}", lanes, lit ? ", lit" : ""), values.to_host());
  }

  void check_definition(const cl::Program& program) const {
    const ResidentVolume::Impl& v = resident_.impl();
    opencl::DeviceArray<float> values(*v.state, truth_.size(), "values"),
        by_planes(*v.state, truth_.size(), "values by planes");
    cl::KernelFunctor<cl::Buffer, cl::Buffer, VdvrGrid, cl::Buffer, cl_int, cl::Buffer, cl::Buffer> sample(
        program, "define_points");
    sample(cl::EnqueueArgs(v.state->queue, cl::NDRange(truth_.size())), v.field.samples.buffer(),
           v.field.bricks.buffer(), v.field.grid, points_.buffer(), static_cast<cl_int>(truth_.size()),
           values.buffer(), by_planes.buffer());
    check("the definition", values.to_host());
    check("the definition by planes", by_planes.to_host());
  }

  void check(const std::string& by, const std::vector<float>& values) const {
    std::size_t wrong = 0, first = 0;
    for (std::size_t i = values.size(); i-- > 0;)
      if (std::bit_cast<std::uint32_t>(values[i]) != std::bit_cast<std::uint32_t>(truth_[i])) {
        ++wrong;
        first = i;
      }
    const cl_float4& p = host_points_[first];
    BOOST_TEST(
        wrong == 0,
        fmt::format("{}: {} of {} points differ; point {} at cell {:a}, {:a}, {:a}: {:a} for {:a}", by, wrong,
                    values.size(), first, p.s[0], p.s[1], p.s[2], values[first], truth_[first]));
  }

  ResidentVolume resident_;
  std::vector<cl_float4> host_points_;
  opencl::DeviceArray<cl_float4> points_;
  std::vector<float> truth_;
};

/// What the volumes of the test had between them.
struct Seen {
  std::set<std::pair<int, RecordKind>> types;
  std::set<std::array<int, 3>> coarsenings;  ///< axis, coarsening, granularity
  bool parts = false;
  int highest = 0;
};

void note(Seen& seen, const MixedVolume& v) {
  seen.types.emplace(sample_types(v), record_kind(v));
  for (const LevelTriple& l : v.level) {
    seen.highest = std::max<int>(seen.highest, *std::max_element(l.begin(), l.end()));
  }
  for (int a = 0; a < 3; ++a)
    seen.coarsenings.insert({a, v.coarsening[static_cast<std::size_t>(a)], v.granularity});
  seen.parts = seen.parts || has_parts(v);
}

/// Every mixture of types by every width of records that it can have.
std::vector<Kind> kinds() {
  std::vector<Kind> all{{1, RecordKind::f32}};
  for (int types = 2; types < 8; ++types)
    for (const RecordKind records : {RecordKind::compact, RecordKind::wide}) all.push_back({types, records});
  return all;
}

}  // namespace

BOOST_AUTO_TEST_CASE(rays_sample_what_sample_at_returns_to_the_bit) {
  constexpr std::array<int, 4> lanes{1, 4, 8, 16}, granularities{4, 2, 8, 1};
  Seen seen;
  unsigned seed = 1;
  for (int round = 0; round < 2; ++round)
    for (Kind kind : kinds()) {
      kind.granularity = granularities[(seed + seed / 4) % 4];
      const MixedVolume v = random_volume(kind, seed);
      const auto problem = validate_volume(v);
      BOOST_TEST_REQUIRE(!problem.has_value(), problem.value_or(Problem{}).what);
      BOOST_TEST_CONTEXT("volume " << seed << ", types " << kind.types << ", granularity " << v.granularity
                                   << ", coarsening (z, y, x) " << int{v.coarsening[0]}
                                   << int{v.coarsening[1]} << int{v.coarsening[2]}) {
        BOOST_TEST((record_kind(v) == kind.records));
        note(seen, v);
        Sampled sampled(v, seed);
        // In the second round every kind has another number of lanes.
        sampled.check_by(lanes[(seed + static_cast<unsigned>(round)) % 4], false);
        if (seed % 10 == 7) sampled.check_by(lanes[(seed / 10 + 3) % 4], true);
      }
      ++seed;
    }
  BOOST_TEST(seen.types.size() == kinds().size());
  BOOST_TEST(seen.parts);
  BOOST_TEST(seen.highest == largest_level);
  // 1 of granularity 1, 2 of 2, 3 of 4, 4 of 8, along each axis.
  BOOST_TEST(seen.coarsenings.size() == 3u * (1 + 2 + 3 + 4));
}

BOOST_AUTO_TEST_CASE(every_triple_of_levels_is_sampled_to_the_bit) {
  for (const int lanes : {1, 4, 8, 16}) {
    const MixedVolume v = volume_of_all_triples(static_cast<unsigned>(lanes));
    BOOST_TEST_REQUIRE(!validate_volume(v).has_value());
    BOOST_TEST((std::set<LevelTriple>(v.level.begin(), v.level.end()).size() == 64));
    Sampled(v, static_cast<unsigned>(lanes)).check_by(lanes, false);
  }
}

BOOST_AUTO_TEST_CASE(uniform_volumes_are_sampled_the_same_without_records) {
  for (const int lanes : {1, 4, 8, 16}) {
    Kind kind;
    kind.uniform = true;
    Sampled sampled(random_volume(kind, static_cast<unsigned>(lanes)), static_cast<unsigned>(lanes));
    sampled.check_by(lanes, false);
    if (lanes == 16) sampled.check_by(lanes, true);
  }
}
