// Checksummed HDF5 files: see hdf5_writer.hpp.
#include "host/files/hdf5/hdf5_writer.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "vdvr/error.hpp"

namespace vdvr::io::hdf5 {
namespace {

// One chunk is one read, one checksum and one write: large enough to amortise a call, small enough for HDF5's
// 1 MiB chunk cache and for readers that want a part. Between 256 KiB and 1 MiB the throughput does not
// change.
constexpr std::uint64_t chunk_bytes_wanted = 512 * 1024;
// An object header message holds at most 65,535 bytes.
constexpr std::uint64_t header_text_bytes = 60'000;

Handle scalar_space() { return {H5Screate(H5S_SCALAR), H5Sclose}; }

Handle simple_space(const Shape& shape) {
  const std::vector<hsize_t> extent(shape.begin(), shape.end());
  return {H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr), H5Sclose};
}

}  // namespace

Shape chunk_shape(const Shape& shape, std::uint64_t bytes_per_element) {
  Shape chunk(shape.size(), 1);
  std::uint64_t room = std::max<std::uint64_t>(1, chunk_bytes_wanted / bytes_per_element);
  for (std::size_t axis = shape.size(); axis-- > 0;) {
    if (shape[axis] <= room) {
      chunk[axis] = shape[axis];
      room /= shape[axis];
      continue;
    }
    const std::uint64_t parts = (shape[axis] + room - 1) / room;
    chunk[axis] = (shape[axis] + parts - 1) / parts;
    break;  // a slower axis above 1 would interleave the chunks
  }
  return chunk;
}

Writer::Writer(const std::filesystem::path& file, const std::filesystem::path& shown, const Form& form)
    : shown_(shown.string()), form_(form) {
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose), create = properties(H5P_FILE_CREATE);
  // From 1.10 on all metadata carries checksums; the oldest layout, the default, has none, and HDF5 reads a
  // damaged one without looking. A fixed upper bound keeps the bytes the same under newer libraries.
  H5Pset_libver_bounds(access.id(), H5F_LIBVER_V110, H5F_LIBVER_V110);
  H5Pset_fclose_degree(access.id(), H5F_CLOSE_STRONG);
  file_ = Handle(H5Fcreate(file.c_str(), H5F_ACC_TRUNC, create.id(), access.id()), H5Fclose);
  if (!file_) fail("cannot be created");
}

void Writer::fail(const std::string& what) const {
  throw ResourceError(fmt::format("{}: {}: {}; is the disk full?", shown_, what, reason()));
}

Handle Writer::properties(hid_t of) const {
  Handle list(H5Pcreate(of), H5Pclose);
  if (form_.headers == Headers::dated) return list;
  H5Pset_obj_track_times(list.id(), false);
  if (of == H5P_DATASET_CREATE) H5Pset_fill_time(list.id(), H5D_FILL_TIME_NEVER);  // all is written at once
  return list;
}

void Writer::group(const std::string& path) {
  const Handle group(
      H5Gcreate2(file_.id(), path.c_str(), H5P_DEFAULT, properties(H5P_GROUP_CREATE).id(), H5P_DEFAULT),
      H5Gclose);
  if (!group) fail(fmt::format("group {} cannot be written", path));
}

void Writer::create_attribute(Attribute a, hid_t type, const Handle& space) {
  const Handle attribute(H5Acreate_by_name(file_.id(), a.object.c_str(), a.name.c_str(), type, space.id(),
                                           H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose);
  if (!attribute || H5Awrite(attribute.id(), type, a.bytes.c_str()) < 0)
    fail(fmt::format("attribute '{}' of {} cannot be written", a.name, a.object));
  attributes_.push_back(std::move(a));
}

void Writer::attribute(const std::string& object, const std::string& name, std::int64_t value) {
  create_attribute(attribute_of<std::int64_t>(object, name, {&value, 1}), element_type<std::int64_t>(),
                   scalar_space());
}
void Writer::attribute(const std::string& object, const std::string& name,
                       std::span<const std::int64_t> values) {
  create_attribute(attribute_of(object, name, values), element_type<std::int64_t>(),
                   simple_space({values.size()}));
}
void Writer::attribute(const std::string& object, const std::string& name, double value) {
  create_attribute(attribute_of<double>(object, name, {&value, 1}), element_type<double>(), scalar_space());
}
void Writer::attribute(const std::string& object, const std::string& name, std::span<const double> values) {
  create_attribute(attribute_of(object, name, values), element_type<double>(), simple_space({values.size()}));
}
void Writer::attribute(const std::string& object, const std::string& name, const std::string& text) {
  // Fixed length: variable-length text goes to HDF5's global heap, which has no checksum; a flipped bit there
  // makes the library itself crash on reading (1.10.8).
  create_attribute({object, name, 't', text.size(), text},
                   text_type(std::max<std::size_t>(1, text.size())).id(), scalar_space());
}

void Writer::write_dataset(const std::string& path, hid_t type, const Handle& space, const Handle& creation,
                           const void* values) {
  const Handle dataset(
      H5Dcreate2(file_.id(), path.c_str(), type, space.id(), H5P_DEFAULT, creation.id(), H5P_DEFAULT),
      H5Dclose);
  // Chunks wait in a cache until the dataset is closed, where a full disk would go unnoticed.
  if (!dataset || H5Dwrite(dataset.id(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0 ||
      H5Dflush(dataset.id()) < 0)
    fail(fmt::format("{} cannot be written", path));
}

void Writer::create_dataset(const std::string& path, const Shape& shape, const Shape& chunk, hid_t type,
                            unsigned deflate_level, const void* values) {
  const Handle creation = properties(H5P_DATASET_CREATE);
  const std::vector<hsize_t> extent(chunk.begin(), chunk.end());
  // The checksum goes last, so that a damaged chunk is refused before it is inflated. Single bytes have
  // nothing to shuffle.
  const bool packed = deflate_level > 0, shuffled = packed && H5Tget_size(type) > 1;
  if (H5Pset_chunk(creation.id(), static_cast<int>(extent.size()), extent.data()) < 0 ||
      (shuffled && H5Pset_shuffle(creation.id()) < 0) ||
      (packed && H5Pset_deflate(creation.id(), deflate_level) < 0) || H5Pset_fletcher32(creation.id()) < 0)
    fail(fmt::format("{} cannot be chunked under Fletcher32", path));
  write_dataset(path, type, simple_space(shape), creation, values);
}

Handle Writer::chunked_dataset(const std::string& path, const Shape& shape, const Shape& chunk, hid_t type,
                               unsigned deflate_level) {
  const Handle creation = properties(H5P_DATASET_CREATE);
  const std::vector<hsize_t> extent(chunk.begin(), chunk.end());
  const bool is_shuffled = deflate_level > 0 && H5Tget_size(type) > 1;
  if (H5Pset_chunk(creation.id(), static_cast<int>(extent.size()), extent.data()) < 0 ||
      (is_shuffled && H5Pset_shuffle(creation.id()) < 0) ||
      (deflate_level > 0 && H5Pset_deflate(creation.id(), deflate_level) < 0))
    fail(fmt::format("{} cannot be chunked", path));
  Handle dataset(H5Dcreate2(file_.id(), path.c_str(), type, simple_space(shape).id(), H5P_DEFAULT,
                            creation.id(), H5P_DEFAULT),
                 H5Dclose);
  if (!dataset) fail(fmt::format("{} cannot be written", path));
  return dataset;
}

void Writer::chunk(const Handle& dataset, const Shape& place, std::span<const std::byte> bytes) {
  const std::vector<hsize_t> offset(place.begin(), place.end());
  if (H5Dwrite_chunk(dataset.id(), H5P_DEFAULT, 0, offset.data(), bytes.size(), bytes.data()) < 0)
    fail("a chunk cannot be written");
}

void Writer::text(const std::string& path, const std::string& text) {
  const Handle type = text_type(std::max<std::size_t>(1, text.size()));
  if (text.size() > header_text_bytes) return create_dataset(path, {1}, {1}, type.id(), 0, text.data());
  const Handle creation = properties(H5P_DATASET_CREATE);
  H5Pset_layout(creation.id(), H5D_COMPACT);
  write_dataset(path, type.id(), scalar_space(), creation, text.c_str());
}

void Writer::close() {
  if (H5Fflush(file_.id(), H5F_SCOPE_LOCAL) < 0 || !file_.close()) fail("cannot be flushed");
}

}  // namespace vdvr::io::hdf5
