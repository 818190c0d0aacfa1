// Anybody's volume against F, as a dictionary with the names that `vdvr audit --json` has.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <utility>

#include "long_work.hpp"
#include "parts.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/audit.hpp"
#include "vdvr/expert/volume_file.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace vdvr::python {
namespace {

using SampleArray = nb::ndarray<const float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

nb::dict dict_of(const AuditFigures& f, Between between) {
  nb::dict d;
  d["samples"] = f.samples;
  d["range"] = f.range;
  d["rms"] = f.rms;
  d["largest"] = f.largest;
  d["largest_at"] = f.largest_at;
  d["interpolation"] = text_of(between);
  d["lower"] = f.lower;
  d["lower_at"] = f.lower_at;
  d["volume_there"] = f.w_there;
  d["field_there"] = f.f_there;
  d["upper"] = f.upper;
  d["why_no_upper"] = f.why_no_upper;
  return d;
}

nb::dict dict_of(const Registration& r) {
  nb::dict d;
  d["found"] = r.words;
  d["doubt"] = r.doubt;
  d["axes"] = r.axes;
  d["mirrored"] = r.mirrored;
  d["scale"] = r.scale;
  d["offset"] = r.offset;
  d["shift_samples"] = r.shift;
  d["center_off"] = r.center;
  d["filter"] = text_of(r.window);
  d["unexplained"] = r.unexplained;
  d["unexplained_registered"] = r.unexplained_registered;
  return d;
}

nb::dict audited(Device& device, const ProjectionSet& scan, Volume volume, const PlaceOptions& place,
                 const AuditOptions& options, nb::handle progress) {
  Audit found;
  run_long(progress, [&](const Progress& report) {
    const PlacedVolume placed = placed_volume(std::move(volume), scan, options.field, place);
    found = audit(device, scan, placed.volume, options, report);
  });
  nb::dict d;
  d["registration"] = found.registration ? nb::object(dict_of(*found.registration)) : nb::object(nb::none());
  d["as_is"] = dict_of(found.as_is, options.between);
  d["registered"] =
      found.registered ? nb::object(dict_of(*found.registered, options.between)) : nb::object(nb::none());
  d["within"] = found.as_is.within;
  d["met"] = !found.as_is.within || (found.as_is.upper && *found.as_is.upper <= *found.as_is.within);
  return d;
}

Volume volume_of(const SampleArray& array) {
  Volume v;
  for (std::size_t a = 0; a < 3; ++a) {
    if (array.shape(2 - a) < 2) throw InputError("volume: an axis of fewer than two samples");
    v.grid.cells[a] = static_cast<std::int64_t>(array.shape(2 - a)) - 1;
  }
  v.samples.assign(array.data(), array.data() + array.size());
  return v;
}

}  // namespace

void add_audits(nb::module_& m) {
  nb::enum_<Between>(m, "Between")
      .value("nearest", Between::nearest)
      .value("linear", Between::linear)
      .value("cubic", Between::cubic);
  nb::class_<PlaceOptions>(m, "PlaceOptions")
      .def(nb::init<>())
      .def_rw("spacing", &PlaceOptions::spacing, nb::arg().none())
      .def_rw("origin", &PlaceOptions::origin, nb::arg().none());
  nb::class_<AuditOptions>(m, "AuditOptions")
      .def(nb::init<>())
      .def_rw("field", &AuditOptions::field)
      .def_rw("between", &AuditOptions::between)
      .def_rw("as_is", &AuditOptions::as_is)
      .def_rw("radius", &AuditOptions::radius, nb::arg().none())
      .def_rw("roi", &AuditOptions::roi, nb::arg().none())
      .def_rw("within", &AuditOptions::within, nb::arg().none())
      .def_rw("within_share", &AuditOptions::within_share);
  m.def(
      "audit",
      [](Device& device, const ProjectionSet& scan, const SampleArray& volume, const PlaceOptions& place,
         const AuditOptions& options,
         nb::handle progress) { return audited(device, scan, volume_of(volume), place, options, progress); },
      "device"_a, "scan"_a, "volume"_a, "place"_a, "options"_a, "progress"_a.none());
  m.def(
      "audit_file",
      [](Device& device, const ProjectionSet& scan, const std::filesystem::path& path,
         const PlaceOptions& place, const AuditOptions& options,
         nb::handle progress) { return audited(device, scan, read_volume(path), place, options, progress); },
      "device"_a, "scan"_a, "path"_a, "place"_a, "options"_a, "progress"_a.none());
}

}  // namespace vdvr::python
