#define BOOST_TEST_MODULE lazy_volume
#include "tests/support/vdvr_files.hpp"

#include "vdvr/expert/certified_points.hpp"
#include "vdvr/expert/lazy_volume.hpp"

using namespace vdvr;
using namespace vdvr::support;

namespace {

/// Tiles of some MiB a triple, so that each lies in several of the file's chunks.
MixedVolume many_tiles() {
  const Grid grid{{40, 36, 120}, {-4.5, 0.1, 2}, {1, 0.5, 0.7}, "mm"};
  return random_mixed(grid, 4, 8, triples, 21);
}

std::vector<float> eager(const MixedVolume& v, const Lattice& lattice) {
  std::vector<float> out(static_cast<std::size_t>(lattice.size()));
  values_on(v, lattice, out);
  return out;
}

std::vector<float> lazy(LazyVolume& v, const Lattice& lattice) {
  std::vector<float> out(static_cast<std::size_t>(lattice.size()));
  v.values_on(lattice, out);
  return out;
}

/// Lattices of parts: of the grid, finer, of a spacing that is no power of two, planes on faces of bricks.
std::vector<Lattice> parts_of(const Grid& g) {
  const auto box = [&](double lo, double hi) {
    std::array<double, 6> b{};
    for (std::size_t a = 0; a < 3; ++a) {
      const double length = static_cast<double>(g.cells[a]) * g.spacing[a];
      b[a] = g.origin[a] + lo * length;
      b[a + 3] = g.origin[a] + hi * length;
    }
    return b;
  };
  const Vec3 half{g.spacing[0] / 2, g.spacing[1] / 2, g.spacing[2] / 2}, odd{0.31, 0.27, 0.43};
  std::vector<Lattice> all{lattice_in(g, {}, box(0.4, 0.6)), lattice_in(g, half, box(0.9, 1)),
                           lattice_in(g, odd, box(0, 0.2)), lattice_in(g, {}, {})};
  for (const std::int64_t plane : {std::int64_t{0}, std::int64_t{8}, std::int64_t{41}, g.cells[2]}) {
    Lattice slice = lattice_in(g, {}, {});
    slice.first[2] = plane;
    slice.count[2] = 1;
    all.push_back(slice);
  }
  return all;
}

}  // namespace

BOOST_AUTO_TEST_CASE(parts_are_those_of_the_whole_to_the_bit) {
  const Folder folder;
  const std::vector<SampleType> all_types{SampleType::f32, SampleType::u16, SampleType::u8};
  const Grid coarse_grid{{16, 24, 40}, {-4.5, 0.1, 2}, {1, 0.5, 0.7}, "mm"};
  for (const MixedVolume& v : {many_tiles(), in_types_by_tile(many_tiles(), all_types), small_volume(),
                               random_mixed(coarse_grid, 4, 8, triples, 5, {2, 1, 0})}) {
    write_vdvr(folder.path / "a.vdvr", v, full_certificate());
    for (const Lattice& part : parts_of(v.grid)) {
      LazyVolume fresh(folder.path / "a.vdvr");
      BOOST_TEST(fresh.bytes_read() == 0u);
      BOOST_TEST(same_bits(lazy(fresh, part), eager(v, part)));
    }
    LazyVolume one(folder.path / "a.vdvr");
    for (const Lattice& part : parts_of(v.grid)) BOOST_TEST(same_bits(lazy(one, part), eager(v, part)));
    BOOST_TEST(one.bytes_read() == one.bytes_stored());
    fs::remove(folder.path / "a.vdvr");
  }
}

BOOST_AUTO_TEST_CASE(what_is_not_asked_for_is_not_read) {
  const Folder folder;
  MixedVolume v = many_tiles();
  // Tiles in the order of their bricks, as build writes them.
  std::map<LevelTriple, std::uint32_t> next;
  for (std::size_t b = 0; b < v.level.size(); ++b)
    v.tile[b] = v.level[b] == LevelTriple{} ? 0 : next[v.level[b]]++;
  write_vdvr(folder.path / "a.vdvr", v, full_certificate(), Compression::none);
  LazyVolume file(folder.path / "a.vdvr");
  Lattice slice = lattice_in(v.grid, {}, {});
  slice.first[2] = 60;
  slice.count[2] = 1;
  BOOST_TEST(same_bits(lazy(file, slice), eager(v, slice)));
  const std::uint64_t once = file.bytes_read();
  // A layer of bricks is a 30th; a layer that lies in two chunks of each of four arrays brings what else they
  // hold.
  constexpr std::uint64_t chunk = 512 * 1024;
  BOOST_TEST(once <= file.bytes_stored() / 30 + 2 * 4 * chunk);
  BOOST_TEST(once < file.bytes_stored() / 3);
  BOOST_TEST(same_bits(lazy(file, slice), eager(v, slice)));
  BOOST_TEST(file.bytes_read() == once);
  LazyVolume small(folder.path / "a.vdvr", 1 << 20);
  BOOST_CHECK_THROW(lazy(small, lattice_in(v.grid, {}, {})), ResourceError);
}

BOOST_AUTO_TEST_CASE(damage_is_refused_where_it_is_read_and_nowhere_else) {
  const Folder folder;
  const fs::path path = folder.path / "a.vdvr";
  const MixedVolume v = many_tiles();
  write_vdvr(path, v, full_certificate(), Compression::none);
  // A sample of the last tile of the finest triple, found by its bits.
  const float* const last = v.tiles.at(TileKind(2, 2, 2)).f32.end() - 1;
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  std::string bytes(fs::file_size(path), '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  const std::size_t at = bytes.rfind(std::string(reinterpret_cast<const char*>(last - 1), 8));
  BOOST_REQUIRE(at != std::string::npos);
  file.seekp(static_cast<std::streamoff>(at));
  file.put(static_cast<char>(bytes[at] ^ 1));
  file.close();
  std::size_t fine = 0;
  LazyVolume opened(path);
  for (std::int64_t plane = 0; plane <= v.grid.cells[2]; plane += 4) {
    Lattice slice = lattice_in(v.grid, {}, {});
    slice.first[2] = plane;
    slice.count[2] = 1;
    slice.count[1] = slice.count[0] = 4;
    try {
      fine += same_bits(lazy(opened, slice), eager(v, slice)) ? 1 : 0;
    } catch (const FileError& e) {
      BOOST_TEST(std::string(e.what()).find("Fletcher32") != std::string::npos);
    }
  }
  BOOST_TEST(fine > 0u);
  BOOST_CHECK_THROW(lazy(opened, lattice_in(v.grid, {}, {})), FileError);
}
