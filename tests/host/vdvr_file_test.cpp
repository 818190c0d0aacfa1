#define BOOST_TEST_MODULE vdvr_file
#include "tests/support/vdvr_files.hpp"

#include <sys/resource.h>

#include <bit>
#include <csignal>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "host/files/hdf5/hdf5_reader.hpp"
#include "host/files/hdf5/hdf5_writer.hpp"

using namespace vdvr;
using namespace vdvr::support;

// --- round trips ---

BOOST_AUTO_TEST_CASE(round_trip_keeps_every_bit) {
  const Folder folder;
  MixedVolume v = small_volume();
  v.base.f32[0] = -0.0f;
  v.base.f32[1] = std::numeric_limits<float>::denorm_min();
  v.base.f32[2] = -std::numeric_limits<float>::max();
  const Certificate c = support::full_certificate();
  write_vdvr(folder.path / "a.vdvr", v, c);
  const VdvrFile back = read_vdvr(folder.path / "a.vdvr");
  BOOST_TEST(same_volume(back.volume, v));
  BOOST_TEST(back.format_version == 1);
  BOOST_TEST(back.generator.starts_with("vdvr "));
  BOOST_TEST(back.file_bytes == fs::file_size(folder.path / "a.vdvr"));
  BOOST_TEST(back.certificate_json == to_json(back.certificate));
  BOOST_TEST(back.certificate.content_sha256 ==
             content_sha256(v));  // filled in where the caller left it empty
  BOOST_TEST(content_sha256(back.volume) == content_sha256(v));
}

BOOST_AUTO_TEST_CASE(a_base_coarser_than_the_grid_comes_back_and_is_part_of_the_hash) {
  const Folder folder;
  const Grid grid{{8, 6, 12}, {-4.5, 0.1, 1e-7}, {1, 0.5, 0.7071067811865476}, "mm"};
  const MixedVolume v = support::random_mixed(grid, 4, 8, support::triples, 12, {2, 1, 0});
  write_vdvr(folder.path / "a.vdvr", v, support::full_certificate());
  const VdvrFile back = read_vdvr(folder.path / "a.vdvr");
  BOOST_TEST(back.format_version == 4);
  BOOST_TEST(same_volume(back.volume, v));
  BOOST_TEST((back.volume.coarsening == v.coarsening));
  // A uniform column of samples may be of either grid: the hash tells them apart.
  MixedVolume coarse = support::empty_mixed({{4, 4, 4}, {0, 0, 0}, {1, 1, 1}, "mm"}, 4, 1, {{0, 0, 0}}, 1,
                                            {2, 0, 0}),
              other = coarse;
  other.coarsening = {0, 2, 0};
  BOOST_TEST(content_sha256(coarse) != content_sha256(other));
}

BOOST_AUTO_TEST_CASE(a_base_that_does_not_fit_its_grid_is_refused) {
  const Folder folder;
  const Grid grid{{8, 6, 12}, {0, 0, 0}, {1, 1, 1}, "mm"};
  const MixedVolume good = support::empty_mixed(grid, 4, 8, {{0, 0, 0}}, 1, {2, 1, 0});
  for (const LevelTriple& bad : {LevelTriple{3, 0, 0}, {0, 2, 0}, {0, 0, 200}}) {
    MixedVolume v = good;
    v.coarsening = bad;
    BOOST_CHECK_THROW(write_vdvr(folder.path / "b.vdvr", v, support::full_certificate()), InputError);
  }
  MixedVolume deep = good;
  deep.rate = 64;
  BOOST_CHECK_THROW(write_vdvr(folder.path / "b.vdvr", deep, support::full_certificate()), InputError);
  BOOST_TEST(!fs::exists(folder.path / "b.vdvr"));
}

BOOST_AUTO_TEST_CASE(a_given_content_hash_is_stored_as_given) {
  const Folder folder;
  Certificate c = support::full_certificate();
  c.content_sha256 = std::string(64, '7');
  write_vdvr(folder.path / "a.vdvr", small_volume(), c);
  c.sealed = true;
  const VdvrFile back = read_vdvr(folder.path / "a.vdvr", 0, Altered::report);
  BOOST_TEST(back.certificate_json == to_json(c));
  BOOST_TEST((back.seal == Seal::whole));
  BOOST_TEST(says(back.altered, {"does not match its hash"}));
  BOOST_CHECK_THROW(read_vdvr(folder.path / "a.vdvr"), MismatchError);
}

BOOST_AUTO_TEST_CASE(a_volume_for_comparison_carries_a_record_and_no_certificate) {
  const Folder folder;
  Certificate c = support::full_certificate();
  c.comparison = true;
  c.holds_buffer = false;
  c.holds_image3d = false;
  c.budget.arithmetic.value = 0.25;
  write_vdvr(folder.path / "a.vdvr", small_volume(), c);
  {
    const io::hdf5::Reader file(folder.path / "a.vdvr", io::hdf5::Links::hard);
    BOOST_TEST(file.has("/comparison"));
    BOOST_TEST(!file.has("/certificate"));
    BOOST_TEST(!file.has("/brick_total"));
  }
  const VdvrFile back = read_vdvr(folder.path / "a.vdvr");
  BOOST_TEST((back.seal == Seal::whole));
  BOOST_TEST(back.certificate.comparison);
  BOOST_TEST(!back.certificate.holds_buffer);
  BOOST_TEST(back.certificate.content_sha256 == content_sha256(small_volume()));
  BOOST_TEST(back.certificate_json.find("\"holds\"") == std::string::npos);
  BOOST_TEST(back.certificate_json.find("\"total\"") == std::string::npos);
  // What a certificate would say can still be told.
  BOOST_TEST(back.certificate.total_buffer ==
             c.measured_total + c.budget.arithmetic.value + c.budget.sampler.buffer.value);
}

BOOST_AUTO_TEST_CASE(a_certificate_in_the_place_of_a_record_is_refused) {
  BOOST_TEST(says(refusal_after([](hid_t file) {
                    H5Lmove(file, "/certificate", file, "/comparison", H5P_DEFAULT, H5P_DEFAULT);
                  }),
                  {"/comparison", "does not say"}));
}

BOOST_AUTO_TEST_CASE(a_comparison_of_an_earlier_version_opens) {
  // It said so in a certificate in which nothing holds.
  auto j = nlohmann::json::parse(to_json(support::full_certificate()));
  j["comparison"] = true;
  j["holds"] = {{"buffer", false}, {"image3d", false}};
  j["content_sha256"] = content_sha256(small_volume());
  BOOST_TEST(certificate_from_json(j.dump()).comparison);
  BOOST_TEST(refusal_after(set_certificate(j.dump())).find("/certificate") == std::string::npos);
  j.erase("comparison");
  j.erase("holds");
  BOOST_CHECK_THROW(certificate_from_json(j.dump()), FileError);
}

BOOST_AUTO_TEST_CASE(a_volume_of_many_chunks_and_the_finest_level_comes_back) {
  const Folder folder;
  const Grid grid{{130, 60, 65}, {0, 0, 0}, {1, 1, 1}, "pixel"};
  MixedVolume v = support::random_mixed(grid, 4, 64, {{0, 0, 0}}, 1);
  v.level[5] = {6, 0, 0};
  v.tiles[{6, 0, 0}].f32.assign(257 * 25, 0.5f);
  for (std::size_t i = 0; i < 900; ++i) {
    v.level[100 + i] = {1, 1, 1};
    v.tile[100 + i] = static_cast<std::uint32_t>(899 - i);
  }
  v.tiles[{1, 1, 1}].f32.assign(900 * 729, -0.25f);
  v.level[7] = {5, 5, 5};  // one tile of 129^3 samples: larger than a chunk by itself
  v.tiles[{5, 5, 5}].f32.assign(129 * 129 * 129, 3.0f);
  write_vdvr(folder.path / "a.vdvr", v, support::full_certificate());
  BOOST_TEST(same_volume(read_vdvr(folder.path / "a.vdvr").volume, v));
}

BOOST_AUTO_TEST_CASE(a_uniform_volume_and_a_single_cell_come_back) {
  const Folder folder;
  const MixedVolume v = as_mixed({Grid{{1, 1, 1}, {0, 0, 0}, {1, 1, 1}, ""}, std::vector<float>(8, 2.5f)}, 8);
  write_vdvr(folder.path / "a.vdvr", v, support::full_certificate());
  BOOST_TEST(same_volume(read_vdvr(folder.path / "a.vdvr").volume, v));
}

BOOST_AUTO_TEST_CASE(a_certificate_longer_than_an_object_header_comes_back) {
  const Folder folder;
  Certificate c = support::full_certificate();
  c.notes.assign(2000, "a note of forty characters, more or less");
  write_vdvr(folder.path / "a.vdvr", small_volume(), c);
  BOOST_TEST((read_vdvr(folder.path / "a.vdvr").certificate.notes == c.notes));
}

BOOST_AUTO_TEST_CASE(equal_contents_give_equal_bytes) {
  const Folder folder;
  const fs::path a = write_small(folder, "a.vdvr"), b = write_small(folder, "b.vdvr");
  BOOST_TEST(bytes_of(a) == bytes_of(b));
}

BOOST_AUTO_TEST_CASE(only_vdvr_files_are_recognised) {
  const Folder folder;
  const fs::path path = write_small(folder);
  BOOST_TEST(is_vdvr(path));
  BOOST_TEST(!is_vdvr(folder.path));
  BOOST_TEST(!is_vdvr(folder.path / "absent.vdvr"));
  put(folder.path / "text.vdvr", "no HDF5 at all");
  BOOST_TEST(!is_vdvr(folder.path / "text.vdvr"));
  H5Fclose(H5Fcreate((folder.path / "other.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
  BOOST_TEST(!is_vdvr(folder.path / "other.h5"));
  BOOST_TEST(says(refusal(folder.path / "other.h5"), {"other.h5", "'format'"}));
}

BOOST_AUTO_TEST_CASE(chunks_are_contiguous_and_hardly_padded) {
  using io::hdf5::chunk_shape;
  using io::hdf5::Shape;
  BOOST_TEST((chunk_shape({65, 65, 65}, 4) == Shape{22, 65, 65}));  // 31 planes would fit: 65 = 22 + 22 + 21
  BOOST_TEST((chunk_shape({7, 1025, 1025}, 4) == Shape{1, 114, 1025}));  // 127 rows would fit: 9 parts
  BOOST_TEST((chunk_shape({900, 9, 9, 9}, 4) == Shape{150, 9, 9, 9}));   // 179 tiles would fit: 6 parts
  BOOST_TEST((chunk_shape({2, 3}, 1) == Shape{2, 3}));
  BOOST_TEST((chunk_shape({1}, 70'000'000) == Shape{1}));
}

// --- damage ---

BOOST_AUTO_TEST_CASE(a_truncated_file_is_rejected_at_every_length) {
  const Folder folder;
  const std::string whole = bytes_of(write_small(folder));
  const fs::path cut = folder.path / "cut.vdvr";
  BOOST_TEST(whole.size() > 10000u);
  for (std::size_t length = 0; length < whole.size();
       length += length < 128 || length + 64 > whole.size() ? 1 : 61) {
    put(cut, whole.substr(0, length));
    BOOST_TEST(says(refusal(cut), {"cut.vdvr"}), "length " << length);
  }
}

BOOST_AUTO_TEST_CASE(a_flipped_bit_anywhere_is_rejected_or_changes_nothing_certified) {
  const Folder folder;
  const std::string whole = bytes_of(write_small(folder));
  const VdvrFile original = read_vdvr(folder.path / "small.vdvr");
  const fs::path flipped = folder.path / "flipped.vdvr";
  std::size_t rejected = 0, harmless = 0, wrong = 0;
  for (std::size_t at = 0; at < whole.size(); at += 7) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << (at % 8)));
    put(flipped, bytes);
    try {
      const VdvrFile read = read_vdvr(flipped, 0, Altered::report);
      // What is left: HDF5's padding, and the texts of attributes (generator, unit).
      const bool same =
          same_volume(read.volume, original.volume) && read.certificate_json == original.certificate_json;
      const bool all_same = same && read.generator == original.generator;
      if (!all_same && read.altered.empty()) ++wrong;
      ++harmless;
    } catch (const FileError&) {
      ++rejected;
    }
  }
  BOOST_TEST_MESSAGE(rejected << " rejected, " << harmless << " harmless");
  BOOST_TEST(wrong == 0u);
  BOOST_TEST(rejected > harmless);
}

BOOST_AUTO_TEST_CASE(a_flipped_bit_in_a_dataset_is_reported_with_its_name) {
  const Folder folder;
  const fs::path path = write_small(folder);
  const std::string whole = bytes_of(path);
  for (const char* name : {"/base", "/level", "/tile", "/tiles/111", "/tiles/021", "/tiles/222"}) {
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    const hid_t dataset = H5Dopen2(file, name, H5P_DEFAULT);
    hsize_t count = 0, bytes = 0, offset[5] = {};
    unsigned mask = 0;
    haddr_t address = 0;
    const hid_t space = H5Dget_space(dataset);
    BOOST_REQUIRE(H5Dget_num_chunks(dataset, space, &count) >= 0);
    BOOST_REQUIRE(H5Dget_chunk_info(dataset, space, count - 1, offset, &mask, &address, &bytes) >= 0);
    H5Sclose(space);
    H5Dclose(dataset);
    H5Fclose(file);
    for (const hsize_t at : {hsize_t{0}, bytes / 2, bytes - 1}) {
      std::string damaged = whole;
      damaged[address + at] = static_cast<char>(damaged[address + at] ^ 4);
      put(folder.path / "flipped.vdvr", damaged);
      BOOST_TEST(says(refusal(folder.path / "flipped.vdvr"), {"flipped.vdvr", name, "Fletcher32"}),
                 name << " byte " << at);
    }
  }
}

BOOST_AUTO_TEST_CASE(a_flipped_bit_in_the_certificate_is_reported_with_its_name) {
  const Folder folder;
  std::string bytes = bytes_of(write_small(folder));
  const std::size_t at = bytes.find("\"reference_range\": 1.126");
  BOOST_REQUIRE(at != std::string::npos);
  bytes[at + 19] ^= 2;  // 1 becomes 3: still JSON
  put(folder.path / "flipped.vdvr", bytes);
  BOOST_TEST(says(refusal(folder.path / "flipped.vdvr"), {"/certificate", "checksum"}));
}

BOOST_AUTO_TEST_CASE(what_is_no_file_is_rejected) {
  const Folder folder;
  BOOST_TEST(says(refusal(folder.path / "absent.vdvr"), {"absent.vdvr", "no such file"}));
  BOOST_TEST(says(refusal(folder.path), {"no such file"}));
  put(folder.path / "empty.vdvr", "");
  BOOST_TEST(says(refusal(folder.path / "empty.vdvr"), {"empty"}));
  put(folder.path / "text.vdvr", std::string(5000, 'x'));
  BOOST_TEST(says(refusal(folder.path / "text.vdvr"), {"text.vdvr", "HDF5"}));
}

// --- crafted files ---

BOOST_AUTO_TEST_CASE(a_newer_or_invalid_format_version_is_refused) {
  BOOST_TEST(says(refusal_after(set_integer("/", "format_version", 5)), {"format_version", "5", "newer"}));
  BOOST_TEST(says(refusal_after(set_integer("/", "format_version", 0)), {"format_version"}));
  BOOST_TEST(says(refusal_after(set_attribute<double>("/", "format_version", H5T_NATIVE_DOUBLE, {1.0})),
                  {"format_version", "integer"}));
}

BOOST_AUTO_TEST_CASE(geometry_that_is_not_finite_or_not_positive_is_refused) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, inf, 0.0, -1.0})
    BOOST_TEST(says(refusal_after(set_spacing(1, bad, 1)), {"/grid", "spacing along y"}));
  BOOST_TEST(says(refusal_after(set_attribute<double>("/grid", "origin", H5T_NATIVE_DOUBLE, {0, 0, nan})),
                  {"/grid", "origin along x"}));
}

BOOST_AUTO_TEST_CASE(cells_that_do_not_fit_are_refused_before_anything_is_allocated) {
  const std::int64_t huge = std::numeric_limits<std::int64_t>::max();
  BOOST_TEST(says(refusal_after(set_cells(huge, huge, huge)), {"/grid", "cells along"}));
  BOOST_TEST(says(refusal_after(set_cells(0, 5, 9)), {"/grid", "0 cells along z"}));
  BOOST_TEST(says(refusal_after(set_cells(-7, 5, 9)), {"/grid", "-7 cells"}));
  BOOST_TEST(says(refusal_after(set_cells(1 << 24, 1 << 24, 1 << 24)), {"/grid", "plane"}));
  BOOST_TEST(says(refusal_after(set_cells(1 << 24, 60000, 60000)), {"/base", "shape"}));
  BOOST_TEST(says(refusal_after(set_cells(9, 5, 7)), {"/base", "shape", "[8, 6, 10]", "[10, 6, 8]"}));
  BOOST_TEST(says(refusal_after(set_attribute<std::int64_t>("/grid", "cells", H5T_NATIVE_INT64, {7, 5})),
                  {"cells", "expected 3"}));
  BOOST_TEST(says(refusal_after(set_attribute<double>("/grid", "cells", H5T_NATIVE_DOUBLE, {7, 5, 9})),
                  {"cells", "integer"}));
}

BOOST_AUTO_TEST_CASE(a_sparse_dataset_that_declares_terabytes_is_refused) {
  const auto sparse = replace<float>("/base", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, {10001, 10001, 10001}, {});
  BOOST_TEST(says(refusal_after([&](hid_t file) {
                    set_cells(10000, 10000, 10000)(file);
                    sparse(file);
                  }),
                  {"/base", "stored"}));
  BOOST_TEST(says(refusal_after(replace<float>("/base", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, {8, 6, 10}, {})),
                  {"/base", "incomplete"}));
}

BOOST_AUTO_TEST_CASE(granularity_and_rate_outside_the_format_are_refused) {
  for (const std::int64_t bad :
       {std::int64_t{0}, std::int64_t{3}, std::int64_t{16}, std::int64_t{-4}, std::int64_t{1} << 40})
    BOOST_TEST(says(refusal_after(set_integer("/grid", "granularity", bad)), {"/grid", "granularity"}));
  for (const std::int64_t bad :
       {std::int64_t{0}, std::int64_t{3}, std::int64_t{128}, (std::int64_t{1} << 32) + 8})
    BOOST_TEST(says(refusal_after(set_integer("/grid", "rate", bad)), {"/grid", "rate"}));
  BOOST_TEST(says(refusal_after(set_integer("/grid", "rate", 2)), {"/tiles/", "rate 2"}));
}

BOOST_AUTO_TEST_CASE(datasets_of_the_wrong_type_or_rank_are_refused) {
  const std::vector<float> samples(480, 1.0f);
  BOOST_TEST(says(refusal_after(replace("/base", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, {480}, samples)),
                  {"/base", "shape"}));
  BOOST_TEST(says(refusal_after(replace("/base", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, {8, 6, 10, 1}, samples)),
                  {"/base", "shape"}));
  BOOST_TEST(says(refusal_after(replace("/base", H5T_IEEE_F64LE, H5T_NATIVE_FLOAT, {8, 6, 10}, samples)),
                  {"/base", "8-byte float"}));
  BOOST_TEST(says(refusal_after(replace("/base", H5T_IEEE_F32BE, H5T_NATIVE_FLOAT, {8, 6, 10}, samples)),
                  {"/base", "little-endian"}));
  BOOST_TEST(says(refusal_after(replace("/base", H5T_STD_U32LE, H5T_NATIVE_FLOAT, {8, 6, 10}, samples)),
                  {"/base", "float32"}));
  BOOST_TEST(says(refusal_after(replace("/tile", H5T_STD_I32LE, H5T_NATIVE_INT32, {2, 2, 3},
                                        std::vector<std::int32_t>(12))),
                  {"/tile"}));
  BOOST_TEST(says(refusal_after(replace("/level", H5T_STD_U8LE, H5T_NATIVE_UINT8, {2, 2, 3},
                                        std::vector<std::uint8_t>(12))),
                  {"/level", "shape"}));
  BOOST_TEST(says(refusal_after([](hid_t file) {
                    H5Ldelete(file, "/base", H5P_DEFAULT);
                    H5Gclose(H5Gcreate2(file, "/base", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
                  }),
                  {"/base", "not a dataset"}));
  BOOST_TEST(
      says(refusal_after([](hid_t file) { H5Ldelete(file, "/tile", H5P_DEFAULT); }), {"/tile", "missing"}));
  BOOST_TEST(
      says(refusal_after([](hid_t file) { H5Ldelete(file, "/grid", H5P_DEFAULT); }), {"/grid", "missing"}));
}

BOOST_AUTO_TEST_CASE(an_index_that_does_not_match_the_tiles_is_refused) {
  const MixedVolume v = small_volume();
  BOOST_REQUIRE(v.tiles.at({1, 1, 1}).size() >= 2 * 729u);
  const std::size_t refined = brick_with(v, {1, 1, 1}, 0), plain = brick_with(v, {0, 0, 0}, 0);
  auto tile = v.tile;
  tile[refined] = 1000000;
  BOOST_TEST(
      says(refusal_after(overwrite("/tile", H5T_NATIVE_UINT32, tile)), {"/tile", "1000000", "/tiles/111"}));
  tile[refined] = 1;  // another brick's
  BOOST_TEST(says(refusal_after(overwrite("/tile", H5T_NATIVE_UINT32, tile)), {"/tile", "another brick"}));
  tile = v.tile;
  tile[plain] = 1;
  BOOST_TEST(says(refusal_after(overwrite("/tile", H5T_NATIVE_UINT32, tile)), {"/tile", "expected 0"}));
  const auto with_level = [&](std::size_t brick, const LevelTriple& l) {
    MixedVolume m = v;
    m.level[brick] = l;
    return refusal_after(overwrite("/level", H5T_NATIVE_UINT8, levels_of(m)));
  };
  BOOST_TEST(says(with_level(refined, {4, 0, 0}), {"/level", "4, 0, 0", "rate 8"}));
  BOOST_TEST(says(with_level(refined, {255, 1, 1}), {"/level", "255"}));
  BOOST_TEST(says(with_level(refined, {1, 0, 1}), {"/level", "no /tiles/101"}));
  BOOST_TEST(says(with_level(plain, {1, 1, 1}), {"/tile", "another brick"}));
}

BOOST_AUTO_TEST_CASE(tiles_of_the_wrong_shape_number_or_name_are_refused) {
  const auto tiles = [](const char* name, std::vector<hsize_t> shape) {
    std::size_t count = 1;
    for (const hsize_t n : shape) count *= n;
    return refusal_after(
        replace(name, H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, shape, std::vector<float>(count, 1.0f)));
  };
  const auto count = small_volume().tiles.at({1, 1, 1}).size() / 729;
  BOOST_TEST(says(tiles("/tiles/111", {count, 9, 9, 8}), {"/tiles/111", "[count, 9, 9, 9]"}));
  BOOST_TEST(says(tiles("/tiles/111", {count + 1, 9, 9, 9}), {"/tiles/111", "no brick has tile"}));
  BOOST_TEST(says(tiles("/tiles/111", {40, 9, 9, 9}), {"/tiles/111", "40 tiles for 12 bricks"}));
  BOOST_TEST(says(tiles("/tiles/112", {1, 9, 9, 17}), {"/tiles/112", "no brick"}));
  BOOST_TEST(says(tiles("/tiles/400", {1, 65, 5, 5}), {"/tiles/400", "rate 8"}));
  for (const char* name : {"/tiles/000", "/tiles/7", "/tiles/1111", "/tiles/11x", "/tiles/911"})
    BOOST_TEST(says(tiles(name, {1, 5, 5, 5}), {name, "level triple"}));
}

BOOST_AUTO_TEST_CASE(samples_that_are_not_finite_are_refused_with_their_place) {
  MixedVolume v = small_volume();
  v.base.f32[77] = std::numeric_limits<float>::quiet_NaN();
  const auto vector_of = [](const Samples<float>& s) { return std::vector<float>(s.begin(), s.end()); };
  BOOST_TEST(says(refusal_after(overwrite("/base", H5T_NATIVE_FLOAT, vector_of(v.base.f32))),
                  {"/base", "sample 77"}));
  auto tiles = vector_of(v.tiles.at({0, 2, 1}).f32);
  tiles[5] = -std::numeric_limits<float>::infinity();
  BOOST_TEST(
      says(refusal_after(overwrite("/tiles/021", H5T_NATIVE_FLOAT, tiles)), {"/tiles/021", "sample 5"}));
}

BOOST_AUTO_TEST_CASE(links_that_lead_elsewhere_are_refused) {
  BOOST_TEST(says(refusal_after([](hid_t file) {
                    H5Lmove(file, "/base", file, "/elsewhere", H5P_DEFAULT, H5P_DEFAULT);
                    H5Lcreate_soft("/elsewhere", file, "/base", H5P_DEFAULT, H5P_DEFAULT);
                  }),
                  {"/base", "soft or external link"}));
  for (const char* name : {"/base", "/grid", "/tiles", "/certificate"})
    BOOST_TEST(says(refusal_after([name](hid_t file) {
                      H5Ldelete(file, name, H5P_DEFAULT);
                      H5Lcreate_external("other.vdvr", name, file, name, H5P_DEFAULT, H5P_DEFAULT);
                    }),
                    {name, "soft or external link"}));
}

BOOST_AUTO_TEST_CASE(datasets_without_the_checksum_or_with_other_filters_are_refused) {
  const std::vector<float> samples(480, 1.0f);
  const auto with = [&](Protection p) {
    return refusal_after(replace("/base", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, {8, 6, 10}, samples, p));
  };
  BOOST_TEST(says(with(Protection::none), {"/base", "Fletcher32"}));
  BOOST_TEST(says(with(Protection::checksum_first), {"/base", "Fletcher32, deflate", "h5repack"}));
  BOOST_TEST(with(Protection::fletcher32) == "accepted");  // other chunks than ours are read
  BOOST_TEST(with(Protection::deflate) == "accepted");
}

BOOST_AUTO_TEST_CASE(a_missing_or_broken_certificate_is_refused) {
  BOOST_TEST(says(refusal_after([](hid_t file) { H5Ldelete(file, "/certificate", H5P_DEFAULT); }),
                  {"/certificate", "missing"}));
  BOOST_TEST(says(refusal_after(set_certificate("{\"epsilon\": 0.03")), {"/certificate", "JSON"}));
  BOOST_TEST(says(refusal_after(set_certificate("{\"epsilon\": 0.03}")),
                  {"/certificate", "'epsilon_abs' is missing"}));
  BOOST_TEST(says(refusal_after(replace("/certificate", H5T_STD_U8LE, H5T_NATIVE_UINT8, {4},
                                        std::vector<std::uint8_t>(4))),
                  {"/certificate", "not a string"}));
  BOOST_TEST(says(refusal_after([](hid_t file) {
                    H5Lcopy(file, "/certificate", file, "/comparison", H5P_DEFAULT, H5P_DEFAULT);
                  }),
                  {"/comparison", "beside a certificate"}));
  // Rewritten by h5py, say: readable; whether it is true is for verify to find.
  BOOST_TEST(refusal_after(set_certificate(to_json(support::full_certificate()))) == "accepted");
}

// --- limits and writing ---

BOOST_AUTO_TEST_CASE(reading_honours_the_memory_limit) {
  const Folder folder;
  const fs::path path = write_small(folder);
  BOOST_CHECK_EXCEPTION(read_vdvr(path, 1000), ResourceError, [](const ResourceError& e) {
    return says(e.what(), {"small.vdvr", "1000", "`max_memory`"});
  });
  BOOST_TEST(same_volume(read_vdvr(path, 1 << 20).volume, small_volume()));
}

BOOST_AUTO_TEST_CASE(a_volume_the_reader_would_refuse_is_not_written) {
  const Folder folder;
  const std::vector<std::function<void(MixedVolume&)>> mistakes{
      [](MixedVolume& m) { m.base.f32.pop_back(); },
      [](MixedVolume& m) { m.level.pop_back(); },
      [](MixedVolume& m) { m.tile.push_back(0); },
      [](MixedVolume& m) {
        m.tiles[{1, 1, 1}].f32.pop_back();
      },
      [](MixedVolume& m) {
        m.tiles.erase({1, 1, 1});
      },
      [](MixedVolume& m) {
        m.tiles[{0, 0, 0}].f32.assign(125, 0.0f);
      },
      [](MixedVolume& m) {
        m.tiles[{9, 0, 0}].f32.assign(125, 0.0f);
      },
      [](MixedVolume& m) { m.grid.spacing[0] = std::numeric_limits<double>::quiet_NaN(); },
      [](MixedVolume& m) { m.grid.unit = std::string("m\0m", 3); },
      [](MixedVolume& m) { m.grid.unit = "\xb5m"; },  // Latin-1
      [](MixedVolume& m) { m.rate = 6; },
      [](MixedVolume& m) { m.base.f32[3] = std::numeric_limits<float>::infinity(); }};
  for (std::size_t i = 0; i < mistakes.size(); ++i) {
    MixedVolume m = small_volume();
    mistakes[i](m);
    BOOST_CHECK_THROW(write_vdvr(folder.path / "a.vdvr", m, support::full_certificate()), InputError);
    BOOST_TEST(fs::is_empty(folder.path), "mistake " << i);
  }
  Certificate c = support::full_certificate();
  c.measured_max = std::numeric_limits<double>::quiet_NaN();
  BOOST_CHECK_THROW(write_vdvr(folder.path / "a.vdvr", small_volume(), c), InputError);
  BOOST_TEST(fs::is_empty(folder.path));
}

BOOST_AUTO_TEST_CASE(a_write_that_fails_leaves_the_old_file_and_nothing_else) {
  const Folder folder;
  const fs::path path = write_small(folder);
  const std::string before = bytes_of(path);
  MixedVolume large =
      as_mixed({Grid{{100, 100, 100}, {0, 0, 0}, {1, 1, 1}, ""}, std::vector<float>(101 * 101 * 101)}, 4);
  std::mt19937 random(1);  // zeros would deflate to less than the limit
  for (float& sample : large.base.f32) sample = static_cast<float>(random());
  std::signal(SIGXFSZ, SIG_IGN);  // the limit then shows as a failing write, as a full disk does
  rlimit old{};
  getrlimit(RLIMIT_FSIZE, &old);
  const rlimit small{1 << 20, old.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  BOOST_CHECK_THROW(write_vdvr(path, large, support::full_certificate()), ResourceError);
  setrlimit(RLIMIT_FSIZE, &old);
  BOOST_TEST(bytes_of(path) == before);
  BOOST_TEST(std::distance(fs::directory_iterator(folder.path), {}) == 1);
  write_vdvr(path, large, support::full_certificate());
  BOOST_TEST(same_volume(read_vdvr(path).volume, large));
}

BOOST_AUTO_TEST_CASE(a_folder_that_does_not_exist_is_named) {
  const Folder folder;
  BOOST_CHECK_EXCEPTION(
      write_vdvr(folder.path / "no" / "a.vdvr", small_volume(), support::full_certificate()), FileError,
      [](const FileError& e) { return says(e.what(), {"does not exist"}); });
}
