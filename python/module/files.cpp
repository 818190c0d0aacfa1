// Files that stay on the disk, of which parts are read.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <vector>

#include "arrays.hpp"
#include "long_work.hpp"
#include "parts.hpp"
#include "vdvr/expert/lazy_volume.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace vdvr::python {
namespace {

/// The points [first, end) of a lattice, x, y, z.
Lattice part_of(Lattice lattice, const Index3& first, const Index3& end) {
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(0 <= first[a] && first[a] < end[a] && end[a] <= lattice.count[a]))
      throw nb::index_error("a part that is not within its lattice");
    lattice.first[a] += first[a];
    lattice.count[a] = end[a] - first[a];
  }
  return lattice;
}

nb::object read_part(LazyVolume& file, const Lattice& whole, const Index3& first, const Index3& end,
                     bool bounds) {
  const Lattice lattice = part_of(whole, first, end);
  std::vector<float> out(static_cast<std::size_t>(lattice.size()));
  run_long(nb::none(), [&](const Progress& report) {
    const std::lock_guard turn(hdf5_turn());
    if (bounds) file.bounds_on(lattice, out, report);
    else file.values_on(lattice, out, report);
  });
  return nb::cast(as_array(
      std::move(out), {static_cast<std::size_t>(lattice.count[2]), static_cast<std::size_t>(lattice.count[1]),
                       static_cast<std::size_t>(lattice.count[0])}));
}

}  // namespace

void add_files(nb::module_& m) {
  nb::class_<LazyVolume>(m, "LazyVolume",
                         "A .vdvr file of which those samples alone are read that are asked for.")
      .def(
          "__init__",
          [](LazyVolume* self, const std::filesystem::path& path, std::uint64_t max_memory_bytes) {
            run_long(nb::none(), [&](const Progress&) {
              const std::lock_guard turn(hdf5_turn());
              new (self) LazyVolume(path, max_memory_bytes);
            });
          },
          "path"_a, "max_memory_bytes"_a)
      .def_prop_ro("grid", &LazyVolume::grid)
      .def_prop_ro("certificate_json", [](const LazyVolume& v) { return v.file().certificate_json; })
      .def_prop_ro("epsilon", [](const LazyVolume& v) { return v.file().certificate.epsilon; })
      .def_prop_ro("epsilon_abs", [](const LazyVolume& v) { return v.file().certificate.epsilon_abs; })
      .def_prop_ro(
          "content_sha256", [](const LazyVolume& v) { return v.file().certificate.content_sha256; },
          "As the certificate says; not compared.")
      .def_prop_ro("bytes_read", &LazyVolume::bytes_read, "Of samples, as they are stored.")
      .def_prop_ro("bytes_stored", &LazyVolume::bytes_stored)
      .def(
          "lattice",
          [](const LazyVolume& v, std::optional<Vec3> spacing, std::optional<std::array<double, 6>> box) {
            return lattice_in(v.grid(), spacing, box);
          },
          "spacing"_a.none(), "box"_a.none())
      .def("read", &read_part, "lattice"_a, "first"_a, "end"_a, "bounds"_a);
}

}  // namespace vdvr::python
