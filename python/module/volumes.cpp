// Certified volumes: built, opened, verified, sampled, drawn, saved.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "arrays.hpp"
#include "asked.hpp"
#include "held_volume.hpp"
#include "long_work.hpp"
#include "parts.hpp"
#include "vdvr/certify_scan.hpp"
#include "vdvr/expert/error_slice.hpp"
#include "vdvr/expert/export_vtk.hpp"
#include "vdvr/expert/framing.hpp"
#include "vdvr/expert/journal.hpp"
#include "vdvr/expert/rows_to_verify.hpp"
#include "vdvr/read_scan.hpp"
#include "vdvr/verify_file.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace vdvr::python {
namespace {

using Held = std::shared_ptr<HeldVolume>;

std::size_t size(std::int64_t n) { return static_cast<std::size_t>(n); }

// --- where volumes come from ---

/// As the file that write_vdvr would make of it and read_vdvr would read.
Held held_of(BuildResult&& built) {
  VdvrFile file;
  file.volume = std::move(built.volume);
  file.certificate = std::move(built.certificate);
  file.certificate_json = to_json(file.certificate);
  return std::make_shared<HeldVolume>(std::move(file));
}

BuildResult certified(Device& device, const ProjectionSet& scan, const Asked& asked,
                      const CertifyOptions& options, const Progress& report) {
  const auto noise = asked.sigmas ? std::optional(known_noise(scan, asked)) : noted_noise(scan, asked);
  return certify_scan(device, scan, {asked.tolerance, asked.sigmas}, noise, options, report);
}

Held build(Device& device, const ProjectionSet& scan, const Asked& asked, const CertifyOptions& options,
           nb::handle progress) {
  Held held;
  run_long(progress,
           [&](const Progress& report) { held = held_of(certified(device, scan, asked, options, report)); });
  return held;
}

/// The same into a file, with a journal of what is finished beside it, as `vdvr build` has them.
Held build_into(Device& device, const ProjectionSet& scan, const Asked& asked, CertifyOptions options,
                const std::filesystem::path& path, bool deflate, bool resume, nb::handle progress) {
  Held held;
  run_long(progress, [&](const Progress& report) {
    Journal journal(path.string() + ".journal", resume);
    options.build.journal = &journal;
    held = held_of(certified(device, scan, asked, options, report));
    const std::lock_guard turn(hdf5_turn());
    write_vdvr(path, held->file().volume, held->file().certificate,
               deflate ? Compression::deflate : Compression::none);
    journal.remove();
  });
  return held;
}

Held open(const std::filesystem::path& path, std::uint64_t max_memory_bytes, bool unverified) {
  Held held;
  run_long(nb::none(), [&](const Progress&) {
    const std::lock_guard turn(hdf5_turn());
    held = std::make_shared<HeldVolume>(unverified ? read_vdvr(path, max_memory_bytes, Altered::report)
                                                   : read_certified(path, max_memory_bytes));
  });
  return held;
}

/// Rows that were made longer are made so once more, by verify's own means, where the scan's file is known.
FileVerification verified(Device& device, const VdvrFile& file, const ProjectionSet& scan,
                          const std::optional<ScanSource>& source, const VerifyOptions& options,
                          const Progress& report) {
  const RowExtension& e = scan.geometry.extension;
  if (!source || (e.before == 0 && e.after == 0 && !e.common_heights && scan.geometry.series.none()))
    return verify_file(device, file, scan, options, report);
  check_input(scan, file.certificate);
  ScanOptions measured = source->how;
  measured.preparation.half_acquisition = false;
  measured.preparation.padding = Padding::none;
  measured.preparation.heights = Heights::as_seen;
  ProjectionSet rows;
  {
    const std::lock_guard turn(hdf5_turn());
    rows = read_scan(source->path, measured, report);
  }
  return verify_file(
      device, file,
      rows_to_verify(std::move(rows), file.certificate.field, measured.max_memory_bytes, measured.scratch),
      options, report);
}

FileVerification verify_held(Device& device, HeldVolume& held, const ProjectionSet& scan,
                             const std::optional<ScanSource>& source, const VerifyOptions& options,
                             nb::handle progress) {
  FileVerification result;
  run_long(progress, [&](const Progress& report) {
    result = verified(device, held.file(), scan, source, options, report);
  });
  return result;
}

FileVerification verify_path(Device& device, const std::filesystem::path& path, const ProjectionSet& scan,
                             const std::optional<ScanSource>& source, const VerifyOptions& options,
                             nb::handle progress) {
  FileVerification result;
  run_long(progress, [&](const Progress& report) {
    result = verified(device, read_to_verify(path), scan, source, options, report);
  });
  return result;
}

// --- what they are asked ---

nb::object levels(HeldVolume& held) {
  const MixedVolume& v = held.file().volume;
  const Index3 n = v.bricks();
  std::vector<std::uint8_t> all;
  all.reserve(3 * v.level.size());
  for (const LevelTriple& l : v.level) all.insert(all.end(), l.begin(), l.end());
  return nb::cast(as_array(std::move(all), {size(n[2]), size(n[1]), size(n[0]), 3}));
}

nb::object values_at(HeldVolume& held, const PointArray& points) {
  std::vector<float> out(points.shape(0));
  run_long(nb::none(), [&](const Progress&) { held.points().values(points_of(points), out); });
  return nb::cast(as_array(std::move(out), {points.shape(0)}));
}

nb::object bounds_at(HeldVolume& held, const PointArray& points) {
  std::vector<float> out(points.shape(0));
  run_long(nb::none(), [&](const Progress&) { held.points().bounds(points_of(points), out); });
  return nb::cast(as_array(std::move(out), {points.shape(0)}));
}

nb::object sigmas_at(HeldVolume& held, const PointArray& points) {
  std::vector<float> out(points.shape(0));
  run_long(nb::none(), [&](const Progress&) { held.points().sigmas(points_of(points), out); });
  return nb::cast(as_array(std::move(out), {points.shape(0)}));
}

nb::object on_lattice(HeldVolume& held, const Lattice& lattice, bool bounds) {
  std::vector<float> out(size(lattice.size()));
  run_long(nb::none(), [&](const Progress& report) {
    if (bounds) held.points().bounds(lattice, out, report);
    else values_on(held.file().volume, lattice, out, report);
  });
  return nb::cast(
      as_array(std::move(out), {size(lattice.count[2]), size(lattice.count[1]), size(lattice.count[0])}));
}

// --- pictures ---

nb::object picture_of(Image&& image) {
  return nb::cast(as_array(std::move(image.rgb), {size(image.height), size(image.width), 3}));
}

nb::object values_of(FloatImage&& image) {
  if (image.channels == 1)
    return nb::cast(as_array(std::move(image.values), {size(image.height), size(image.width)}));
  return nb::cast(
      as_array(std::move(image.values), {size(image.height), size(image.width), size(image.channels)}));
}

OrbitFrame frame_of(HeldVolume& held, const RenderOptions& options, double azimuth_deg,
                    double elevation_deg) {
  OrbitFrame frame;
  run_long(nb::none(), [&](const Progress&) {
    frame = frame_view(held.file().volume, options, azimuth_deg, elevation_deg);
  });
  return frame;
}

nb::object render(HeldVolume& held, const std::shared_ptr<Device>& device, const RenderOptions& options,
                  BrickQuantity quantity, bool values) {
  RenderResult result;
  run_long(nb::none(), [&](const Progress&) { result = held.render(device, options, quantity); });
  return values ? values_of(std::move(result.values)) : picture_of(std::move(result.image));
}

/// The position is to be given.
nb::object error_picture(HeldVolume& held, const RenderOptions& o, BrickQuantity quantity, bool values) {
  const MixedVolume& v = held.file().volume;
  ErrorSlice slice;
  run_long(nb::none(), [&](const Progress&) {
    // Values have no frame.
    const ErrorSliceOptions options{o.slice_axis, o.slice_position.value(), o.width, o.height, !values};
    slice = bound_slice(v, held.file().certificate, false, options, quantity);
  });
  return values ? values_of(std::move(slice.errors)) : picture_of(std::move(slice.image));
}

// --- for VTK ---

nb::list vtk_boxes(HeldVolume& held, std::size_t most_blocks) {
  const MixedVolume& v = held.file().volume;
  std::vector<VtkBlock> blocks;
  std::vector<std::vector<float>> samples;
  run_long(nb::none(), [&](const Progress& report) {
    blocks = vtk_blocks(v, most_blocks);
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      report("vtk", static_cast<double>(i) / static_cast<double>(blocks.size()));
      samples.emplace_back(size(blocks[i].point_count()));
      vtk_block_samples(v, blocks[i], 0, samples.back());
    }
  });
  nb::list result;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Index3 n = blocks[i].points();
    result.append(nb::make_tuple(blocks[i].origin, blocks[i].spacing, blocks[i].extent,
                                 as_array(std::move(samples[i]), {size(n[2]), size(n[1]), size(n[0])})));
  }
  return result;
}

void add_verification(nb::module_& m) {
  nb::class_<VerifyOptions>(m, "VerifyOptions")
      .def(nb::init<>())
      .def_rw("exhaustive", &VerifyOptions::exhaustive)
      .def_rw("fraction", &VerifyOptions::fraction)
      .def_rw("most_of_cone", &VerifyOptions::most_of_cone)
      .def_rw("seed", &VerifyOptions::seed);
  nb::class_<FileVerification>(m, "Verification", "What `verify` found. Errors are densities.")
      .def_ro("holds", &FileVerification::holds,
              "The contents are what was certified, and the certificate holds.")
      .def_ro("failure", &FileVerification::failure, "One line; empty where it holds.")
      .def_ro("content_matches", &FileVerification::content_matches)
      .def_ro("exhaustive", &FileVerification::exhaustive)
      .def_prop_ro("total", [](const FileVerification& v) { return v.measured.total; })
      .def_prop_ro(
          "measured_max", [](const FileVerification& v) { return v.measured.measured_max; },
          "The largest |V - F| at a tested node.")
      .def_prop_ro("epsilon_abs", [](const FileVerification& v) { return v.measured.epsilon_abs; })
      .def_prop_ro(
          "worst_at", [](const FileVerification& v) { return v.measured.worst_at; }, "x, y, z.")
      .def_prop_ro("bricks_tested", [](const FileVerification& v) { return v.measured.bricks_tested; })
      .def_prop_ro(
          "differences", [](const FileVerification& v) { return v.measured.differences; },
          "What the certificate says and what was computed instead, a line each.")
      .def("__bool__", [](const FileVerification& v) { return v.holds; });
  m.def("verify_held", &verify_held, "device"_a, "volume"_a, "scan"_a, "source"_a.none(), "options"_a,
        "progress"_a.none());
  m.def("verify_path", &verify_path, "device"_a, "path"_a, "scan"_a, "source"_a.none(), "options"_a,
        "progress"_a.none());
}

}  // namespace

void add_volumes(nb::module_& m) {
  nb::class_<Lattice>(m, "Lattice", "Equally spaced points; all triples are x, y, z.")
      .def_prop_ro(
          "origin",
          [](const Lattice& l) {
            return l.position({0, 0, 0});
          },
          "Of the first point.")
      .def_ro("spacing", &Lattice::spacing)
      .def_ro("count", &Lattice::count);
  nb::class_<HeldVolume>(m, "HeldVolume")
      .def_prop_ro("certificate_json", [](HeldVolume& h) { return h.file().certificate_json; })
      .def_prop_ro("epsilon", [](HeldVolume& h) { return h.file().certificate.epsilon; })
      .def_prop_ro("epsilon_abs", [](HeldVolume& h) { return h.file().certificate.epsilon_abs; })
      .def_prop_ro("grid", [](HeldVolume& h) { return h.file().volume.grid; })
      .def_prop_ro("granularity", [](HeldVolume& h) { return h.file().volume.granularity; })
      .def_prop_ro("altered", [](HeldVolume& h) { return h.file().altered; })
      .def_prop_ro("content_sha256", [](HeldVolume& h) { return content_sha256(h.file().volume); })
      .def_prop_ro("has_geometry",
                   [](HeldVolume& h) { return noted_geometry(h.file().certificate).has_value(); })
      // Whoever draws holds the lock that it takes.
      .def_prop_ro(
          "brightness", [](HeldVolume& h) { return h.brightness(); },
          nb::call_guard<nb::gil_scoped_release>())
      .def("levels", &levels)
      .def("values", &values_at, "points"_a)
      .def("bounds", &bounds_at, "points"_a)
      .def("sigmas", &sigmas_at, "points"_a)
      .def(
          "lattice",
          [](HeldVolume& h, std::optional<Vec3> spacing, std::optional<std::array<double, 6>> box) {
            return lattice_in(h.file().volume.grid, spacing, box);
          },
          "spacing"_a.none(), "box"_a.none())
      .def("on_lattice", &on_lattice, "lattice"_a, "bounds"_a)
      .def("frame_view", &frame_of, "options"_a, "azimuth_deg"_a, "elevation_deg"_a)
      .def("render", &render, "device"_a, "options"_a, "quantity"_a, "values"_a)
      .def("error_picture", &error_picture, "options"_a, "quantity"_a, "values"_a)
      .def("vtk_boxes", &vtk_boxes, "most_blocks"_a)
      .def("release", &HeldVolume::release, nb::call_guard<nb::gil_scoped_release>())
      .def(
          "save",
          [](HeldVolume& h, const std::filesystem::path& path, bool deflate) {
            run_long(nb::none(), [&](const Progress&) {
              const std::lock_guard turn(hdf5_turn());
              write_vdvr(path, h.file().volume, h.file().certificate,
                         deflate ? Compression::deflate : Compression::none);
            });
          },
          "path"_a, "deflate"_a);
  m.def("build", &build, "device"_a, "scan"_a, "asked"_a, "options"_a, "progress"_a.none());
  m.def("build_into", &build_into, "device"_a, "scan"_a, "asked"_a, "options"_a, "path"_a, "deflate"_a,
        "resume"_a, "progress"_a.none());
  m.def("open", &open, "path"_a, "max_memory_bytes"_a, "unverified"_a);
  add_verification(m);
}

}  // namespace vdvr::python
