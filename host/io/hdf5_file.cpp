// Checksummed HDF5 files: see hdf5_file.hpp. Called by vdvr_file.cpp.
#include "host/io/hdf5_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "host/io/hdf5_chunks.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io::hdf5_file {
namespace {

// One chunk is one read, one checksum and one write: large enough to amortise a call, small enough for HDF5's
// 1 MiB chunk cache and for readers that want a part. Between 256 KiB and 1 MiB the throughput does not
// change.
constexpr std::uint64_t chunk_bytes_wanted = 512 * 1024;
// An object header message holds at most 65,535 bytes.
constexpr std::uint64_t header_text_bytes = 60'000;

// A file whose last flush failed (disk full) cannot be closed; HDF5 1.10 tries once more when the process
// exits and crashes. Every handle here is closed by its owner, so its exit handler has nothing else to do.
// Before main, because only a call before HDF5's first use has an effect.
[[maybe_unused]] const herr_t without_exit_handler = H5dont_atexit();

/// The innermost message of HDF5's error stack: "Data error detected by Fletcher32 checksum", "truncated file
/// ...".
std::string hdf5_reason() {
  std::string reason;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned, const H5E_error2_t* error, void* out) -> herr_t {
        auto& text = *static_cast<std::string*>(out);
        if (text.empty() && error->desc != nullptr) text = error->desc;
        return 0;
      },
      &reason);
  H5Eclear2(H5E_DEFAULT);
  return reason.empty() ? "HDF5 gives no reason" : reason;
}

Handle text_type(std::size_t length) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.get(), length);
  H5Tset_cset(type.get(), H5T_CSET_UTF8);
  H5Tset_strpad(type.get(), H5T_STR_NULLPAD);
  return type;
}

Handle simple_space(const Shape& shape) {
  const std::vector<hsize_t> extent(shape.begin(), shape.end());
  return {H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr), H5Sclose};
}

/// Creation properties of every dataset: no time stamps, so that equal contents give equal bytes.
Handle dataset_properties() {
  Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_obj_track_times(properties.get(), false);
  H5Pset_fill_time(properties.get(), H5D_FILL_TIME_NEVER);  // everything is written right away
  return properties;
}

std::string class_name(H5T_class_t c, std::size_t size) {
  switch (c) {
    case H5T_INTEGER:
      return fmt::format("a {}-byte integer", size);
    case H5T_FLOAT:
      return fmt::format("a {}-byte float", size);
    case H5T_STRING:
      return "a string";
    case H5T_COMPOUND:
      return "a compound";
    default:
      return "another type";
  }
}

/// Only types whose bytes in the file are those in memory: chunks are read without HDF5's conversion.
Element element_of(hid_t type) {
  const auto is = [&](hid_t known) { return H5Tequal(type, known) > 0; };
  if (is(H5T_IEEE_F32LE)) return Element::f32;
  if (is(H5T_STD_U8LE) || is(H5T_STD_U8BE)) return Element::u8;
  if (is(H5T_STD_U16LE)) return Element::u16;
  if (is(H5T_STD_U32LE)) return Element::u32;
  return is(H5T_STD_I32LE) ? Element::i32 : Element::other;
}

/// Numbers of an attribute: more than this no file of ours has, and memory is taken for them.
constexpr std::uint64_t most_attribute_values = 1 << 20;
constexpr hsize_t most_attributes = 256;

template <class T>
Attribute numbers_of(const std::string& object, const std::string& name, char kind,
                     std::span<const T> values) {
  Attribute a{object, name, kind, values.size(), std::string(values.size_bytes(), '\0')};
  if (!values.empty()) std::memcpy(a.bytes.data(), values.data(), values.size_bytes());
  return a;
}

std::uint64_t element_bytes(Element e) {
  switch (e) {
    case Element::u8:
      return 1;
    case Element::u16:
      return 2;
    default:
      return 4;
  }
}

}  // namespace

Handle::Handle(Handle&& other) noexcept
    : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(std::exchange(other.close_, nullptr)) {}

Handle& Handle::operator=(Handle&& other) noexcept {
  if (this != &other) {
    reset();
    id_ = std::exchange(other.id_, H5I_INVALID_HID);
    close_ = std::exchange(other.close_, nullptr);
  }
  return *this;
}

bool Handle::reset() {
  const bool closed = id_ < 0 || close_ == nullptr || close_(id_) >= 0;
  id_ = H5I_INVALID_HID;
  return closed;
}

Silence::Silence() {
  H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}
Silence::~Silence() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }

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

// --- writing ---

Writer::Writer(const std::filesystem::path& file, const std::filesystem::path& shown, unsigned deflate_level)
    : shown_(shown.string()), deflate_level_(deflate_level) {
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose), create(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
  // From 1.10 on all metadata carries checksums; a fixed upper bound keeps the bytes the same under newer
  // libraries.
  H5Pset_libver_bounds(access.get(), H5F_LIBVER_V110, H5F_LIBVER_V110);
  H5Pset_fclose_degree(access.get(), H5F_CLOSE_STRONG);
  H5Pset_obj_track_times(create.get(), false);
  file_ = Handle(H5Fcreate(file.c_str(), H5F_ACC_TRUNC, create.get(), access.get()), H5Fclose);
  if (!file_) fail("cannot be created");
}

void Writer::fail(const std::string& what) const {
  throw ResourceError(fmt::format("{}: {}: {}; is the disk full?", shown_, what, hdf5_reason()));
}

void Writer::group(const std::string& path) {
  const Handle properties(H5Pcreate(H5P_GROUP_CREATE), H5Pclose);
  H5Pset_obj_track_times(properties.get(), false);
  const Handle group(H5Gcreate2(file_.get(), path.c_str(), H5P_DEFAULT, properties.get(), H5P_DEFAULT),
                     H5Gclose);
  if (!group) fail(fmt::format("group {} cannot be written", path));
}

void Writer::create_attribute(const std::string& object, const std::string& name, hid_t type, hid_t space,
                              hid_t given, const void* values) {
  const Handle attribute(H5Acreate_by_name(file_.get(), object.c_str(), name.c_str(), type, space,
                                           H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose);
  if (!attribute || H5Awrite(attribute.get(), given, values) < 0)
    fail(fmt::format("attribute '{}' of {} cannot be written", name, object));
}

void Writer::attribute(const std::string& object, const std::string& name, std::int64_t value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  create_attribute(object, name, H5T_STD_I64LE, space.get(), H5T_NATIVE_INT64, &value);
  attributes_.push_back(numbers_of<std::int64_t>(object, name, 'i', {&value, 1}));
}

void Writer::attribute(const std::string& object, const std::string& name,
                       std::span<const std::int64_t> values) {
  create_attribute(object, name, H5T_STD_I64LE, simple_space({values.size()}).get(), H5T_NATIVE_INT64,
                   values.data());
  attributes_.push_back(numbers_of<std::int64_t>(object, name, 'i', values));
}

void Writer::attribute(const std::string& object, const std::string& name, double value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  create_attribute(object, name, H5T_IEEE_F64LE, space.get(), H5T_NATIVE_DOUBLE, &value);
  attributes_.push_back(numbers_of<double>(object, name, 'f', {&value, 1}));
}

void Writer::attribute(const std::string& object, const std::string& name, std::span<const double> values) {
  create_attribute(object, name, H5T_IEEE_F64LE, simple_space({values.size()}).get(), H5T_NATIVE_DOUBLE,
                   values.data());
  attributes_.push_back(numbers_of<double>(object, name, 'f', values));
}

void Writer::attribute(const std::string& object, const std::string& name, const std::string& text) {
  // Fixed length: variable-length text goes to HDF5's global heap, which has no checksum; a flipped bit there
  // makes the library itself crash on reading (1.10.8).
  const Handle type = text_type(std::max<std::size_t>(1, text.size())),
               space(H5Screate(H5S_SCALAR), H5Sclose);
  create_attribute(object, name, type.get(), space.get(), type.get(), text.c_str());
  attributes_.push_back({object, name, 't', text.size(), text});
}

void Writer::create_dataset(const std::string& path, const Shape& shape, hid_t stored, hid_t given,
                            std::uint64_t bytes_per_element, unsigned deflate_level, const void* values) {
  const Handle properties = dataset_properties(), space = simple_space(shape);
  const Shape chunk = chunk_shape(shape, bytes_per_element);
  const std::vector<hsize_t> extent(chunk.begin(), chunk.end());
  // The checksum goes last, so that a damaged chunk is refused before it is inflated. Single bytes have
  // nothing to shuffle.
  const bool packed = deflate_level > 0, shuffled = packed && bytes_per_element > 1;
  if (H5Pset_chunk(properties.get(), static_cast<int>(extent.size()), extent.data()) < 0 ||
      (shuffled && H5Pset_shuffle(properties.get()) < 0) ||
      (packed && H5Pset_deflate(properties.get(), deflate_level) < 0) ||
      H5Pset_fletcher32(properties.get()) < 0)
    fail(fmt::format("{} cannot be chunked under Fletcher32", path));
  const Handle dataset(
      H5Dcreate2(file_.get(), path.c_str(), stored, space.get(), H5P_DEFAULT, properties.get(), H5P_DEFAULT),
      H5Dclose);
  // Chunks wait in a cache until the dataset is closed, where a full disk would go unnoticed.
  if (!dataset || H5Dwrite(dataset.get(), given, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0 ||
      H5Dflush(dataset.get()) < 0)
    fail(fmt::format("{} cannot be written", path));
}

void Writer::dataset(const std::string& path, const Shape& shape, std::span<const float> values) {
  create_dataset(path, shape, H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, sizeof(float), deflate_level_, values.data());
}
void Writer::dataset(const std::string& path, const Shape& shape, std::span<const std::uint8_t> values) {
  create_dataset(path, shape, H5T_STD_U8LE, H5T_NATIVE_UINT8, 1, deflate_level_, values.data());
}
void Writer::dataset(const std::string& path, const Shape& shape, std::span<const std::uint16_t> values) {
  create_dataset(path, shape, H5T_STD_U16LE, H5T_NATIVE_UINT16, 2, deflate_level_, values.data());
}
void Writer::dataset(const std::string& path, const Shape& shape, std::span<const std::int32_t> values) {
  create_dataset(path, shape, H5T_STD_I32LE, H5T_NATIVE_INT32, 4, deflate_level_, values.data());
}
void Writer::dataset(const std::string& path, const Shape& shape, std::span<const std::uint32_t> values) {
  create_dataset(path, shape, H5T_STD_U32LE, H5T_NATIVE_UINT32, 4, deflate_level_, values.data());
}

void Writer::text(const std::string& path, const std::string& text) {
  const Handle type = text_type(std::max<std::size_t>(1, text.size()));
  if (text.size() > header_text_bytes)
    return create_dataset(path, {1}, type.get(), type.get(), text.size(), 0, text.data());
  const Handle properties = dataset_properties(), space(H5Screate(H5S_SCALAR), H5Sclose);
  H5Pset_layout(properties.get(), H5D_COMPACT);
  const Handle dataset(H5Dcreate2(file_.get(), path.c_str(), type.get(), space.get(), H5P_DEFAULT,
                                  properties.get(), H5P_DEFAULT),
                       H5Dclose);
  if (!dataset || H5Dwrite(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, text.c_str()) < 0)
    fail(fmt::format("{} cannot be written", path));
}

void Writer::close() {
  if (H5Fflush(file_.get(), H5F_SCOPE_LOCAL) < 0 || !file_.reset()) fail("cannot be flushed");
}

// --- reading ---

Reader::Reader(const std::filesystem::path& path) : shown_(path.string()) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    throw FileError(fmt::format("{}: no such file", shown_));
  file_bytes_ = std::filesystem::file_size(path, error);
  if (error) throw FileError(fmt::format("{}: {}", shown_, error.message()));
  if (file_bytes_ == 0) throw FileError(fmt::format("{}: the file is empty", shown_));
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fclose_degree(access.get(), H5F_CLOSE_STRONG);
  file_ = Handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.get()), H5Fclose);
  if (!file_) throw FileError(fmt::format("{}: cannot be read as HDF5: {}", shown_, hdf5_reason()));
}

void Reader::refuse(const std::string& object, const std::string& what) const {
  throw FileError(fmt::format("{}: {}: {}", shown_, object, what));
}

bool Reader::has(const std::string& path) const {
  // Each step of the path is looked at by itself: a link in the middle may lead out of the file as well.
  for (std::size_t end = path.find('/', 1);; end = path.find('/', end + 1)) {
    const std::string step = path.substr(0, end);
    const htri_t exists = H5Lexists(file_.get(), step.c_str(), H5P_DEFAULT);
    if (exists < 0) refuse(step, hdf5_reason());
    if (exists == 0) return false;
    H5L_info_t info{};
    if (H5Lget_info(file_.get(), step.c_str(), &info, H5P_DEFAULT) < 0) refuse(step, hdf5_reason());
    if (info.type != H5L_TYPE_HARD)
      refuse(step, "is a soft or external link; only data inside the file is read");
    if (end == std::string::npos) return true;
  }
}

Handle Reader::open_object(const std::string& path) const {
  if (path != "/" && !has(path)) refuse(path, "is missing");
  Handle object(H5Oopen(file_.get(), path.c_str(), H5P_DEFAULT), H5Oclose);
  if (!object) refuse(path, hdf5_reason());
  return object;
}

void Reader::require_group(const std::string& path) const {
  if (H5Iget_type(open_object(path).get()) != H5I_GROUP) refuse(path, "is not a group");
}

std::vector<std::string> Reader::members(const std::string& group) const {
  const Handle object = open_object(group);
  H5G_info_t info{};
  if (H5Gget_info(object.get(), &info) < 0) refuse(group, hdf5_reason());
  std::vector<std::string> names;
  for (hsize_t i = 0; i < info.nlinks; ++i) {
    const ssize_t length =
        H5Lget_name_by_idx(object.get(), ".", H5_INDEX_NAME, H5_ITER_INC, i, nullptr, 0, H5P_DEFAULT);
    if (length < 0) refuse(group, hdf5_reason());
    std::string name(static_cast<std::size_t>(length) + 1, '\0');
    H5Lget_name_by_idx(object.get(), ".", H5_INDEX_NAME, H5_ITER_INC, i, name.data(), name.size(),
                       H5P_DEFAULT);
    name.pop_back();
    names.push_back(std::move(name));
  }
  std::sort(names.begin(), names.end());
  return names;
}

bool Reader::has_attribute(const std::string& object, const std::string& name) const {
  return H5Aexists(open_object(object).get(), name.c_str()) > 0;
}

Handle Reader::open_attribute(const std::string& object, const std::string& name, bool number,
                              std::uint64_t count) const {
  const Handle parent = open_object(object);
  const std::string shown = fmt::format("attribute '{}' of {}", name, object);
  if (H5Aexists(parent.get(), name.c_str()) <= 0) refuse(shown, "is missing");
  Handle attribute(H5Aopen(parent.get(), name.c_str(), H5P_DEFAULT), H5Aclose);
  if (!attribute) refuse(shown, hdf5_reason());
  const Handle type(H5Aget_type(attribute.get()), H5Tclose), space(H5Aget_space(attribute.get()), H5Sclose);
  const H5T_class_t c = H5Tget_class(type.get());
  const bool fits = number ? c == H5T_INTEGER || c == H5T_FLOAT : c == H5T_STRING;
  if (!fits)
    refuse(shown, fmt::format("is {}, expected {}", class_name(c, H5Tget_size(type.get())),
                              number ? "a number" : "a string"));
  const hssize_t have = H5Sget_simple_extent_npoints(space.get());
  if (have < 0 || static_cast<std::uint64_t>(have) != count || H5Sget_simple_extent_ndims(space.get()) > 1)
    refuse(shown, fmt::format("holds {} values, expected {}", have, count));
  return attribute;
}

std::vector<std::int64_t> Reader::integers(const std::string& object, const std::string& name,
                                           std::uint64_t count) const {
  const Handle attribute = open_attribute(object, name, true, count);
  const Handle type(H5Aget_type(attribute.get()), H5Tclose);
  const std::string shown = fmt::format("attribute '{}' of {}", name, object);
  if (H5Tget_class(type.get()) != H5T_INTEGER) refuse(shown, "is not an integer");
  std::vector<std::int64_t> values(count);
  if (H5Aread(attribute.get(), H5T_NATIVE_INT64, values.data()) < 0) refuse(shown, hdf5_reason());
  return values;
}

std::int64_t Reader::integer(const std::string& object, const std::string& name) const {
  return integers(object, name, 1).front();
}

std::vector<double> Reader::reals(const std::string& object, const std::string& name,
                                  std::uint64_t count) const {
  const Handle attribute = open_attribute(object, name, true, count);
  std::vector<double> values(count);
  if (H5Aread(attribute.get(), H5T_NATIVE_DOUBLE, values.data()) < 0)
    refuse(fmt::format("attribute '{}' of {}", name, object), hdf5_reason());
  return values;
}

namespace {

/// One string through `read(type, buffer)`; false when HDF5 fails. Variable length is what h5py makes of an
/// edited text.
template <class Read>
bool read_text(hid_t type, std::string& text, Read read) {
  if (H5Tis_variable_str(type) > 0) {
    const Handle memory = text_type(H5T_VARIABLE);
    H5Tset_cset(memory.get(), H5Tget_cset(type));
    char* first = nullptr;
    if (read(memory.get(), &first) < 0) return false;
    if (first != nullptr) text = first;
    H5free_memory(first);
    return true;
  }
  text.assign(H5Tget_size(type), '\0');
  if (read(type, text.data()) < 0) return false;
  text.resize(std::min(text.size(), text.find('\0')));
  return true;
}

}  // namespace

std::string Reader::text_attribute(const std::string& object, const std::string& name) const {
  const Handle attribute = open_attribute(object, name, false, 1);
  const Handle type(H5Aget_type(attribute.get()), H5Tclose);
  std::string text;
  if (!read_text(type.get(), text,
                 [&](hid_t memory, void* out) { return H5Aread(attribute.get(), memory, out); }))
    refuse(fmt::format("attribute '{}' of {}", name, object), hdf5_reason());
  return text;
}

std::vector<Attribute> Reader::attributes(const std::string& object) const {
  const Handle parent = open_object(object);
  H5O_info_t info{};
  if (H5Oget_info2(parent.get(), &info, H5O_INFO_NUM_ATTRS) < 0) refuse(object, hdf5_reason());
  if (info.num_attrs > most_attributes)
    refuse(object, fmt::format("has {} attributes, more than {}", info.num_attrs, most_attributes));
  std::vector<std::string> names;
  const auto collect = [](hid_t, const char* name, const H5A_info_t*, void* out) -> herr_t {
    static_cast<std::vector<std::string>*>(out)->emplace_back(name);
    return 0;
  };
  if (H5Aiterate2(parent.get(), H5_INDEX_NAME, H5_ITER_INC, nullptr, collect, &names) < 0)
    refuse(object, hdf5_reason());
  std::sort(names.begin(), names.end());
  std::vector<Attribute> all;
  for (const std::string& name : names) {
    const std::string shown = fmt::format("attribute '{}' of {}", name, object);
    const Handle attribute(H5Aopen(parent.get(), name.c_str(), H5P_DEFAULT), H5Aclose);
    if (!attribute) refuse(shown, hdf5_reason());
    const Handle type(H5Aget_type(attribute.get()), H5Tclose), space(H5Aget_space(attribute.get()), H5Sclose);
    const H5T_class_t c = H5Tget_class(type.get());
    const hssize_t have = H5Sget_simple_extent_npoints(space.get());
    if (have < 0 || static_cast<std::uint64_t>(have) > most_attribute_values)
      refuse(shown, fmt::format("holds {} values", have));
    const auto count = static_cast<std::uint64_t>(have);
    const auto numbers = [&](auto zero, hid_t memory, char kind) {
      std::vector<decltype(zero)> values(count, zero);
      if (count > 0 && H5Aread(attribute.get(), memory, values.data()) < 0) refuse(shown, hdf5_reason());
      all.push_back(numbers_of<decltype(zero)>(object, name, kind, values));
    };
    if (c == H5T_INTEGER) {
      numbers(std::int64_t{0}, H5T_NATIVE_INT64, 'i');
    } else if (c == H5T_FLOAT) {
      numbers(0.0, H5T_NATIVE_DOUBLE, 'f');
    } else if (c == H5T_STRING && count == 1) {
      const std::string text = text_attribute(object, name);
      all.push_back({object, name, 't', text.size(), text});
    } else {
      refuse(shown, fmt::format("is {} values of {}: neither numbers nor one text", count,
                                class_name(c, H5Tget_size(type.get()))));
    }
  }
  return all;
}

Dataset Reader::dataset(const std::string& path) const {
  Dataset d;
  d.path = path;
  d.id = open_object(path);
  if (H5Iget_type(d.id.get()) != H5I_DATASET) refuse(path, "is not a dataset");
  const Handle space(H5Dget_space(d.id.get()), H5Sclose), type(H5Dget_type(d.id.get()), H5Tclose);
  const int rank =
      H5Sget_simple_extent_type(space.get()) == H5S_SIMPLE ? H5Sget_simple_extent_ndims(space.get()) : 0;
  if (rank < 1) refuse(path, "is not an array");
  std::vector<hsize_t> extent(static_cast<std::size_t>(rank));
  H5Sget_simple_extent_dims(space.get(), extent.data(), nullptr);
  d.shape.assign(extent.begin(), extent.end());
  d.element = element_of(type.get());
  if (d.element == Element::other)
    refuse(path, fmt::format("elements are {}, expected little-endian float32, uint8, uint16 or uint32",
                             class_name(H5Tget_class(type.get()), H5Tget_size(type.get()))));
  d.count = 1;
  for (const std::uint64_t n : d.shape) d.count = saturating_product(d.count, n);
  d.element_bytes = element_bytes(d.element);
  d.bytes = saturating_product(d.count, d.element_bytes);
  if (d.count == 0) refuse(path, "is empty");
  if (const auto problem = check_storage(d, file_bytes_)) refuse(path, *problem);
  return d;
}

void Reader::read(const Dataset& d, void* values) const {
  if (const auto problem = read_chunks(d, values))
    refuse(d.path, fmt::format("cannot be read: {}; the file is damaged", *problem));
}

std::string Reader::text(const std::string& path, std::uint64_t max_bytes) const {
  const Handle dataset = open_object(path);
  if (H5Iget_type(dataset.get()) != H5I_DATASET) refuse(path, "is not a dataset");
  const Handle space(H5Dget_space(dataset.get()), H5Sclose), type(H5Dget_type(dataset.get()), H5Tclose);
  const Handle properties(H5Dget_create_plist(dataset.get()), H5Pclose);
  if (H5Tget_class(type.get()) != H5T_STRING) refuse(path, "is not a string");
  if (H5Sget_simple_extent_npoints(space.get()) != 1) refuse(path, "is not one string");
  if (H5Pget_layout(properties.get()) == H5D_VIRTUAL || H5Pget_external_count(properties.get()) > 0)
    refuse(path, "lies outside the file");
  const bool fixed = H5Tis_variable_str(type.get()) <= 0;
  if (fixed && H5Tget_size(type.get()) > max_bytes)
    refuse(path, fmt::format("has {} bytes, more than {}", H5Tget_size(type.get()), max_bytes));
  // HDF5 takes what a chunk lacks from behind it, and inflates without a limit.
  if (H5Pget_layout(properties.get()) == H5D_CHUNKED &&
      (!fixed || !fletcher32_alone(properties.get()) ||
       H5Dget_storage_size(dataset.get()) != H5Tget_size(type.get()) + fletcher32_bytes))
    refuse(path, "is in chunks that are not one text of fixed length under Fletcher32 alone");
  std::string text;
  if (!read_text(type.get(), text, [&](hid_t memory, void* out) {
        return H5Dread(dataset.get(), memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, out);
      }))
    refuse(path, fmt::format("cannot be read: {}; the file is damaged", hdf5_reason()));
  return text;
}

}  // namespace vdvr::io::hdf5_file
