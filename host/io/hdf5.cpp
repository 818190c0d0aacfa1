// HDF5 behind handles and exceptions; see hdf5.hpp.
#include "host/io/hdf5.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/system/limits.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

// After a damaged or half-written file HDF5 1.10 keeps objects that nobody holds a handle to; its exit
// handler tries a hundred times to close them, prints "infinite loop closing library", or crashes. Every
// handle here is closed by its owner, so the handler has nothing to do. Before main: only before HDF5's first
// use does the call have an effect. The same stands in hdf5_file.cpp, since a program may link one without
// the other.
[[maybe_unused]] const herr_t without_exit_handler = H5dont_atexit();

// Silences HDF5's printing while it lives: the setting is global to the process and belongs to the host
// program.
class Quiet {
 public:
  Quiet() {
    H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~Quiet() { H5Eset_auto2(H5E_DEFAULT, print_, data_); }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  H5E_auto2_t print_ = nullptr;
  void* data_ = nullptr;
};

// The innermost entry of the error stack says what happened; the outer ones repeat the call chain.
std::string last_error() {
  std::string text;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned n, const H5E_error2_t* entry, void* out) -> herr_t {
        if (n == 0 && entry->desc) *static_cast<std::string*>(out) = entry->desc;
        return 0;
      },
      &text);
  return text.empty() ? "" : " (HDF5: " + text + ")";
}

herr_t refuse_external(const char*, const char*, const char*, const char*, unsigned*, hid_t, void*) {
  return -1;
}

Hdf5Handle no_external_links() {
  Hdf5Handle list(H5Pcreate(H5P_LINK_ACCESS), H5Pclose);
  H5Pset_elink_cb(list.id(), refuse_external, nullptr);
  return list;
}

// What is there but cannot be read is damage, not absence: `what` names it.
[[noreturn]] void refuse_text(const std::string& what) {
  throw FileError(fmt::format("{}: cannot be read as text, damaged{}", what, last_error()));
}

std::vector<std::string> read_strings(hid_t object, hid_t type, hid_t space, bool attribute,
                                      const std::string& what) {
  const hssize_t n = H5Sget_simple_extent_npoints(space);
  constexpr hssize_t most = 4096;  // names and units; a list longer than that is not one
  if (n <= 0 || n > most) return {};
  const auto count = static_cast<std::size_t>(n);
  std::vector<std::string> strings;
  if (H5Tis_variable_str(type) > 0) {
    std::vector<char*> text(count, nullptr);
    const Hdf5Handle memory(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_size(memory.id(), H5T_VARIABLE);
    H5Tset_cset(memory.id(), H5Tget_cset(type));
    const herr_t rc = attribute ? H5Aread(object, memory.id(), text.data())
                                : H5Dread(object, memory.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data());
    if (rc < 0) refuse_text(what);
    for (const char* t : text) strings.emplace_back(t ? t : "");
    H5Dvlen_reclaim(memory.id(), space, H5P_DEFAULT, text.data());
    return strings;
  }
  const std::size_t size = H5Tget_size(type);
  constexpr std::size_t longest = 1 << 20;
  if (size == 0 || size > longest) return {};
  std::vector<char> text(size * count);
  const herr_t rc = attribute ? H5Aread(object, type, text.data())
                              : H5Dread(object, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data());
  if (rc < 0) refuse_text(what);
  for (std::size_t i = 0; i < count; ++i) {
    std::string one(text.data() + i * size, size);
    one.erase(std::min(one.find('\0'), one.size()));
    while (!one.empty() && one.back() == ' ') one.pop_back();
    strings.push_back(one);
  }
  return strings;
}

std::vector<std::int64_t> extent(hid_t space) {
  const int rank = H5Sget_simple_extent_ndims(space);
  std::vector<hsize_t> dims(static_cast<std::size_t>(std::max(rank, 0)));
  if (!dims.empty()) H5Sget_simple_extent_dims(space, dims.data(), nullptr);
  return {dims.begin(), dims.end()};
}

std::vector<hsize_t> unsigned_shape(std::span<const std::int64_t> shape) {
  return {shape.begin(), shape.end()};
}

// False when an axis is longer than it may ever be, or its chunks are: HDF5 never writes either, and
// allocates by both.
bool extents_fit(hid_t creation, hid_t space) {
  std::vector<hsize_t> now(H5S_MAX_RANK), most(H5S_MAX_RANK), chunk(H5S_MAX_RANK);
  const int rank = H5Sget_simple_extent_dims(space, now.data(), most.data());
  const bool chunked = H5Pget_layout(creation) == H5D_CHUNKED;
  if (chunked && H5Pget_chunk(creation, static_cast<int>(chunk.size()), chunk.data()) != rank) return false;
  for (std::size_t a = 0; a < static_cast<std::size_t>(std::max(rank, 0)); ++a)
    if (most[a] != H5S_UNLIMITED && (now[a] > most[a] || (chunked && chunk[a] > most[a]))) return false;
  return true;
}

// False when stored chunks differ in length from what their shape needs: HDF5 1.10 trusts a damaged shape and
// copies beyond the chunk it read. Only chunks without compression can be told so; a checksum adds four bytes
// to each.
bool chunks_fit(hid_t data, hid_t creation, hid_t space, hid_t type) {
  const int filters = H5Pget_nfilters(creation);
  for (int f = 0; f < filters; ++f) {
    unsigned flags = 0;
    std::size_t none = 0;
    const H5Z_filter_t filter =
        H5Pget_filter2(creation, static_cast<unsigned>(f), &flags, &none, nullptr, 0, nullptr, nullptr);
    if (filter != H5Z_FILTER_FLETCHER32 && filter != H5Z_FILTER_SHUFFLE) return true;
  }
  std::vector<hsize_t> dims(H5S_MAX_RANK);
  const int rank = H5Pget_chunk(creation, static_cast<int>(dims.size()), dims.data());
  hsize_t chunks = 0;
  if (rank < 1 || H5Dget_num_chunks(data, space, &chunks) < 0) return false;
  double bytes = static_cast<double>(H5Tget_size(type));  // double: a damaged shape may exceed 64 bits
  for (int a = 0; a < rank; ++a) bytes *= static_cast<double>(dims[static_cast<std::size_t>(a)]);
  constexpr double checksum = 4;
  const double n = static_cast<double>(chunks), stored = static_cast<double>(H5Dget_storage_size(data));
  return n * bytes <= stored && stored <= n * (bytes + checksum);
}

}  // namespace

// --- reading ---

void Hdf5Dataset::read(std::span<const std::int64_t> start, std::span<const std::int64_t> count,
                       double* out) const {
  const Quiet quiet;
  const Hdf5Handle space(H5Dget_space(handle_.id()), H5Sclose);
  const auto first = unsigned_shape(start), n = unsigned_shape(count);
  if (first.size() != shape_.size() || n.size() != shape_.size())
    throw FileError(fmt::format("{}: has {} axes, {} were asked for", name_, shape_.size(), n.size()));
  const Hdf5Handle memory(H5Screate_simple(static_cast<int>(n.size()), n.data(), nullptr), H5Sclose);
  if (H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, first.data(), nullptr, n.data(), nullptr) < 0 ||
      H5Dread(handle_.id(), H5T_NATIVE_DOUBLE, memory.id(), space.id(), H5P_DEFAULT, out) < 0)
    throw FileError(fmt::format("{}: cannot be read at [{}], truncated or damaged{}", name_,
                                fmt::join(start, ", "), last_error()));
}

std::vector<double> Hdf5Dataset::read_all() const {
  const std::uint64_t bytes = checked_bytes(shape_, sizeof(double), name_);
  require_memory(bytes, 0, name_);
  std::vector<double> values(bytes / sizeof(double));
  const Quiet quiet;
  if (H5Dread(handle_.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
    throw FileError(fmt::format("{}: cannot be read, truncated or damaged{}", name_, last_error()));
  return values;
}

Hdf5File Hdf5File::open(const std::filesystem::path& path) {
  const Quiet quiet;
  Hdf5File file;
  file.path_ = path.string();
  file.links_ = no_external_links();
  file.file_ = Hdf5Handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!file.file_.valid())
    throw FileError(fmt::format("{}: cannot be opened as HDF5: missing, truncated or damaged{}", file.path_,
                                last_error()));
  return file;
}

Hdf5Handle Hdf5File::open_object(const std::string& object) const {
  return {H5Oopen(file_.id(), object.c_str(), links_.id()), H5Oclose};
}

bool Hdf5File::is_group(const std::string& object) const {
  const Quiet quiet;
  const Hdf5Handle handle = open_object(object);
  return handle.valid() && H5Iget_type(handle.id()) == H5I_GROUP;
}

bool Hdf5File::is_dataset(const std::string& object) const {
  const Quiet quiet;
  const Hdf5Handle handle = open_object(object);
  return handle.valid() && H5Iget_type(handle.id()) == H5I_DATASET;
}

std::vector<std::string> Hdf5File::children(const std::string& group) const {
  const Quiet quiet;
  const Hdf5Handle handle = open_object(group);
  std::vector<std::string> names;
  if (!handle.valid() || H5Iget_type(handle.id()) != H5I_GROUP) return names;
  H5Literate(
      handle.id(), H5_INDEX_NAME, H5_ITER_INC, nullptr,
      [](hid_t, const char* name, const H5L_info_t*, void* out) -> herr_t {
        static_cast<std::vector<std::string>*>(out)->emplace_back(name);
        return 0;
      },
      &names);
  return names;
}

Hdf5Dataset Hdf5File::dataset(const std::string& object) const {
  const Quiet quiet;
  Hdf5Dataset data;
  data.name_ = named(object);
  data.handle_ = open_object(object);
  if (!data.handle_.valid())
    throw FileError(
        fmt::format("{}: no such dataset, or a link that leaves the file{}", data.name_, last_error()));
  const hid_t id = data.handle_.id();
  if (H5Iget_type(id) != H5I_DATASET) throw FileError(fmt::format("{}: is not a dataset", data.name_));
  const Hdf5Handle type(H5Dget_type(id), H5Tclose), space(H5Dget_space(id), H5Sclose);
  const Hdf5Handle creation(H5Dget_create_plist(id), H5Pclose);
  const H5T_class_t kind = H5Tget_class(type.id());
  if (kind != H5T_INTEGER && kind != H5T_FLOAT)
    throw FileError(fmt::format("{}: is not numeric", data.name_));
  if (H5Pget_layout(creation.id()) == H5D_VIRTUAL || H5Pget_external_count(creation.id()) > 0)
    throw FileError(
        fmt::format("{}: its numbers lie in other files; copy them into one with h5repack", data.name_));
  if (H5Sget_simple_extent_type(space.id()) == H5S_NULL || H5Dget_storage_size(id) == 0)
    throw FileError(fmt::format("{}: holds no data", data.name_));
  if (!extents_fit(creation.id(), space.id()))
    throw FileError(fmt::format("{}: is damaged: an axis, or its chunks, are longer than its largest extent",
                                data.name_));
  if (H5Pget_layout(creation.id()) == H5D_CHUNKED && !chunks_fit(id, creation.id(), space.id(), type.id()))
    throw FileError(
        fmt::format("{}: is damaged: its chunks are not as long as their shape says", data.name_));
  data.is_integer_ = kind == H5T_INTEGER;
  data.shape_ = extent(space.id());
  return data;
}

std::optional<std::string> Hdf5File::text(const std::string& object) const {
  const Quiet quiet;
  const Hdf5Handle handle = open_object(object);
  if (!handle.valid() || H5Iget_type(handle.id()) != H5I_DATASET) return std::nullopt;
  const Hdf5Handle type(H5Dget_type(handle.id()), H5Tclose), space(H5Dget_space(handle.id()), H5Sclose);
  if (H5Tget_class(type.id()) != H5T_STRING) return std::nullopt;
  const auto strings = read_strings(handle.id(), type.id(), space.id(), false, named(object));
  if (strings.empty()) return std::nullopt;
  return strings.front();
}

std::optional<std::vector<std::string>> Hdf5File::text_attribute(const std::string& object,
                                                                 const std::string& name) const {
  const Quiet quiet;
  const Hdf5Handle handle = open_object(object);
  if (!handle.valid() || H5Aexists(handle.id(), name.c_str()) <= 0) return std::nullopt;
  const Hdf5Handle attribute(H5Aopen(handle.id(), name.c_str(), H5P_DEFAULT), H5Aclose);
  if (!attribute.valid()) return std::nullopt;
  const Hdf5Handle type(H5Aget_type(attribute.id()), H5Tclose), space(H5Aget_space(attribute.id()), H5Sclose);
  if (H5Tget_class(type.id()) != H5T_STRING) return std::nullopt;
  return read_strings(attribute.id(), type.id(), space.id(), true,
                      fmt::format("{}: attribute '{}'", named(object), name));
}

std::optional<double> Hdf5File::number_attribute(const std::string& object, const std::string& name) const {
  const auto numbers = numbers_attribute(object, name, 1);
  if (!numbers) return std::nullopt;
  return numbers->front();
}

std::optional<std::vector<double>> Hdf5File::numbers_attribute(const std::string& object,
                                                               const std::string& name,
                                                               std::size_t count) const {
  const Quiet quiet;
  const Hdf5Handle handle = open_object(object);
  if (!handle.valid() || H5Aexists(handle.id(), name.c_str()) <= 0) return std::nullopt;
  const Hdf5Handle attribute(H5Aopen(handle.id(), name.c_str(), H5P_DEFAULT), H5Aclose);
  if (!attribute.valid()) return std::nullopt;
  const Hdf5Handle type(H5Aget_type(attribute.id()), H5Tclose), space(H5Aget_space(attribute.id()), H5Sclose);
  const H5T_class_t kind = H5Tget_class(type.id());
  std::vector<double> values(count);
  if ((kind != H5T_INTEGER && kind != H5T_FLOAT) ||
      H5Sget_simple_extent_npoints(space.id()) != static_cast<hssize_t>(count) ||
      H5Aread(attribute.id(), H5T_NATIVE_DOUBLE, values.data()) < 0)
    throw FileError(fmt::format("{}: attribute '{}' is not {}", named(object), name,
                                count == 1 ? "one number" : fmt::format("{} numbers", count)));
  return values;
}

// --- writing ---

Hdf5File Hdf5File::create(const std::filesystem::path& path) {
  const Quiet quiet;
  Hdf5File file;
  file.path_ = path.string();
  file.links_ = no_external_links();
  // The newer layouts put a checksum on every piece of metadata; the oldest, the default, have none, and HDF5
  // reads a damaged one without looking.
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_libver_bounds(access.id(), H5F_LIBVER_V110, H5F_LIBVER_V110);
  file.file_ = Hdf5Handle(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.id()), H5Fclose);
  if (!file.file_.valid())
    throw ResourceError(fmt::format("{}: cannot be created{}", file.path_, last_error()));
  return file;
}

void Hdf5File::create_group(const std::string& group) {
  const Quiet quiet;
  const Hdf5Handle handle(H5Gcreate2(file_.id(), group.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                          H5Gclose);
  if (!handle.valid())
    throw ResourceError(fmt::format("{}: cannot be created{}", named(group), last_error()));
}

void Hdf5File::write(const std::string& object, std::span<const std::int64_t> shape,
                     std::span<const std::int64_t> chunk, const float* values) {
  const Quiet quiet;
  const auto dims = unsigned_shape(shape), chunk_dims = unsigned_shape(chunk);
  const Hdf5Handle space(H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr), H5Sclose);
  const Hdf5Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_chunk(creation.id(), static_cast<int>(chunk_dims.size()), chunk_dims.data());
  H5Pset_fletcher32(creation.id());
  const Hdf5Handle data(H5Dcreate2(file_.id(), object.c_str(), H5T_IEEE_F32LE, space.id(), H5P_DEFAULT,
                                   creation.id(), H5P_DEFAULT),
                        H5Dclose);
  // Chunks wait in a cache until the dataset is closed, where a full disk would go unnoticed.
  if (!data.valid() || H5Dwrite(data.id(), H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0 ||
      H5Dflush(data.id()) < 0)
    throw ResourceError(
        fmt::format("{}: cannot be written{}; is the disk full?", named(object), last_error()));
}

void Hdf5File::write(const std::string& object, std::span<const double> values) {
  const Quiet quiet;
  const hsize_t n = values.size();
  const Hdf5Handle space(H5Screate_simple(1, &n, nullptr), H5Sclose);
  const Hdf5Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_chunk(creation.id(), 1, &n);
  H5Pset_fletcher32(creation.id());
  const Hdf5Handle data(H5Dcreate2(file_.id(), object.c_str(), H5T_IEEE_F64LE, space.id(), H5P_DEFAULT,
                                   creation.id(), H5P_DEFAULT),
                        H5Dclose);
  if (!data.valid() ||
      H5Dwrite(data.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0 ||
      H5Dflush(data.id()) < 0)
    throw ResourceError(
        fmt::format("{}: cannot be written{}; is the disk full?", named(object), last_error()));
}

void Hdf5File::write_attribute(const std::string& object, const std::string& name, const std::string& text) {
  const Quiet quiet;
  const Hdf5Handle handle = open_object(object), space(H5Screate(H5S_SCALAR), H5Sclose);
  const Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.id(), std::max<std::size_t>(text.size(), 1));
  H5Tset_strpad(type.id(), H5T_STR_NULLPAD);
  H5Tset_cset(type.id(), H5T_CSET_UTF8);
  const Hdf5Handle attribute(
      H5Acreate2(handle.id(), name.c_str(), type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (!attribute.valid() || H5Awrite(attribute.id(), type.id(), text.c_str()) < 0)
    throw ResourceError(
        fmt::format("{}: attribute '{}' cannot be written{}", named(object), name, last_error()));
}

void Hdf5File::write_attribute(const std::string& object, const std::string& name, double value) {
  const Quiet quiet;
  const Hdf5Handle handle = open_object(object), space(H5Screate(H5S_SCALAR), H5Sclose);
  const Hdf5Handle attribute(
      H5Acreate2(handle.id(), name.c_str(), H5T_IEEE_F64LE, space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (!attribute.valid() || H5Awrite(attribute.id(), H5T_NATIVE_DOUBLE, &value) < 0)
    throw ResourceError(
        fmt::format("{}: attribute '{}' cannot be written{}", named(object), name, last_error()));
}

void Hdf5File::close() {
  const Quiet quiet;
  if (file_.valid() && H5Fflush(file_.id(), H5F_SCOPE_GLOBAL) < 0)
    throw ResourceError(fmt::format("{}: cannot be flushed{}", path_, last_error()));
  if (file_.close() < 0) throw ResourceError(fmt::format("{}: cannot be closed{}", path_, last_error()));
}

}  // namespace vdvr::io
