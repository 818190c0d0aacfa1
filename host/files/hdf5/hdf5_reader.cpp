// See hdf5_reader.hpp.
#include "host/files/hdf5/hdf5_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "host/files/hdf5/hdf5_chunks.hpp"
#include "host/files/hdf5/hdf5_virtual.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io::hdf5 {
namespace {

/// Of what is there and does not open.
std::string unreadable() {
  return fmt::format("cannot be read: the file is damaged (HDF5: {}); copy it again from where it was made",
                     reason());
}

/// Numbers of an attribute: more than this no file of ours has, and memory is taken for them.
constexpr std::uint64_t most_attribute_values = 1 << 20;
constexpr hsize_t most_attributes = 256;
/// Names and units of others; what is longer is none.
constexpr hssize_t most_texts = 4096;
constexpr std::size_t longest_text = 1 << 20;

// --- attributes ---

/// An attribute as its header declares it; without an `id` where it cannot be opened.
struct Found {
  Handle id, type;
  bool exists = false;
  H5T_class_t kind = H5T_NO_CLASS;
  hssize_t count = -1;
  int rank = 0;

  [[nodiscard]] bool is_number() const { return kind == H5T_INTEGER || kind == H5T_FLOAT; }
  [[nodiscard]] std::string type_text() const { return type_name(kind, H5Tget_size(type.id())); }
};

Found find_attribute(const Handle& object, const std::string& name) {
  Found a;
  a.exists = object && H5Aexists(object.id(), name.c_str()) > 0;
  if (a.exists) a.id = Handle(H5Aopen(object.id(), name.c_str(), H5P_DEFAULT), H5Aclose);
  if (!a.id) return a;
  a.type = Handle(H5Aget_type(a.id.id()), H5Tclose);
  const Handle space(H5Aget_space(a.id.id()), H5Sclose);
  a.kind = H5Tget_class(a.type.id());
  a.count = H5Sget_simple_extent_npoints(space.id());
  a.rank = H5Sget_simple_extent_ndims(space.id());
  return a;
}

std::string name_of(const std::string& object, const std::string& attribute) {
  return fmt::format("attribute '{}' of {}", attribute, object);
}

/// Refuses what is missing or declared otherwise.
Found require_attribute(const Reader& file, const Handle& parent, const std::string& shown,
                        const std::string& name, bool number, std::uint64_t count) {
  Found a = find_attribute(parent, name);
  if (!a.exists) file.refuse(shown, "is missing");
  if (!a.id) file.refuse(shown, unreadable());
  if (number ? !a.is_number() : a.kind != H5T_STRING)
    file.refuse(shown, fmt::format("is {}, expected {}", a.type_text(), number ? "a number" : "a string"));
  if (a.count < 0 || static_cast<std::uint64_t>(a.count) != count || a.rank > 1)
    file.refuse(shown, fmt::format("holds {} values, expected {}", a.count, count));
  return a;
}

template <class T>
bool read_numbers(const Found& a, std::vector<T>& values) {
  return values.empty() || H5Aread(a.id.id(), element_type<T>(), values.data()) >= 0;
}

/// Strings through `read(type, buffer)`; HDF5's reason when it fails. Variable length is what h5py makes of
/// an edited text.
template <class Read>
std::optional<std::string> read_texts(hid_t type, std::vector<std::string>& texts, Read read) {
  if (H5Tis_variable_str(type) > 0) {
    const Handle memory = text_type(H5T_VARIABLE);
    H5Tset_cset(memory.id(), H5Tget_cset(type));
    std::vector<char*> first(texts.size(), nullptr);
    if (read(memory.id(), first.data()) < 0) return reason();  // before `memory` is closed
    for (std::size_t i = 0; i < texts.size(); ++i) {
      if (first[i] != nullptr) texts[i] = first[i];
      H5free_memory(first[i]);
    }
    return std::nullopt;
  }
  const std::size_t size = H5Tget_size(type);
  std::string all(size * texts.size(), '\0');
  if (read(type, all.data()) < 0) return reason();
  for (std::size_t i = 0; i < texts.size(); ++i) {
    texts[i] = all.substr(i * size, size);
    texts[i].resize(std::min(size, texts[i].find('\0')));
  }
  return std::nullopt;
}

std::optional<std::string> read_texts(const Found& a, std::vector<std::string>& texts) {
  return read_texts(a.type.id(), texts,
                    [&](hid_t memory, void* out) { return H5Aread(a.id.id(), memory, out); });
}

}  // namespace

Reader::Reader(const std::filesystem::path& path, Links links, const std::filesystem::path& root)
    : shown_(path.string()), links_(links) {
  if (links != Links::hard) {
    files_ = std::make_shared<const LinkedFiles>(path, root, links);
    return;
  }
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    throw FileError(fmt::format("{}: no such file", shown_));
  file_bytes_ = std::filesystem::file_size(path, error);
  if (error) throw FileError(fmt::format("{}: {}", shown_, error.message()));
  if (file_bytes_ == 0) throw FileError(fmt::format("{}: the file is empty", shown_));
  std::string why;
  file_ = open_to_read(path, true, why);
  if (!file_) throw FileError(fmt::format("{}: {}", shown_, why));
}

void Reader::refuse(const std::string& object, const std::string& what) const {
  throw FileError(fmt::format("{}: {}: {}", shown_, object, what));
}

// --- objects ---

bool Reader::hard_linked(const std::string& path) const {
  // Each step of the path is looked at by itself: a link in the middle may lead out of the file as well.
  for (std::size_t end = path.find('/', 1);; end = path.find('/', end + 1)) {
    const std::string step = path.substr(0, end);
    const htri_t exists = H5Lexists(file_.id(), step.c_str(), H5P_DEFAULT);
    if (exists < 0) refuse(step, unreadable());
    if (exists == 0) return false;
    H5L_info_t info{};
    if (H5Lget_info(file_.id(), step.c_str(), &info, H5P_DEFAULT) < 0) refuse(step, unreadable());
    if (info.type != H5L_TYPE_HARD)
      refuse(step, "is a soft or external link; only data inside the file is read");
    if (end == std::string::npos) return true;
  }
}

Place Reader::locate(const std::string& path) const {
  if (links_ != Links::hard) {
    Place place = files_->follow(files_->first(), path);
    if (broken_link_.empty()) broken_link_ = place.problem;
    return place;
  }
  Place place;
  if (path != "/" && !hard_linked(path)) return place;
  place.object = Handle(H5Oopen(file_.id(), path.c_str(), H5P_DEFAULT), H5Oclose);
  if (!place.object) refuse(path, unreadable());
  return place;
}

Place Reader::require(const std::string& path) const {
  Place place = locate(path);
  if (!place.problem.empty()) throw FileError(place.problem);
  if (!place.object) refuse(path, links_ == Links::hard ? "is missing" : "no such dataset");
  if (files_) files_->use(place);
  return place;
}

bool Reader::is_group(const std::string& path) const { return H5Iget_type(find(path).id()) == H5I_GROUP; }

bool Reader::is_dataset(const std::string& path) const {
  const Place place = locate(path);
  if (!place.problem.empty()) throw FileError(place.problem);
  return H5Iget_type(place.object.id()) == H5I_DATASET;
}

void Reader::require_group(const std::string& path) const {
  if (H5Iget_type(open_object(path).id()) != H5I_GROUP) refuse(path, "is not a group");
}

std::vector<std::string> Reader::members(const std::string& group) const {
  const Handle object = links_ == Links::hard ? open_object(group) : find(group);
  std::vector<std::string> names;
  const auto collect = [](hid_t, const char* name, const H5L_info_t*, void* out) -> herr_t {
    static_cast<std::vector<std::string>*>(out)->emplace_back(name);
    return 0;
  };
  if (H5Literate(object.id(), H5_INDEX_NAME, H5_ITER_INC, nullptr, collect, &names) < 0 &&
      links_ == Links::hard)
    refuse(group, unreadable());
  std::sort(names.begin(), names.end());
  return names;
}

// --- attributes that must be there ---

bool Reader::has_attribute(const std::string& object, const std::string& name) const {
  return find_attribute(open_object(object), name).exists;
}

std::vector<std::int64_t> Reader::integers(const std::string& object, const std::string& name,
                                           std::uint64_t count) const {
  const std::string shown = name_of(object, name);
  const Found a = require_attribute(*this, open_object(object), shown, name, true, count);
  if (a.kind != H5T_INTEGER) refuse(shown, "is not an integer");
  std::vector<std::int64_t> values(count);
  if (!read_numbers(a, values)) refuse(shown, unreadable());
  return values;
}

std::int64_t Reader::integer(const std::string& object, const std::string& name) const {
  return integers(object, name, 1).front();
}

std::vector<double> Reader::reals(const std::string& object, const std::string& name,
                                  std::uint64_t count) const {
  const std::string shown = name_of(object, name);
  const Found a = require_attribute(*this, open_object(object), shown, name, true, count);
  std::vector<double> values(count);
  if (!read_numbers(a, values)) refuse(shown, unreadable());
  return values;
}

std::string Reader::text_attribute(const std::string& object, const std::string& name) const {
  const std::string shown = name_of(object, name);
  const Found a = require_attribute(*this, open_object(object), shown, name, false, 1);
  std::vector<std::string> texts(1);
  if (const auto problem = read_texts(a, texts)) refuse(shown, *problem);
  return texts.front();
}

std::vector<Attribute> Reader::attributes(const std::string& object) const {
  const Handle parent = open_object(object);
  H5O_info_t info{};
  if (H5Oget_info2(parent.id(), &info, H5O_INFO_NUM_ATTRS) < 0) refuse(object, unreadable());
  if (info.num_attrs > most_attributes)
    refuse(object, fmt::format("has {} attributes, more than {}", info.num_attrs, most_attributes));
  std::vector<std::string> names;
  const auto collect = [](hid_t, const char* name, const H5A_info_t*, void* out) -> herr_t {
    static_cast<std::vector<std::string>*>(out)->emplace_back(name);
    return 0;
  };
  if (H5Aiterate2(parent.id(), H5_INDEX_NAME, H5_ITER_INC, nullptr, collect, &names) < 0)
    refuse(object, unreadable());
  std::sort(names.begin(), names.end());
  std::vector<Attribute> all;
  for (const std::string& name : names) {
    const std::string shown = name_of(object, name);
    const Found a = find_attribute(parent, name);
    if (!a.id) refuse(shown, unreadable());
    if (a.count < 0 || static_cast<std::uint64_t>(a.count) > most_attribute_values)
      refuse(shown, fmt::format("holds {} values", a.count));
    const auto count = static_cast<std::uint64_t>(a.count);
    const auto numbers = [&](auto zero) {
      std::vector<decltype(zero)> values(count, zero);
      if (!read_numbers(a, values)) refuse(shown, unreadable());
      all.push_back(attribute_of<decltype(zero)>(object, name, values));
    };
    if (a.kind == H5T_INTEGER) {
      numbers(std::int64_t{0});
    } else if (a.kind == H5T_FLOAT) {
      numbers(0.0);
    } else if (a.kind == H5T_STRING && count == 1) {
      const std::string text = text_attribute(object, name);
      all.push_back({object, name, 't', text.size(), text});
    } else {
      refuse(shown, fmt::format("is {} values of {}: neither numbers nor one text", count, a.type_text()));
    }
  }
  return all;
}

// --- attributes that may be there ---

std::vector<std::string> Reader::texts_at(const Place& place, const std::string& object,
                                          const std::string& name) const {
  const Found a = find_attribute(place.object, name);
  if (a.kind != H5T_STRING || a.count <= 0 || a.count > most_texts) return {};
  const bool fixed = H5Tis_variable_str(a.type.id()) <= 0;
  const std::size_t size = H5Tget_size(a.type.id());
  if (fixed && (size == 0 || size > longest_text)) return {};
  std::vector<std::string> texts(static_cast<std::size_t>(a.count));
  // What is there but cannot be read is damage, not absence.
  if (const auto problem = read_texts(a, texts))
    refuse(object, fmt::format("attribute '{}': cannot be read as text, damaged (HDF5: {})", name, *problem));
  for (std::string& text : texts)
    if (fixed) text.erase(text.find_last_not_of(' ') + 1);  // Fortran pads with spaces
  return texts;
}

std::vector<std::string> Reader::find_texts(const std::string& object, const std::string& name) const {
  const Place place = locate(object);
  std::vector<std::string> texts = texts_at(place, object, name);
  if (files_ && !texts.empty()) files_->use(place);
  return texts;
}

std::optional<std::string> Reader::nexus_class(const std::string& object) const {
  const std::vector<std::string> texts = texts_at(locate(object), object, "NX_class");
  if (texts.empty()) return std::nullopt;
  return texts.front();
}

std::optional<std::string> Reader::find_text(const std::string& object, const std::string& name) const {
  const std::vector<std::string> texts = find_texts(object, name);
  if (texts.empty()) return std::nullopt;
  return texts.front();
}

std::optional<std::vector<double>> Reader::find_reals(const std::string& object, const std::string& name,
                                                      std::uint64_t count) const {
  const Place place = locate(object);
  const Found a = find_attribute(place.object, name);
  if (!a.id) return std::nullopt;
  if (files_) files_->use(place);
  std::vector<double> values(count);
  if (!a.is_number() || a.count != static_cast<hssize_t>(count) || !read_numbers(a, values))
    refuse(object, fmt::format("attribute '{}' is not {}", name,
                               count == 1 ? "one number" : fmt::format("{} numbers", count)));
  return values;
}

std::optional<double> Reader::find_real(const std::string& object, const std::string& name) const {
  const auto values = find_reals(object, name, 1);
  if (!values) return std::nullopt;
  return values->front();
}

// --- datasets ---

Dataset Reader::declared(const std::string& path) const {
  return declare(open_object(path), fmt::format("{}: {}", shown_, path));
}

Dataset Reader::dataset(const std::string& path) const {
  Dataset d = declared(path);
  if (d.shape.empty()) refuse(path, "is not an array");
  if (d.element == Element::other)
    refuse(path, fmt::format("elements are {}, expected little-endian float32, uint8, uint16 or uint32",
                             type_name(d.kind, d.element_bytes)));
  if (d.count == 0) refuse(path, "is empty");
  if (const auto problem = check_storage(d, file_bytes_)) refuse(path, *problem);
  return d;
}

void Reader::read(const Dataset& d, void* values) const {
  if (const auto problem = read_chunks(d, values))
    throw FileError(fmt::format("{}: cannot be read: {}; the file is damaged", d.name, *problem));
}

Dataset Reader::numeric_dataset(const std::string& path) const {
  return hdf5::numeric_dataset(files_, require(path), fmt::format("{}: {}", shown_, path));
}

bool Reader::flag(const std::string& path) const {
  const Dataset d = declared(path);
  std::array<unsigned char, 8> bytes{};
  if (!(d.is_integer() || d.kind == H5T_ENUM) || d.count != 1 || d.element_bytes > bytes.size())
    refuse(path, "is not one boolean");
  if (d.outside || d.layout == H5D_CHUNKED || H5Dget_storage_size(d.id.id()) == 0)
    refuse(path, "is not a boolean that lies in one piece within the file");
  const Handle type(H5Dget_type(d.id.id()), H5Tclose);
  if (H5Dread(d.id.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()) < 0)
    refuse(path, fmt::format("cannot be read, truncated or damaged (HDF5: {})", reason()));
  return std::any_of(bytes.begin(), bytes.end(), [](unsigned char b) { return b != 0; });
}

std::string Reader::text(const std::string& path, std::uint64_t max_bytes) const {
  const Dataset d = declared(path);
  if (d.kind != H5T_STRING) refuse(path, "is not a string");
  if (d.count != 1) refuse(path, "is not one string");
  if (d.outside) refuse(path, "lies outside the file");
  const Handle type(H5Dget_type(d.id.id()), H5Tclose);
  const bool fixed = H5Tis_variable_str(type.id()) <= 0;
  if (fixed && d.element_bytes > max_bytes)
    refuse(path, fmt::format("has {} bytes, more than {}", d.element_bytes, max_bytes));
  // HDF5 takes what a chunk lacks from behind it, and inflates without a limit.
  if (d.layout == H5D_CHUNKED && (!fixed || d.filters != Filters{H5Z_FILTER_FLETCHER32} ||
                                  H5Dget_storage_size(d.id.id()) != d.element_bytes + fletcher32_bytes))
    refuse(path, "is in chunks that are not one text of fixed length under Fletcher32 alone");
  std::vector<std::string> texts(1);
  if (const auto problem = read_texts(type.id(), texts, [&](hid_t memory, void* out) {
        return H5Dread(d.id.id(), memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, out);
      }))
    refuse(path, fmt::format("cannot be read: {}; the file is damaged", *problem));
  return texts.front();
}

}  // namespace vdvr::io::hdf5
