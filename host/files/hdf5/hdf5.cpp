// HDF5 behind handles and exceptions; see hdf5.hpp.
#include "host/files/hdf5/hdf5.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "host/base/system/limits.hpp"
#include "host/files/hdf5/hdf5_chunks.hpp"
#include "host/files/hdf5/hdf5_filters.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io::hdf5 {
namespace {

// After a damaged or half-written file, or one whose last flush failed (disk full), HDF5 1.10 keeps objects
// that nobody holds a handle to; its exit handler tries a hundred times to close them, prints "infinite loop
// closing library", or crashes. Every handle here is closed by its owner, so the handler has nothing to do.
// Before main: only before HDF5's first use does the call have an effect.
[[maybe_unused]] const herr_t without_exit_handler = H5dont_atexit();

Element element_of(hid_t type) {
  const auto is = [&](hid_t known) { return H5Tequal(type, known) > 0; };
  if (is(H5T_IEEE_F32LE)) return Element::f32;
  if (is(H5T_STD_U8LE) || is(H5T_STD_U8BE)) return Element::u8;
  if (is(H5T_STD_U16LE)) return Element::u16;
  if (is(H5T_STD_U32LE)) return Element::u32;
  return is(H5T_STD_I32LE) ? Element::i32 : Element::other;
}

/// A virtual dataset without a fixed shape: HDF5 opens its sources to know how long it is. Nothing for
/// others.
std::optional<std::string> open_ended(hid_t creation) {
  std::size_t count = 0;
  if (H5Pget_layout(creation) != H5D_VIRTUAL) return std::nullopt;
  if (H5Pget_virtual_count(creation, &count) < 0) return "has mappings that cannot be read: damaged";
  for (std::size_t i = 0; i < count; ++i) {
    const Handle space(H5Pget_virtual_vspace(creation, i), H5Sclose);
    if (!space || H5Sget_select_npoints(space.id()) < 0)
      return fmt::format(
          "is a virtual dataset of unlimited extent, or with a pattern (%b) for its sources' names (mapping "
          "{} of "
          "{}), which is not read; h5repack --merge -l CONTI IN OUT copies it as it is now into one file",
          i + 1, count);
  }
  return std::nullopt;
}

}  // namespace

Silence::Silence() {
  H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}
Silence::~Silence() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }

std::string reason() {
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
  H5Tset_size(type.id(), length);
  H5Tset_cset(type.id(), H5T_CSET_UTF8);
  H5Tset_strpad(type.id(), H5T_STR_NULLPAD);
  return type;
}

std::string type_name(H5T_class_t type, std::size_t bytes) {
  switch (type) {
    case H5T_INTEGER:
      return fmt::format("a {}-byte integer", bytes);
    case H5T_FLOAT:
      return fmt::format("a {}-byte float", bytes);
    case H5T_STRING:
      return "a string";
    case H5T_COMPOUND:
      return "a compound";
    default:
      return "another type";
  }
}

Dataset declare(Handle object, std::string name) {
  Dataset d;
  d.name = std::move(name);
  d.id = std::move(object);
  if (H5Iget_type(d.id.id()) != H5I_DATASET) throw FileError(d.name + ": is not a dataset");
  const Handle creation(H5Dget_create_plist(d.id.id()), H5Pclose);
  if (const auto problem = open_ended(creation.id()))
    throw FileError(fmt::format("{}: {}", d.name, *problem));
  const Handle space(H5Dget_space(d.id.id()), H5Sclose), type(H5Dget_type(d.id.id()), H5Tclose);
  d.kind = H5Tget_class(type.id());
  d.element = element_of(type.id());
  d.element_bytes = H5Tget_size(type.id());
  std::vector<hsize_t> extents(H5S_MAX_RANK), largest(H5S_MAX_RANK), chunk(H5S_MAX_RANK);
  const int rank = H5Sget_simple_extent_dims(space.id(), extents.data(), largest.data());
  d.shape.assign(extents.begin(), extents.begin() + std::max(rank, 0));
  d.largest.assign(largest.begin(), largest.begin() + std::max(rank, 0));
  d.count = H5Sget_simple_extent_type(space.id()) == H5S_NULL ? 0 : 1;
  for (const std::uint64_t n : d.shape) d.count = saturating_product(d.count, n);
  d.bytes = saturating_product(d.count, d.element_bytes);
  d.layout = H5Pget_layout(creation.id());
  d.outside = d.layout == H5D_VIRTUAL || H5Pget_external_count(creation.id()) > 0;
  if (d.layout == H5D_CHUNKED) {
    const int axes = H5Pget_chunk(creation.id(), static_cast<int>(chunk.size()), chunk.data());
    d.chunk.assign(chunk.begin(), chunk.begin() + std::clamp(axes, 0, static_cast<int>(chunk.size())));
  }
  for (int i = 0; i < H5Pget_nfilters(creation.id()); ++i) {
    unsigned flags = 0;
    std::size_t parameters = 0;
    d.filters.push_back(H5Pget_filter2(creation.id(), static_cast<unsigned>(i), &flags, &parameters, nullptr,
                                       0, nullptr, nullptr));
  }
  return d;
}

void Dataset::read(std::span<const std::int64_t> start, std::span<const std::int64_t> block_count,
                   double* out) const {
  const Silence silence;
  const std::vector<hsize_t> first(start.begin(), start.end()), n(block_count.begin(), block_count.end());
  if (first.size() != shape.size() || n.size() != shape.size())
    throw FileError(fmt::format("{}: has {} axes, {} were asked for", name, shape.size(), n.size()));
  const Handle space(H5Dget_space(id.id()), H5Sclose);
  const Handle memory(H5Screate_simple(static_cast<int>(n.size()), n.data(), nullptr), H5Sclose);
  std::optional<std::string> problem = "no such block";
  if (H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, first.data(), nullptr, n.data(), nullptr) >= 0)
    problem = read_selected(space.id(), memory.id(), out);
  if (problem)
    throw FileError(fmt::format("{}: cannot be read at [{}]: {}", name, fmt::join(start, ", "), *problem));
}

std::vector<double> Dataset::read_all() const {
  const std::uint64_t needed = checked_bytes(extents(), sizeof(double), name);
  require_memory(needed, 0, name);
  std::vector<double> values(needed / sizeof(double));
  const Silence silence;
  const Handle space(H5Dget_space(id.id()), H5Sclose);
  if (const auto problem = read_selected(space.id(), space.id(), values.data()))
    throw FileError(fmt::format("{}: cannot be read: {}", name, *problem));
  return values;
}

std::optional<std::string> Dataset::read_selected(hid_t wanted, hid_t memory, double* out) const {
  if (virtual_layout) return virtual_layout->read(wanted, memory, out);
  if (auto problem = check_chunks(*this, wanted)) return problem;
  if (H5Dread(id.id(), H5T_NATIVE_DOUBLE, memory, wanted, H5P_DEFAULT, out) < 0)
    return fmt::format("truncated or damaged (HDF5: {})", reason());
  return std::nullopt;
}

}  // namespace vdvr::io::hdf5
