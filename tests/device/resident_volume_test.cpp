#define BOOST_TEST_MODULE resident_volume
#include <boost/test/unit_test.hpp>

#include <random>

#include "host/volume/sampler/resident_volume.hpp"
#include "tests/support/fields.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "vdvr/error.hpp"
#include "vdvr/raycast.hpp"

using namespace vdvr;
using fields::centred_grid;

namespace {

double wave(double x, double y, double z) { return std::sin(1.3 * x) + std::cos(0.7 * y) * z; }

// Odd sizes, three triples of different shapes.
MixedVolume many_tiles() {
  return fields::mixed(
      fields::centred_grid({13, 10, 7}), 4,
      [](const Index3& b) -> LevelTriple {
        switch ((b[0] + 2 * b[1] + 3 * b[2]) % 4) {
          case 0:
            return {1, 1, 1};
          case 1:
            return {0, 2, 1};
          case 2:
            return {0, 0, 0};
          default:
            return {2, 0, 0};
        }
      },
      wave);
}

struct Box {
  std::array<std::uint64_t, 3> lo{}, hi{};
};
bool are_disjoint(const Box& a, const Box& b) {
  for (std::size_t i = 0; i < 3; ++i)
    if (a.hi[i] <= b.lo[i] || b.hi[i] <= a.lo[i]) return true;
  return false;
}

// What lies in the image of one type.
std::vector<Box> boxes_of(const MixedVolume& v, const AtlasLayout& l, SampleType type) {
  const Index3 base = v.grid.samples();
  std::vector<Box> boxes;
  if (v.base.type == type) {
    boxes.emplace_back();
    for (std::size_t a = 0; a < 3; ++a) boxes[0].hi[a] = static_cast<std::uint64_t>(base[a]);
  }
  for (const auto& [triple, s] : l.shelves) {
    if (v.tiles.at(triple).type != type) continue;
    for (std::uint64_t i = 0; i < s.tiles; ++i) {
      Box b{s.origin(i), {}};
      for (std::size_t a = 0; a < 3; ++a) b.hi[a] = b.lo[a] + s.tile[a];
      boxes.push_back(b);
    }
  }
  return boxes;
}

ImageLimits limits(std::uint64_t x, std::uint64_t y, std::uint64_t z, std::uint64_t bytes = 1u << 30) {
  return {{true, true, true}, {x, y, z}, bytes, bytes};
}

}  // namespace

BOOST_AUTO_TEST_CASE(packed_tiles_are_disjoint_and_inside_tiny_limits) {
  for (const auto& types : {std::vector{SampleType::f32}, std::vector{SampleType::u8},
                            std::vector{SampleType::u8, SampleType::u16, SampleType::f32}}) {
    const MixedVolume v = types.size() > 1 ? support::in_types_by_tile(many_tiles(), types)
                                           : support::in_types(many_tiles(), types);
    for (const auto& limit :
         {limits(2048, 2048, 2048), limits(17, 400, 17), limits(14, 11 + 500, 20), limits(64, 64, 64)}) {
      const AtlasLayout l = pack_atlas(v, limit);
      BOOST_TEST_CONTEXT(l.reason) {
        BOOST_REQUIRE(l.fits);
        std::size_t placed = 0, tiles = 0;
        for (const auto& [triple, samples] : v.tiles)
          tiles += samples.size() / static_cast<std::size_t>(v.tile_size(triple));
        for (const SampleType type : {SampleType::f32, SampleType::u16, SampleType::u8}) {
          const auto boxes = boxes_of(v, l, type);
          const auto& size = l.size[static_cast<std::size_t>(type)];
          placed += boxes.size();
          for (std::size_t i = 0; i < boxes.size(); ++i) {
            for (std::size_t a = 0; a < 3; ++a) BOOST_TEST(boxes[i].hi[a] <= size[a]);
            for (std::size_t j = 0; j < i; ++j) BOOST_TEST(are_disjoint(boxes[i], boxes[j]));
          }
          for (std::size_t a = 0; a < 3; ++a) BOOST_TEST(size[a] <= limit.size[a]);
        }
        BOOST_TEST(placed == tiles + 1);
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(what_does_not_fit_is_said_with_the_reason) {
  const MixedVolume v = many_tiles();
  const AtlasLayout narrow = pack_atlas(v, limits(13, 2048, 2048));
  BOOST_TEST(!narrow.fits);
  BOOST_TEST(narrow.reason.find("do not fit") != std::string::npos);
  const AtlasLayout full = pack_atlas(v, limits(64, 32, 20));
  BOOST_TEST(!full.fits);
  const AtlasLayout heavy = pack_atlas(v, limits(2048, 2048, 2048, 1000));
  BOOST_TEST(!heavy.fits);
  BOOST_TEST(heavy.reason.find("bytes") != std::string::npos);
  ImageLimits none = limits(2048, 2048, 2048);
  none.linear[0] = false;
  BOOST_TEST(pack_atlas(v, none).reason.find("linear") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(volume_without_an_atlas_refuses_image3d_and_renders_by_buffer) {
  Device device;
  const MixedVolume v = many_tiles();
  const ResidentVolume resident(device, v, limits(4, 4, 4));
  BOOST_TEST(!resident.has_image3d());
  RenderOptions o;
  o.width = o.height = 8;
  o.mode = RenderMode::slice;
  o.sampler = SamplerKind::image3d;
  BOOST_CHECK_THROW(raycast(device, resident, o), ResourceError);
  o.sampler = SamplerKind::automatic;
  const RenderResult r = raycast(device, resident, o);
  BOOST_TEST((r.sampler == SamplerKind::buffer));
  BOOST_TEST(r.sampler_reason == resident.image3d_reason());
}

BOOST_AUTO_TEST_CASE(range_of_a_brick_bounds_what_it_can_interpolate) {
  Device device;
  const MixedVolume v = many_tiles();
  const ResidentVolume resident(device, v);
  const auto& ranges = resident.impl().host_ranges;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  const Index3 bricks = v.bricks();
  // Three nested lerps leave the range by 14 u of the largest value at most (docs/error-bounds.md).
  const double slack = 14 * 0x1p-24 * 8;
  for (int i = 0; i < 20000; ++i) {
    Index3 b{};
    Vec3 p{};
    for (std::size_t a = 0; a < 3; ++a) {
      const double c = uniform(random) * static_cast<double>(v.grid.cells[a]);
      b[a] = std::min(static_cast<std::int64_t>(static_cast<float>(c)) / v.granularity, bricks[a] - 1);
      p[a] = v.grid.origin[a] + c * v.grid.spacing[a];
    }
    const auto& r = ranges[static_cast<std::size_t>((b[2] * bricks[1] + b[1]) * bricks[0] + b[0])];
    const double value = static_cast<double>(sample_at(v, p));
    BOOST_REQUIRE(value >= static_cast<double>(r.s[0]) - slack);
    BOOST_REQUIRE(value <= static_cast<double>(r.s[1]) + slack);
  }
}

BOOST_AUTO_TEST_CASE(distances_match_a_search_over_all_bricks) {
  const Index3 n{7, 5, 9};
  std::mt19937 random(11);
  // Few of class 0, one corner of another class than the rest.
  std::vector<std::uint8_t> classes(7 * 5 * 9);
  for (std::size_t i = 0; i < classes.size(); ++i)
    classes[i] = static_cast<std::uint8_t>(random() % 40 == 0 ? 0 : i > 250 && i % 7 > 2 ? 3 : 1);
  const auto d = distance_to_other(classes, n);
  const auto at = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
    return static_cast<std::size_t>((z * n[1] + y) * n[0] + x);
  };
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x) {
        const std::uint8_t own = classes[at(x, y, z)];
        std::int64_t nearest = own == 0 ? 0 : 255;
        for (std::int64_t w = 0; w < n[2]; ++w)
          for (std::int64_t v = 0; v < n[1]; ++v)
            for (std::int64_t u = 0; u < n[0]; ++u)
              if (classes[at(u, v, w)] != own)
                nearest = std::min(nearest, std::max({std::abs(u - x), std::abs(v - y), std::abs(w - z)}));
        BOOST_TEST(d[at(x, y, z)] == nearest);
      }
}

BOOST_AUTO_TEST_CASE(memory_is_given_back) {
  Device device;
  const auto before = device.memory_left();
  {
    const ResidentVolume resident(device, many_tiles());
    BOOST_TEST(device.memory_left() < before);
    if (resident.has_image3d()) {
      const auto bytes = resident.bytes();
      resident.impl().atlas();
      BOOST_TEST(resident.bytes() > bytes);
    }
  }
  BOOST_TEST(device.memory_left() == before);
}

BOOST_AUTO_TEST_CASE(places_count_samples_and_not_bytes) {
  // Packets take numbers of 31 bits: a float32 volume of 2 GB still has them.
  const MixedVolume v = many_tiles();
  std::uint64_t samples = v.base.size();
  for (const auto& [kind, block] : v.tiles) samples += block.size();
  BOOST_TEST(highest_place(v) == samples);
  BOOST_TEST(highest_place(support::in_types(v, {SampleType::u16})) >= samples);
  BOOST_TEST(highest_place(support::in_types(v, {SampleType::u16})) <= samples + 2 * (v.tiles.size() + 1));
  const MixedVolume mixed = support::in_types(v, {SampleType::f32, SampleType::u8});
  BOOST_TEST(highest_place(mixed) == sample_buffer_bytes(mixed));
}

BOOST_AUTO_TEST_CASE(lit_samples_beyond_31_bits_are_refused_before_memory_is_taken) {
  // Levels alone say where lit samples lie: 600,000 bricks of 17^3 samples are 2.9e9.
  MixedVolume v;
  v.grid = centred_grid({336, 336, 336});
  v.granularity = 4;
  v.rate = 4;
  const auto level_of = [&](std::uint8_t level) {
    v.level.assign(static_cast<std::size_t>(v.brick_count()), LevelTriple{level, level, level});
    v.tile.resize(v.level.size());
    return LitLayout(v);
  };
  const LitLayout coarse = level_of(1), fine = level_of(2);
  BOOST_TEST(coarse.is_addressable());
  BOOST_TEST(fine.samples() > 0x7fffffffu);
  BOOST_TEST(!fine.is_addressable());
}
