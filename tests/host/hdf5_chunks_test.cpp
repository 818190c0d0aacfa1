// What is stored of a chunk: packed by HDF5 and unpacked here, and what no honest program writes.
#define BOOST_TEST_MODULE hdf5_chunks
#include "host/files/hdf5/hdf5_chunks.hpp"

#include <zlib.h>

#include <limits>
#include <numeric>

#include "host/files/hdf5/hdf5_reader.hpp"
#include "tests/support/vdvr_files.hpp"

using namespace vdvr;
using namespace vdvr::support;
namespace h5 = vdvr::io::hdf5;

namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes deflated(const Bytes& content, int level = 6) {
  uLongf size = ::compressBound(content.size());
  Bytes stream(size);
  BOOST_REQUIRE(::compress2(stream.data(), &size, content.data(), content.size(), level) == Z_OK);
  stream.resize(size);
  return stream;
}

/// As it is stored: the content and its true checksum.
Bytes under_checksum(Bytes content) {
  const std::uint32_t sum = h5::fletcher32(content);
  for (int i = 0; i < 4; ++i) content.push_back(static_cast<std::uint8_t>(sum >> 8 * i));
  return content;
}

Bytes random_bytes(std::size_t count, unsigned seed, unsigned below = 256) {
  std::mt19937 random(seed);
  Bytes bytes(count);
  for (auto& b : bytes) b = static_cast<std::uint8_t>(random() % below);
  return bytes;
}

enum class Filter { fletcher32, deflate, shuffle, scale_offset };

/// A dataset /a of bytes-wide elements through HDF5's own filters; with `raw` its only or first chunk is
/// those bytes instead of `values`.
struct Crafted {
  std::vector<hsize_t> shape{480}, chunk{480};
  std::vector<Filter> filters{Filter::deflate, Filter::fletcher32};
  hid_t type = H5T_STD_U8LE;
  const void* values = nullptr;
  Bytes raw;
  std::uint32_t mask = 0;
  bool growing = false;  ///< without a largest extent, so that a chunk may be larger than the array
};

fs::path write(const Folder& folder, const Crafted& c) {
  const fs::path path = folder.path / "crafted.h5";
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110);
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access);
  const std::vector<hsize_t> largest(c.shape.size(), H5S_UNLIMITED);
  const hid_t space = H5Screate_simple(static_cast<int>(c.shape.size()), c.shape.data(),
                                       c.growing ? largest.data() : nullptr);
  const hid_t properties = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_chunk(properties, static_cast<int>(c.chunk.size()), c.chunk.data());
  H5Pset_fill_time(properties, H5D_FILL_TIME_NEVER);
  for (const Filter f : c.filters) {
    if (f == Filter::deflate) H5Pset_deflate(properties, 4);
    if (f == Filter::shuffle) H5Pset_shuffle(properties);
    if (f == Filter::fletcher32) H5Pset_fletcher32(properties);
    if (f == Filter::scale_offset) H5Pset_scaleoffset(properties, H5Z_SO_INT, 0);
  }
  const hid_t dataset = H5Dcreate2(file, "a", c.type, space, H5P_DEFAULT, properties, H5P_DEFAULT);
  BOOST_REQUIRE(dataset >= 0);
  const std::vector<hsize_t> first(c.shape.size(), 0);
  if (!c.raw.empty())
    BOOST_REQUIRE(H5Dwrite_chunk(dataset, H5P_DEFAULT, c.mask, first.data(), c.raw.size(), c.raw.data()) >=
                  0);
  else if (c.values != nullptr)
    BOOST_REQUIRE(H5Dwrite(dataset, c.type, H5S_ALL, H5S_ALL, H5P_DEFAULT, c.values) >= 0);
  H5Dclose(dataset);
  H5Pclose(properties);
  H5Sclose(space);
  H5Fclose(file);
  H5Pclose(access);
  return path;
}

/// The message of the refusal; "accepted" where there is none. `content` gets what was read.
std::string refusal_of(const Crafted& c, Bytes* content = nullptr) {
  const Folder folder;
  const h5::Reader file(write(folder, c), h5::Links::hard);
  try {
    const h5::Dataset d = file.dataset("/a");
    Bytes read(d.bytes);
    file.read(d, read.data());
    if (content != nullptr) *content = read;
  } catch (const FileError& e) {
    return e.what();
  }
  return "accepted";
}

Crafted stored_as(Bytes raw) {
  Crafted c;
  c.raw = std::move(raw);
  return c;
}

}  // namespace

BOOST_AUTO_TEST_CASE(the_checksum_is_that_of_hdf5) {
  const Folder folder;
  for (const std::size_t size : {1, 2, 3, 719, 720, 721, 1440, 131071, 131072, 131073, 300001})
    for (const unsigned kind : {0u, 1u, 2u}) {
      Bytes content = kind == 0 ? random_bytes(size, 7) : Bytes(size, kind == 1 ? 0 : 255);
      Crafted c;
      c.shape = c.chunk = {size};
      c.filters = {Filter::fletcher32};
      c.values = content.data();
      const fs::path path = write(folder, c);
      const h5::Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose),
          dataset(H5Dopen2(file.id(), "a", H5P_DEFAULT), H5Dclose);
      Bytes stored(size + h5::fletcher32_bytes);
      const hsize_t first = 0;
      std::uint32_t mask = 0;
      BOOST_REQUIRE(H5Dread_chunk(dataset.id(), H5P_DEFAULT, &first, &mask, stored.data()) >= 0);
      BOOST_TEST((under_checksum(content) == stored), size << " bytes of kind " << kind);
    }
}

BOOST_AUTO_TEST_CASE(what_hdf5_packs_comes_back_in_every_type_packing_and_chunk_shape) {
  struct Case {
    hid_t type;
    std::size_t bytes;
  };
  const std::vector<std::vector<hsize_t>> chunks{{7, 5, 9}, {3, 5, 9}, {1, 2, 9},
                                                 {7, 1, 1}, {4, 3, 4}, {1, 1, 1}};
  for (const Case& t : {Case{H5T_STD_U8LE, 1}, Case{H5T_STD_U16LE, 2}, Case{H5T_STD_I32LE, 4},
                        Case{H5T_STD_U32LE, 4}, Case{H5T_IEEE_F32LE, 4}})
    for (const auto& filters :
         {std::vector{Filter::fletcher32}, std::vector{Filter::deflate, Filter::fletcher32},
          std::vector{Filter::shuffle, Filter::deflate, Filter::fletcher32}})
      for (const auto& chunk : chunks) {
        const Bytes content = random_bytes(7 * 5 * 9 * t.bytes, 3, 64);
        Crafted c;
        c.shape = {7, 5, 9};
        c.chunk = chunk;
        c.filters = filters;
        c.type = t.type;
        c.values = content.data();
        Bytes back;
        BOOST_TEST(refusal_of(c, &back) == "accepted");
        BOOST_TEST((back == content), t.bytes << " bytes, " << filters.size() << " filters");
      }
}

BOOST_AUTO_TEST_CASE(other_filters_and_orders_are_refused_by_name) {
  const std::vector<std::int32_t> values(480, 7);
  const auto with = [&](std::vector<Filter> filters) {
    Crafted c;
    c.filters = std::move(filters);
    c.type = H5T_STD_I32LE;
    c.values = values.data();
    return refusal_of(c);
  };
  using enum Filter;
  BOOST_TEST(says(with({}), {"/a", "no Fletcher32"}));
  BOOST_TEST(says(with({deflate}), {"/a", "no Fletcher32"}));
  BOOST_TEST(says(with({fletcher32, deflate}), {"/a", "Fletcher32, deflate", "h5repack"}));
  BOOST_TEST(says(with({deflate, shuffle, fletcher32}), {"/a", "deflate, shuffle, Fletcher32"}));
  BOOST_TEST(says(with({shuffle, fletcher32}), {"/a", "shuffle, Fletcher32"}));
  BOOST_TEST(says(with({scale_offset, fletcher32}), {"/a", "scale-offset, Fletcher32"}));
  BOOST_TEST(says(with({deflate, deflate, fletcher32}), {"/a", "deflate, deflate"}));
}

BOOST_AUTO_TEST_CASE(a_chunk_that_inflates_to_more_or_less_than_its_shape_is_refused) {
  const Bytes content = random_bytes(480, 1, 16);
  BOOST_TEST(refusal_of(stored_as(under_checksum(deflated(content)))) == "accepted");
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{10}, std::size_t{479}, std::size_t{481}, std::size_t{100000}})
    BOOST_TEST(says(refusal_of(stored_as(under_checksum(deflated(Bytes(size))))),
                    {"/a", "chunk at [0]", "does not inflate to its 480 bytes"}),
               size);
  // 64 kibibytes of stream for 64 mebibytes of zeros: more than any chunk of 480 bytes takes, so it is not
  // even read.
  BOOST_TEST(says(refusal_of(stored_as(under_checksum(deflated(Bytes(std::size_t{1} << 26), 9)))),
                  {"/a", "chunk at [0] is", "480"}));
}

BOOST_AUTO_TEST_CASE(a_bomb_of_the_right_stored_length_is_stopped_at_the_end_of_its_chunk) {
  // 500 kB of zeros in less than 600 bytes; the chunk ends in the middle of them, and so does its memory.
  const Bytes stream = under_checksum(deflated(Bytes(500'000), 9));
  BOOST_REQUIRE(stream.size() < h5::most_stored(600));
  for (const bool shuffled : {false, true}) {
    Bytes chunk(600, 1);
    const auto problem = h5::unpack_chunk(stream, {true, shuffled}, 4, chunk);
    BOOST_REQUIRE(problem.has_value());
    BOOST_TEST(says(*problem, {"does not inflate to its 600 bytes"}));
  }
}

BOOST_AUTO_TEST_CASE(damaged_streams_are_refused_behind_a_true_checksum_and_without_one) {
  const Bytes stream = deflated(random_bytes(480, 1, 16));
  Bytes cut(stream.begin(), stream.end() - 1), longer = stream, garbage = random_bytes(100, 2), head = stream;
  longer.push_back(0);
  head[0] ^= 0x0f;
  for (const Bytes& bad : {cut, longer, garbage, head, Bytes(1, 0x78)})
    BOOST_TEST(says(refusal_of(stored_as(under_checksum(bad))), {"/a", "chunk at [0]", "damaged"}));
  Bytes flipped = under_checksum(stream);
  flipped[flipped.size() / 2] ^= 1;
  BOOST_TEST(says(refusal_of(stored_as(flipped)), {"/a", "Fletcher32"}));
  BOOST_TEST(says(refusal_of(stored_as(stream)), {"/a", "Fletcher32"}));
  BOOST_TEST(says(refusal_of(stored_as(Bytes(3))), {"/a", "chunk at [0] is 3 bytes"}));
}

BOOST_AUTO_TEST_CASE(whatever_a_stream_says_nothing_is_written_outside_its_chunk) {
  // Mutated streams with the right checksum, which a flipped bit in a file does not have. The sanitizers
  // watch.
  std::mt19937 random(5);
  const Bytes good = deflated(random_bytes(4000, 1, 16));
  std::size_t refused = 0;
  for (int i = 0; i < 3000; ++i) {
    Bytes bad = good;
    for (unsigned n = 1 + random() % 4; n > 0; --n)
      bad[random() % bad.size()] = static_cast<std::uint8_t>(random());
    if (random() % 3 == 0) bad.resize(random() % bad.size());
    Bytes chunk(4000);
    refused += h5::unpack_chunk(under_checksum(bad), {true, i % 2 == 0}, 4, chunk).has_value();
  }
  BOOST_TEST(refused > 2900u);
}

BOOST_AUTO_TEST_CASE(chunks_left_out_of_filters_missing_or_of_absurd_shape_are_refused) {
  const Bytes content = random_bytes(480, 1, 16), stream = under_checksum(deflated(content));
  for (const std::uint32_t mask : {1u, 2u, 3u, 4u}) {
    Crafted c = stored_as(mask == 1 ? under_checksum(content) : stream);
    c.mask = mask;
    BOOST_TEST(says(refusal_of(c), {"/a", "left out of filters"}));
  }
  Crafted sparse = stored_as(stream);
  sparse.shape = {960};
  BOOST_TEST(says(refusal_of(sparse), {"/a", "1 chunks are stored where its shape needs 2"}));
  Crafted empty;
  BOOST_TEST(says(refusal_of(empty), {"/a", "0 chunks are stored where its shape needs 1"}));
  Crafted huge = stored_as(stream);
  huge.shape = {std::uint64_t{1} << 40};
  huge.chunk = {std::uint64_t{1} << 31};
  huge.growing = true;
  BOOST_TEST(says(refusal_of(huge), {"/a", "1099511627776 bytes", "more than deflate can do"}));
  Crafted wide = stored_as(stream);
  wide.chunk = {std::uint64_t{1} << 31};
  wide.growing = true;
  BOOST_TEST(says(refusal_of(wide), {"/a", "larger than its shape"}));
  Crafted crumbs = stored_as(stream);
  crumbs.shape = {std::uint64_t{1} << 50};
  crumbs.chunk = {1};
  crumbs.growing = true;
  BOOST_TEST(says(refusal_of(crumbs), {"/a", "more than deflate can do"}));
}

BOOST_AUTO_TEST_CASE(types_whose_bytes_are_not_those_in_memory_are_refused) {
  const hid_t narrow = H5Tcopy(H5T_STD_U16LE);
  H5Tset_precision(narrow, 12);
  const std::vector<std::uint16_t> values(480, 5);
  Crafted c;
  c.values = values.data();
  for (const hid_t type : {narrow, H5T_STD_U16BE, H5T_STD_I16LE, H5T_IEEE_F32BE}) {
    c.type = type;
    c.values = nullptr;
    BOOST_TEST(says(refusal_of(c), {"/a", "little-endian"}));
  }
  H5Tclose(narrow);
}

// --- certified volumes ---

BOOST_AUTO_TEST_CASE(deflated_and_plain_files_hold_the_same_volume_of_every_type) {
  const Folder folder;
  using enum SampleType;
  const Grid grid{{9, 5, 27}, {0, 1, 2}, {1, 1, 1}, "mm"};
  MixedVolume random = support::random_mixed(grid, 4, 8, {{0, 0, 0}, {1, 1, 1}, {0, 2, 1}}, 5);
  for (auto& [kind, tiles] : random.tiles)  // noise to the last bit does not deflate
    for (float& sample : tiles.f32) sample = std::round(8 * sample) / 8;
  std::vector<MixedVolume> volumes{random, support::in_types(random, {u16}), support::in_types(random, {u8}),
                                   support::in_types(random, {u8, f32, u16}),
                                   support::in_types_by_tile(random, {u8, f32, u16})};
  Certificate c = support::full_certificate();
  c.brick_totals.assign(random.level.size(), 0.0f);
  for (const MixedVolume& v : volumes) {
    const fs::path a = folder.path / "a.vdvr", b = folder.path / "b.vdvr", plain = folder.path / "plain.vdvr";
    write_vdvr(a, v, c);
    write_vdvr(b, v, c, Compression::deflate);
    write_vdvr(plain, v, c, Compression::none);
    BOOST_TEST(bytes_of(a) == bytes_of(b));
    BOOST_TEST(fs::file_size(a) < fs::file_size(plain));
    const VdvrFile packed = read_vdvr(a), unpacked = read_vdvr(plain);
    BOOST_TEST(same_volume(packed.volume, unpacked.volume));
    BOOST_TEST(packed.certificate_json == unpacked.certificate_json);
    BOOST_TEST((packed.certificate.brick_totals == c.brick_totals));
    BOOST_TEST(packed.format_version == unpacked.format_version);
    BOOST_TEST(content_sha256(packed.volume) == packed.certificate.content_sha256);
  }
}

BOOST_AUTO_TEST_CASE(a_small_file_of_a_large_volume_is_refused_by_the_memory_limit) {
  const Folder folder;
  const fs::path path = folder.path / "zeros.vdvr";
  const MixedVolume zeros =
      as_mixed({Grid{{200, 200, 200}, {0, 0, 0}, {1, 1, 1}, ""}, std::vector<float>(201 * 201 * 201)}, 8);
  write_vdvr(path, zeros, support::full_certificate());
  BOOST_TEST(fs::file_size(path) < zeros.base.bytes() / 100);
  BOOST_CHECK_EXCEPTION(read_vdvr(path, 1 << 20), ResourceError, [](const ResourceError& e) {
    return says(e.what(), {"zeros.vdvr", "`max_memory`"});
  });
  BOOST_TEST(same_volume(read_vdvr(path, 64 << 20).volume, zeros));
}

BOOST_AUTO_TEST_CASE(a_certificate_in_deflated_or_short_chunks_is_refused) {
  const auto certificate = [](bool packed, std::size_t stored) {
    return refusal_after([=](hid_t file) {
      H5Ldelete(file, "/certificate", H5P_DEFAULT);
      const hid_t type = H5Tcopy(H5T_C_S1), properties = H5Pcreate(H5P_DATASET_CREATE);
      H5Tset_size(type, 4000);
      const hsize_t one = 1, first = 0;
      const hid_t space = H5Screate_simple(1, &one, nullptr);
      H5Pset_chunk(properties, 1, &one);
      if (packed) H5Pset_deflate(properties, 4);
      H5Pset_fletcher32(properties);
      const hid_t dataset =
          H5Dcreate2(file, "/certificate", type, space, H5P_DEFAULT, properties, H5P_DEFAULT);
      const Bytes content = under_checksum(packed ? deflated(Bytes(stored, ' ')) : Bytes(stored, ' '));
      BOOST_REQUIRE(H5Dwrite_chunk(dataset, H5P_DEFAULT, 0, &first, content.size(), content.data()) >= 0);
      H5Dclose(dataset);
      H5Sclose(space);
      H5Pclose(properties);
      H5Tclose(type);
    });
  };
  BOOST_TEST(says(certificate(false, 4000), {"/certificate", "JSON"}));  // read: an empty text
  BOOST_TEST(says(certificate(false, 100), {"/certificate", "Fletcher32 alone"}));
  BOOST_TEST(says(certificate(true, 4000), {"/certificate", "Fletcher32 alone"}));
  BOOST_TEST(says(certificate(true, 100), {"/certificate", "Fletcher32 alone"}));
}
