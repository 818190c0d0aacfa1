// HDF5 behind handles and exceptions; see hdf5.hpp.
#include "host/io/hdf5.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "host/system/limits.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io::hdf5 {
namespace {

// After a damaged or half-written file, or one whose last flush failed (disk full), HDF5 1.10 keeps objects
// that nobody holds a handle to; its exit handler tries a hundred times to close them, prints "infinite loop
// closing library", or crashes. Every handle here is closed by its owner, so the handler has nothing to do.
// Before main: only before HDF5's first use does the call have an effect.
[[maybe_unused]] const herr_t without_exit_handler = H5dont_atexit();

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

void Dataset::read(std::span<const std::int64_t> start, std::span<const std::int64_t> block_count,
                   double* out) const {
  const Silence silence;
  const std::vector<hsize_t> first(start.begin(), start.end()), n(block_count.begin(), block_count.end());
  if (first.size() != shape.size() || n.size() != shape.size())
    throw FileError(fmt::format("{}: has {} axes, {} were asked for", name, shape.size(), n.size()));
  const Handle space(H5Dget_space(id.id()), H5Sclose);
  const Handle memory(H5Screate_simple(static_cast<int>(n.size()), n.data(), nullptr), H5Sclose);
  if (H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, first.data(), nullptr, n.data(), nullptr) < 0 ||
      H5Dread(id.id(), H5T_NATIVE_DOUBLE, memory.id(), space.id(), H5P_DEFAULT, out) < 0)
    throw FileError(fmt::format("{}: cannot be read at [{}], truncated or damaged (HDF5: {})", name,
                                fmt::join(start, ", "), reason()));
}

std::vector<double> Dataset::read_all() const {
  const std::uint64_t needed = checked_bytes(extents(), sizeof(double), name);
  require_memory(needed, 0, name);
  std::vector<double> values(needed / sizeof(double));
  const Silence silence;
  if (H5Dread(id.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
    throw FileError(fmt::format("{}: cannot be read, truncated or damaged (HDF5: {})", name, reason()));
  return values;
}

}  // namespace vdvr::io::hdf5
