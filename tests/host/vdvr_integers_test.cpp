// Integer samples in .vdvr files, and the content hash over them and over floats.
#define BOOST_TEST_MODULE vdvr_integers
#include "tests/support/vdvr_files.hpp"

#include <limits>

#include "vdvr/expert/hash.hpp"

using namespace vdvr;
using namespace vdvr::support;

BOOST_AUTO_TEST_CASE(the_content_hash_is_over_the_documented_bytes) {
  const MixedVolume v = small_volume();
  std::string bytes;
  const auto add = [&bytes](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  for (const std::int64_t n : {7, 5, 9}) add(n);
  for (const double o : {1e-7, 0.1, -4.5}) add(o);
  for (const double s : {0.7071067811865476, 0.5, 1.0}) add(s);
  bytes += "mm";
  for (const std::int64_t n : {4, 8}) add(n);
  for (const float s : v.base.f32) add(s);
  for (const LevelTriple& l : v.level)
    for (const std::uint8_t n : l) add(n);
  for (const std::uint32_t t : v.tile) add(t);
  for (const LevelTriple& l : {LevelTriple{0, 2, 1}, LevelTriple{1, 1, 1}, LevelTriple{2, 2, 2}})
    for (const float s : v.tiles.at(l).f32) add(s);
  BOOST_TEST(content_sha256(v) == sha256_of_text(bytes));
}

BOOST_AUTO_TEST_CASE(the_content_hash_sees_every_part) {
  const MixedVolume v = small_volume();
  const std::vector<std::function<void(MixedVolume&)>> changes{
      [](MixedVolume& m) { m.grid.origin[1] = std::nextafter(m.grid.origin[1], 1.0); },
      [](MixedVolume& m) { m.grid.spacing[2] *= 2; },
      [](MixedVolume& m) { m.grid.unit = "mn"; },
      [](MixedVolume& m) { m.rate = 4; },
      [](MixedVolume& m) { m.base.f32.back() = -m.base.f32.back(); },
      [](MixedVolume& m) { m.level[3][1] ^= 1; },
      [](MixedVolume& m) { m.tile[3] ^= 1; },
      [](MixedVolume& m) {
        m.tiles[{2, 2, 2}].f32.back() += 1;
      }};
  for (const auto& change : changes) {
    MixedVolume m = v;
    change(m);
    BOOST_TEST(content_sha256(m) != content_sha256(v));
  }
}

BOOST_AUTO_TEST_CASE(the_content_hash_of_integers_is_over_the_documented_bytes) {
  const MixedVolume v = support::in_types(support::random_mixed({{9, 5, 7}, {0, 1, 2}, {1, 1, 1}, "mm"}, 4, 8,
                                                                {{0, 0, 0}, {1, 1, 1}, {0, 2, 1}}, 5),
                                          {SampleType::u16, SampleType::u8});
  std::string bytes;
  const auto add = [&bytes](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  for (const std::int64_t n : {7, 5, 9}) add(n);
  for (const double o : {2.0, 1.0, 0.0}) add(o);
  for (const double s : {1.0, 1.0, 1.0}) add(s);
  bytes += "mm";
  for (const std::int64_t n : {4, 8}) add(n);
  add(v.step);
  for (const std::uint16_t s : v.base.u16) add(s);
  for (const LevelTriple& l : v.level)
    for (const std::uint8_t n : l) add(n);
  for (const std::uint32_t t : v.tile) add(t);
  const SampleBlock &a = v.tiles.at({0, 2, 1}), &b = v.tiles.at({1, 1, 1});
  for (const std::uint8_t s : a.u8) add(s);
  for (const std::uint16_t s : b.u16) add(s);
  add(std::int64_t{v.base.offset[0]});
  for (const SampleBlock* block : {&a, &b})
    for (const std::int32_t o : block->offset) add(o);
  add(std::int64_t{v.base.shift[0]});
  for (const SampleBlock* block : {&a, &b})
    for (const std::uint8_t s : block->shift) add(s);
  BOOST_TEST(content_sha256(v) == sha256_of_text(bytes));
}

BOOST_AUTO_TEST_CASE(integer_samples_without_their_lattice_are_refused) {
  BOOST_TEST(says(refusal_after(replace("/base", H5T_STD_U16LE, H5T_NATIVE_UINT16, {8, 6, 10},
                                        std::vector<std::uint16_t>(480))),
                  {"step", "missing"}));
  BOOST_TEST(says(refusal_after(replace("/tiles/111", H5T_STD_U8LE, H5T_NATIVE_UINT8, {2, 9, 9, 9},
                                        std::vector<std::uint8_t>(1458))),
                  {"/tiles/111_offset", "missing"}));
  BOOST_TEST(says(refusal_after(replace("/tiles/111_shift", H5T_STD_U8LE, H5T_NATIVE_UINT8, {1},
                                        std::vector<std::uint8_t>(1))),
                  {"/tiles/111", "no integer tiles"}));
  BOOST_TEST(says(refusal_after(set_attribute<double>("/", "step", H5T_NATIVE_DOUBLE, {0.5})),
                  {"step", "without integer samples"}));
}

BOOST_AUTO_TEST_CASE(volumes_of_every_type_come_back_and_files_without_integers_stay_version_1) {
  const Folder folder;
  using enum SampleType;
  for (const auto& types : {std::vector{f32}, std::vector{u16}, std::vector{u8}, std::vector{u8, f32, u16},
                            std::vector{f32, u8}}) {
    const MixedVolume v = support::in_types(support::random_mixed({{9, 5, 7}, {0, 1, 2}, {1, 1, 1}, "mm"}, 4,
                                                                  8, {{0, 0, 0}, {1, 1, 1}, {0, 2, 1}}, 5),
                                            types);
    const fs::path path = folder.path / "a.vdvr";
    write_vdvr(path, v, support::full_certificate());
    const VdvrFile file = read_vdvr(path);
    const bool integers = types != std::vector{f32};
    MixedVolume expected = v;
    if (!integers) expected.step = 0;
    BOOST_TEST(same_volume(file.volume, expected));
    BOOST_TEST(file.format_version == (integers ? 2 : 1));
    BOOST_TEST(content_sha256(file.volume) == content_sha256(v));
  }
}

BOOST_AUTO_TEST_CASE(tiles_of_one_triple_in_several_types_come_back_and_damaged_parts_are_refused) {
  const Folder folder;
  const fs::path path = folder.path / "a.vdvr";
  const MixedVolume v =
      support::in_types_by_tile(support::random_mixed({{9, 5, 27}, {0, 1, 2}, {1, 1, 1}, "mm"}, 4, 8,
                                                      {{0, 0, 0}, {1, 1, 1}, {0, 2, 1}}, 5),
                                {SampleType::u8, SampleType::f32, SampleType::u16});
  BOOST_REQUIRE(v.tiles.contains({LevelTriple{1, 1, 1}, 2}));
  write_vdvr(path, v, support::full_certificate());
  const VdvrFile file = read_vdvr(path);
  BOOST_TEST(file.format_version == 3);
  BOOST_TEST(same_volume(file.volume, v));
  BOOST_TEST(content_sha256(file.volume) == content_sha256(v));

  const auto refused = [&](const std::function<void(MixedVolume&)>& make, const char* where) {
    MixedVolume m = v;
    make(m);
    BOOST_CHECK_EXCEPTION(write_vdvr(path, m, support::full_certificate()), InputError,
                          [&](const InputError& e) { return says(e.what(), {where}); });
  };
  const TileKind second{LevelTriple{1, 1, 1}, 1}, third{LevelTriple{1, 1, 1}, 2};
  refused([&](MixedVolume& m) { m.tiles.erase(second); }, "/tiles/111_2");
  refused([&](MixedVolume& m) { m.tiles[third] = m.tiles[second]; }, "/tiles/111_2");
  refused([&](MixedVolume& m) { m.tiles[third].shift.pop_back(); }, "/tiles/111_2");

  const auto refused_file = [&](const Edit& edit) {
    write_vdvr(path, v, support::full_certificate());
    const hid_t opened = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    edit(opened);
    H5Fclose(opened);
    return refusal(path);
  };
  const auto rename = [](const char* from, const char* to) {
    return [from, to](hid_t f) { H5Lmove(f, from, f, to, H5P_DEFAULT, H5P_DEFAULT); };
  };
  BOOST_TEST(says(refused_file(rename("/tiles/111_1", "/tiles/111_3")), {"/tiles/111_3", "level triple"}));
  BOOST_TEST(says(refused_file(rename("/tiles/111_1", "/tiles/222_1")), {"/tiles/222_1"}));
  BOOST_TEST(says(refused_file(rename("/tiles/111_2_shift", "/tiles/111_1_shift")), {"/tiles/111_2_shift"}));
}

BOOST_AUTO_TEST_CASE(damaged_lattices_are_refused_with_the_dataset) {
  const Folder folder;
  const MixedVolume good = support::in_types(
      support::random_mixed({{9, 5, 7}, {0, 1, 2}, {1, 1, 1}, "mm"}, 4, 8, {{0, 0, 0}, {1, 1, 1}}, 5),
      {SampleType::u16, SampleType::u8});
  // What the writer refuses, the reader refuses by the same checks.
  struct Mistake {
    std::function<void(MixedVolume&)> make;
    const char* where;
  };
  const LevelTriple one{1, 1, 1};
  const std::vector<Mistake> mistakes{
      {[](MixedVolume& m) { m.step = 0.3; }, "step"},
      {[](MixedVolume& m) { m.step = 0; }, "step"},
      {[](MixedVolume& m) { m.step = -0.5; }, "step"},
      {[](MixedVolume& m) { m.step = 0x1p-127; }, "step"},
      {[](MixedVolume& m) { m.step = 0x1p104; }, "step"},
      {[](MixedVolume& m) { m.step = std::numeric_limits<double>::quiet_NaN(); }, "step"},
      {[](MixedVolume& m) { m.base.offset.clear(); }, "/base"},
      {[](MixedVolume& m) { m.base.shift[0] = 25; }, "/base"},
      {[](MixedVolume& m) { m.base.offset[0] = 1 << 24; }, "/base"},
      {[&](MixedVolume& m) { m.tiles[one].shift[0] = 25; }, "/tiles/111"},
      {[&](MixedVolume& m) { m.tiles[one].offset[0] += 1; }, "/tiles/111"},
      {[&](MixedVolume& m) { m.tiles[one].offset[0] = -(1 << 24); }, "/tiles/111"},
      {[&](MixedVolume& m) {
         m.tiles[one].shift[0] = 24;
         m.tiles[one].offset[0] = 0;
       },
       "/tiles/111"},
      {[&](MixedVolume& m) { m.tiles[one].offset.pop_back(); }, "/tiles/111"},
      {[&](MixedVolume& m) { m.tiles[one].shift.push_back(0); }, "/tiles/111"}};
  for (const Mistake& mistake : mistakes) {
    MixedVolume m = good;
    mistake.make(m);
    BOOST_CHECK_EXCEPTION(write_vdvr(folder.path / "a.vdvr", m, support::full_certificate()), InputError,
                          [&](const InputError& e) { return says(e.what(), {mistake.where}); });
  }
  const fs::path path = folder.path / "b.vdvr";
  const auto refused = [&](const Edit& edit) {
    write_vdvr(path, good, support::full_certificate());
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    edit(file);
    H5Fclose(file);
    return refusal(path);
  };
  const auto tiles = static_cast<hsize_t>(good.tiles.at(one).shift.size());
  BOOST_TEST(
      says(refused(set_attribute<double>("/", "step", H5T_NATIVE_DOUBLE, {0.3})), {"step", "power of two"}));
  BOOST_TEST(says(refused([](hid_t f) { H5Adelete(f, "step"); }), {"step", "missing"}));
  BOOST_TEST(says(refused(set_integer("/base", "shift", 25)), {"/base", "shift"}));
  BOOST_TEST(says(refused(set_integer("/base", "shift", -1)), {"/base", "shift"}));
  BOOST_TEST(says(refused(set_integer("/base", "offset", std::int64_t{1} << 40)), {"/base", "offset"}));
  BOOST_TEST(says(refused([](hid_t f) { H5Ldelete(f, "/tiles/111_shift", H5P_DEFAULT); }),
                  {"/tiles/111_shift", "missing"}));
  BOOST_TEST(says(refused(replace("/tiles/111_shift", H5T_STD_U8LE, H5T_NATIVE_UINT8, {tiles},
                                  std::vector<std::uint8_t>(tiles, 25))),
                  {"/tiles/111", "shift"}));
  BOOST_TEST(says(refused(replace("/tiles/111_offset", H5T_STD_U32LE, H5T_NATIVE_UINT32, {tiles},
                                  std::vector<std::uint32_t>(tiles))),
                  {"/tiles/111_offset", "int32"}));
  BOOST_TEST(says(refused(replace("/tiles/111_offset", H5T_STD_I32LE, H5T_NATIVE_INT32, {tiles},
                                  std::vector<std::int32_t>(tiles, 1))),
                  {"/tiles/111", "multiple"}));
}
