// Devices, scans, and what is made of them: centres, slices, plans.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "arrays.hpp"
#include "asked.hpp"
#include "long_work.hpp"
#include "parts.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/certify.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/find_center.hpp"
#include "vdvr/expert/find_roll.hpp"
#include "vdvr/expert/preparation.hpp"
#include "vdvr/expert/reconstruct.hpp"
#include "vdvr/expert/scan_of_array.hpp"
#include "vdvr/expert/scratch.hpp"
#include "vdvr/read_scan.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace vdvr::python {
namespace {

using Projections = nb::ndarray<const float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

/// Holds a Python object until the last copy is gone, in whatever thread that is.
std::shared_ptr<const void> kept_alive(nb::object object) {
  return {object.release().ptr(), [](PyObject* held) {
            if (!Py_IsInitialized()) return;
            const nb::gil_scoped_acquire interpreter;
            Py_DECREF(held);
          }};
}

std::shared_ptr<ProjectionSet> scan_of(const Projections& array, ArrayScan described) {
  described.rows = static_cast<std::int64_t>(array.shape(1));
  described.columns = static_cast<std::int64_t>(array.shape(2));
  auto scan = std::make_shared<ProjectionSet>();
  // The array itself: nothing writes to a scan's samples, though their type has no const.
  const std::span<float> samples(const_cast<float*>(array.data()), array.size());
  SampleArray data(samples, kept_alive(nb::find(array)));
  run_long(nb::none(), [&](const Progress&) { *scan = scan_of_array(std::move(data), described); });
  return scan;
}

// Rows that were made longer are given as they were measured.
std::shared_ptr<ProjectionSet> measured(const std::shared_ptr<ProjectionSet>& scan) {
  const RowExtension& e = scan->geometry.extension;
  return e.before == 0 && e.after == 0 ? scan : std::make_shared<ProjectionSet>(own_rows(*scan));
}

nb::object data_of(const std::shared_ptr<ProjectionSet>& of) {
  const std::shared_ptr<ProjectionSet> scan = measured(of);
  const ParallelGeometry& g = scan->geometry;
  const std::size_t shape[3]{static_cast<std::size_t>(g.views()), static_cast<std::size_t>(g.rows),
                             static_cast<std::size_t>(g.columns)};
  return nb::cast(
      nb::ndarray<nb::numpy, const float>(std::as_const(scan->data).data(), 3, shape, nb::find(scan)));
}

/// float [z][y][x] of so many samples x, y, z. A grid has a cell at least along each axis: of one sample the
/// second is dropped.
nb::object on_grid(Device& device, const ProjectionSet& scan, const Index3& samples, double spacing,
                   double spacing_z, const Vec3& origin, const ReconstructOptions& options,
                   nb::handle progress) {
  GridOptions wanted;
  wanted.size.emplace();
  for (std::size_t a = 0; a < 3; ++a) (*wanted.size)[a] = std::max<std::int64_t>(1, samples[a] - 1);
  wanted.spacing = spacing;
  wanted.spacing_z = spacing_z;
  wanted.origin = origin;
  Volume volume;
  run_long(progress, [&](const Progress& report) {
    volume = reconstruct(device, scan, make_grid(scan.geometry, wanted), options, report);
  });
  const Index3 n = volume.grid.samples();
  const nb::object all = nb::cast(as_array(
      std::move(volume.samples),
      {static_cast<std::size_t>(n[2]), static_cast<std::size_t>(n[1]), static_cast<std::size_t>(n[0])}));
  return all[nb::make_tuple(nb::slice(samples[2]), nb::slice(samples[1]), nb::slice(samples[0]))];
}

nb::object slices(Device& device, const ProjectionSet& scan, const ReconstructOptions& options,
                  nb::handle progress) {
  Volume volume;
  run_long(progress, [&](const Progress& report) {
    volume = reconstruct(device, scan, slices_of_rows(scan.geometry), options, report);
  });
  const Index3 n = volume.grid.samples();
  return nb::cast(as_array(
      std::move(volume.samples),
      {static_cast<std::size_t>(n[2]), static_cast<std::size_t>(n[1]), static_cast<std::size_t>(n[0])}));
}

void add_devices(nb::module_& m) {
  nb::class_<DeviceInfo>(m, "DeviceInfo", "What an OpenCL device is.")
      .def_ro("index", &DeviceInfo::index)
      .def_ro("platform", &DeviceInfo::platform)
      .def_ro("name", &DeviceInfo::name)
      .def_ro("driver", &DeviceInfo::driver)
      .def_ro("is_gpu", &DeviceInfo::is_gpu)
      .def_ro("is_cpu", &DeviceInfo::is_cpu)
      .def_ro("global_memory", &DeviceInfo::global_memory, "Bytes.");
  nb::class_<Device>(m, "Device")
      .def(nb::init<const std::string&, std::uint64_t>(), "selector"_a, "max_memory_bytes"_a)
      .def_static("list", &Device::list)
      .def_prop_ro("info", &Device::info)
      .def_prop_ro("peak_memory", &Device::peak_memory);
  m.def("half_of_free_memory", &half_of_free_memory);
}

void add_geometry(nb::module_& m) {
  nb::class_<Grid>(m, "Grid", "Cells of a grid in world space; all triples are x, y, z.")
      .def_ro("cells", &Grid::cells)
      .def_ro("origin", &Grid::origin, "Of the first sample, in `unit`.")
      .def_ro("spacing", &Grid::spacing, "Of samples, in `unit`.")
      .def_ro("unit", &Grid::unit)
      .def_prop_ro("samples", &Grid::samples, "One more than cells.");
  nb::enum_<RampWindow>(m, "RampWindow")
      .value("ram-lak", RampWindow::ram_lak)
      .value("shepp-logan", RampWindow::shepp_logan)
      .value("cosine", RampWindow::cosine)
      .value("hamming", RampWindow::hamming)
      .value("hann", RampWindow::hann);
  nb::enum_<Interpolation>(m, "Interpolation")
      .value("linear", Interpolation::linear)
      .value("cubic", Interpolation::cubic)
      .value("six-taps", Interpolation::six_taps)
      .value("eight-taps", Interpolation::eight_taps);
  nb::class_<FieldOptions>(m, "FieldOptions")
      .def(nb::init<>())
      .def_rw("filter", &FieldOptions::filter)
      .def_rw("cutoff", &FieldOptions::cutoff)
      .def_rw("center", &FieldOptions::center);
  nb::class_<Outliers>(m, "Outliers")
      .def(nb::init<>())
      .def_rw("threshold", &Outliers::threshold)
      .def_rw("window", &Outliers::window);
  nb::class_<PhaseRetrieval>(m, "PhaseRetrieval")
      .def(nb::init<>())
      .def_rw("distance_mm", &PhaseRetrieval::distance_mm)
      .def_rw("energy_kev", &PhaseRetrieval::energy_kev)
      .def_rw("delta_beta", &PhaseRetrieval::delta_beta);
  nb::class_<Stripes>(m, "Stripes")
      .def(nb::init<>())
      .def_rw("ratio", &Stripes::ratio)
      .def_rw("large", &Stripes::large)
      .def_rw("small", &Stripes::small);
  nb::enum_<Padding>(m, "Padding")
      .value("none", Padding::none)
      .value("edge", Padding::edge)
      .value("mirror", Padding::mirror);
  nb::enum_<Heights>(m, "Heights").value("common", Heights::common).value("all", Heights::all);
  nb::class_<Preparation>(m, "Preparation")
      .def(nb::init<>())
      .def_rw("outliers", &Preparation::outliers)
      .def_rw("phase", &Preparation::phase)
      .def_rw("stripes", &Preparation::stripes)
      .def_rw("median", &Preparation::median)
      .def_rw("gaussian", &Preparation::gaussian)
      .def_rw("binning", &Preparation::binning)
      .def_rw("half_acquisition", &Preparation::half_acquisition)
      .def_rw("padding", &Preparation::padding)
      .def_rw("heights", &Preparation::heights)
      .def_rw("flats_in_time", &Preparation::flats_in_time)
      .def_rw("beam_current", &Preparation::beam_current)
      .def("__str__", [](const Preparation& p) { return text_of(p); });
}

void add_projections(nb::module_& m) {
  nb::enum_<SampleValues>(m, "SampleValues")
      .value("counts", SampleValues::counts)
      .value("transmission", SampleValues::transmission)
      .value("line integrals", SampleValues::line_integrals);
  nb::enum_<AngleUnit>(m, "AngleUnit")
      .value("degrees", AngleUnit::degrees)
      .value("radians", AngleUnit::radians);
  nb::class_<InputStatement>(m, "InputStatement")
      .def(nb::init<>())
      .def_rw("entry", &InputStatement::entry)
      .def_rw("views", &InputStatement::views)
      .def_rw("dark", &InputStatement::dark)
      .def_rw("flat", &InputStatement::flat)
      .def_rw("values", &InputStatement::values)
      .def_rw("angle_unit", &InputStatement::angle_unit)
      .def_rw("beam_current", &InputStatement::beam_current)
      .def_rw("axis_roll_deg", &InputStatement::axis_roll_deg)
      .def("__str__", [](const InputStatement& s) { return text_of(s); });
  nb::class_<Understood>(m, "Understood", "What was understood of a scan's files.")
      .def(nb::init<>())
      .def_ro("stated", &Understood::stated)
      .def_ro("warnings", &Understood::warnings, "What makes the scan doubtful, a line each.");
  m.def("view_ranges_of", &view_ranges_of, "text"_a);
  nb::enum_<Beam>(m, "Beam").value("parallel", Beam::parallel).value("cone", Beam::cone);
  nb::class_<ScanOptions>(m, "ScanOptions")
      .def(nb::init<>())
      .def_rw("angles_file", &ScanOptions::angles_file)
      .def_rw("center", &ScanOptions::center)
      .def_rw("shifts", &ScanOptions::shifts)
      .def_rw("preparation", &ScanOptions::preparation)
      .def_rw("beam", &ScanOptions::beam)
      .def_rw("input", &ScanOptions::input)
      .def_rw("max_memory_bytes", &ScanOptions::max_memory_bytes)
      .def_rw("follow_links", &ScanOptions::follow_links);
  nb::class_<ArrayScan>(m, "ArrayScan")
      .def(nb::init<>())
      .def_rw("angles_deg", &ArrayScan::angles_deg)
      .def_rw("center", &ArrayScan::center)
      .def_rw("half_acquisition", &ArrayScan::half_acquisition)
      .def_rw("padding", &ArrayScan::padding)
      .def_rw("heights", &ArrayScan::heights)
      .def_rw("shifts", &ArrayScan::shifts)
      .def_rw("axis_roll_deg", &ArrayScan::axis_roll_deg)
      .def_rw("pitch_u", &ArrayScan::pitch_u)
      .def_rw("pitch_v", &ArrayScan::pitch_v)
      .def_rw("unit", &ArrayScan::unit)
      .def_rw("name", &ArrayScan::name);
  nb::class_<ProjectionSet>(m, "ProjectionSet")
      .def_prop_ro("columns", [](const ProjectionSet& s) { return own_detector(s.geometry).columns; })
      .def_prop_ro("rows", [](const ProjectionSet& s) { return s.geometry.rows; })
      .def_prop_ro("center", [](const ProjectionSet& s) { return stated_center({}, s.geometry); })
      .def_prop_ro("axis_roll_deg", [](const ProjectionSet& s) { return s.geometry.axis_roll_deg; })
      .def_prop_ro("pitch",
                   [](const ProjectionSet& s) {
                     return std::array{s.geometry.pitch_u, s.geometry.pitch_v};
                   })
      .def_prop_ro("unit", [](const ProjectionSet& s) { return s.geometry.unit; })
      .def_prop_ro("theta_rad", [](const ProjectionSet& s) { return s.geometry.theta_rad; })
      .def_prop_ro("angles_deg", [](const ProjectionSet& s) { return degrees_of(s.geometry.theta_rad); })
      .def_prop_ro("column_shift", [](const ProjectionSet& s) { return s.geometry.column_shift; })
      .def_prop_ro("row_shift",
                   [](const ProjectionSet& s) {
                     return s.geometry.series.none() ? s.geometry.row_shift : s.geometry.series.row_shift;
                   })
      .def_prop_ro("is_cone", [](const ProjectionSet& s) { return s.cone.has_value(); })
      .def_prop_ro("name", [](const ProjectionSet& s) { return s.report.name; })
      .def_prop_ro("sha256", [](const ProjectionSet& s) { return s.report.sha256; })
      .def_prop_ro("center_source", [](const ProjectionSet& s) { return s.report.center_source; })
      .def_prop_ro("notes", [](const ProjectionSet& s) { return s.report.notes; })
      .def_prop_ro("preparation", [](const ProjectionSet& s) { return s.report.preparation; });
  m.def("data_of", &data_of, "scan"_a);
  m.def("scan_of", &scan_of, "array"_a.noconvert(), "described"_a);
  m.def(
      "read_scan",
      [](const std::filesystem::path& path, const ScanOptions& options, nb::handle progress) {
        auto scan = std::make_shared<ProjectionSet>();
        Understood understood;
        run_long(progress, [&](const Progress& report) {
          const std::lock_guard turn(hdf5_turn());
          *scan = read_scan(path, options, report, &understood);
          for (auto& note : check_scan(*scan)) scan->report.notes.push_back(std::move(note));
        });
        return std::pair(scan, understood);
      },
      "path"_a, "options"_a, "progress"_a.none());
  m.def(
      "write_data_exchange",
      [](const std::filesystem::path& path, const ProjectionSet& scan) {
        run_long(nb::none(), [&](const Progress&) {
          const std::lock_guard turn(hdf5_turn());
          write_data_exchange(path, own_rows(scan));
        });
      },
      "path"_a, "scan"_a);
  nb::class_<ScanSource>(m, "ScanSource")
      .def(
          "__init__",
          [](ScanSource* self, const std::filesystem::path& path, const ScanOptions& how) {
            new (self) ScanSource{path, how};
          },
          "path"_a, "how"_a);
  nb::class_<ScanNoise>(m, "ScanNoise", "What is known of a scan's noise, and from where (docs/noise.md).")
      .def_prop_ro(
          "source", [](const ScanNoise& n) { return n.model.source; },
          "\"stated\", \"flats\", \"second differences\" or \"empty wedge\".")
      .def_prop_ro(
          "photons",
          [](const ScanNoise& n) {
            return n.model.photons > 0 ? std::optional(n.model.photons) : std::nullopt;
          },
          "Of a pixel in the open beam; None where all line integrals have one standard deviation.")
      .def_prop_ro(
          "sigma_p",
          [](const ScanNoise& n) {
            return n.model.constant > 0 ? std::optional(std::sqrt(n.model.constant)) : std::nullopt;
          },
          "The standard deviation of line integrals, where all have one.")
      .def_ro("by_flats", &ScanNoise::by_flats)
      .def_ro("by_differences", &ScanNoise::by_differences)
      .def_ro("by_wedge", &ScanNoise::by_wedge)
      .def_ro("agreed", &ScanNoise::agreed, "Whether it was stated, or two sources agree within 1.5.")
      .def_ro("passed", &ScanNoise::passed, "Share of the variance that passed the preparation.")
      .def("__str__", [](const ScanNoise& n) { return n.words; });
  m.def(
      "noise_of",
      [](const ProjectionSet& scan, const std::optional<ScanSource>& source, std::optional<double> photons,
         std::optional<double> sigma_p) {
        std::optional<ScanNoise> noise;
        std::string why;
        run_long(nb::none(), [&](const Progress&) {
          noise = find_noise(scan, {photons, sigma_p}, source, why);
        });
        if (!noise) throw InputError("noise: none is known: " + why);
        return *noise;
      },
      "scan"_a, "source"_a.none(), "photons"_a.none(), "sigma_p"_a.none());
  m.def(
      "degrees_of", [](const std::vector<double>& radians) { return degrees_of(radians); }, "radians"_a);
  nb::class_<CenterWitness>(m, "CenterWitness", "What one method says of the axis' column.")
      .def_ro("center", &CenterWitness::center, "Column; its middle is an integer.")
      .def_ro("uncertainty", &CenterWitness::uncertainty, "Columns; one standard deviation.")
      .def_ro("quality", &CenterWitness::quality, "0 to 1: the share that this centre explains.")
      .def_ro("method", &CenterWitness::method);
  nb::class_<CenterEstimate, CenterWitness>(m, "CenterEstimate",
                                            "The column of the axis, and how sure it is.")
      .def_ro("sure", &CenterEstimate::sure, "Whether two methods agree within a quarter of a column.")
      .def_ro("doubt", &CenterEstimate::doubt, "Why it is not sure.")
      .def_ro("others", &CenterEstimate::others, "What the other methods say.");
  nb::class_<RollEstimate>(m, "RollEstimate", "How far the axis leans in the detector's plane.")
      .def_ro("roll_deg", &RollEstimate::roll_deg, "Degrees; towards higher columns at higher rows.")
      .def_ro("uncertainty_deg", &RollEstimate::uncertainty_deg, "One standard deviation.")
      .def_ro("significant", &RollEstimate::significant, "Whether it is off what the scan was read with.")
      .def_ro("pairs", &RollEstimate::pairs, "Of views from either side.")
      .def_ro("method", &RollEstimate::method);
  m.def(
      "find_roll",
      [](const ProjectionSet& scan) {
        std::optional<RollEstimate> found;
        run_long(nb::none(), [&](const Progress&) { found = find_roll(own_rows(scan)); });
        return found;
      },
      "scan"_a);
  m.def(
      "find_center",
      [](const ProjectionSet& scan) {
        std::optional<CenterEstimate> found;
        run_long(nb::none(), [&](const Progress&) { found = find_center(own_rows(scan)); });
        return found;
      },
      "scan"_a);
  nb::class_<ReconstructOptions>(m, "ReconstructOptions")
      .def(nb::init<>())
      .def_rw("field", &ReconstructOptions::field)
      .def_rw("upsampling", &ReconstructOptions::upsampling)
      .def_rw("interpolation", &ReconstructOptions::interpolation);
  m.def("on_grid", &on_grid, "device"_a, "scan"_a, "samples"_a, "spacing"_a, "spacing_z"_a, "origin"_a,
        "options"_a, "progress"_a.none());
  m.def("slices", &slices, "device"_a, "scan"_a, "options"_a, "progress"_a.none());
}

void add_plans(nb::module_& m) {
  nb::enum_<Levels>(m, "Levels")
      .value("isotropic", Levels::isotropic)
      .value("anisotropic", Levels::anisotropic);
  nb::enum_<StorageChoice>(m, "StorageChoice")
      .value("auto", StorageChoice::automatic)
      .value("f32", StorageChoice::f32)
      .value("u16", StorageChoice::u16)
      .value("u8", StorageChoice::u8);
  nb::enum_<Coefficients>(m, "Coefficients")
      .value("midrange", Coefficients::midrange)
      .value("sampled", Coefficients::sampled);
  nb::enum_<Terms>(m, "Terms").value("all", Terms::all).value("grid", Terms::grid);
  nb::enum_<Closing>(m, "Closing")
      .value("coarse", Closing::coarse)
      .value("paper", Closing::paper)
      .value("none", Closing::none);
  nb::class_<Comparison>(m, "Comparison")
      .def(nb::init<>())
      .def_rw("coefficients", &Comparison::coefficients)
      .def_rw("terms", &Comparison::terms)
      .def_rw("closing", &Comparison::closing)
      .def_rw("epsilon_of_max", &Comparison::epsilon_of_max);
  nb::class_<Asked>(m, "Asked")
      .def(nb::init<>())
      .def_prop_rw(
          "relative", [](const Asked& a) { return a.tolerance.relative; },
          [](Asked& a, std::optional<double> value) { a.tolerance.relative = value; }, nb::arg().none())
      .def_prop_rw(
          "absolute", [](const Asked& a) { return a.tolerance.absolute; },
          [](Asked& a, std::optional<double> value) { a.tolerance.absolute = value; }, nb::arg().none())
      .def_rw("sigmas", &Asked::sigmas)
      .def_prop_rw(
          "photons", [](const Asked& a) { return a.noise.photons; },
          [](Asked& a, std::optional<double> value) { a.noise.photons = value; }, nb::arg().none())
      .def_prop_rw(
          "sigma_p", [](const Asked& a) { return a.noise.sigma_p; },
          [](Asked& a, std::optional<double> value) { a.noise.sigma_p = value; }, nb::arg().none())
      .def_rw("source", &Asked::source, nb::arg().none());
  nb::class_<CertifyOptions>(m, "CertifyOptions")
      .def(nb::init<>())
      .def_rw("field", &CertifyOptions::field)
      .def_rw("input", &CertifyOptions::input)
      .def_prop_rw(
          "size", [](const CertifyOptions& o) { return o.grid.size; },
          [](CertifyOptions& o, std::optional<Index3> size) { o.grid.size = size; }, nb::arg().none())
      .def_prop_rw(
          "spacing", [](const CertifyOptions& o) { return o.grid.spacing; },
          [](CertifyOptions& o, std::optional<double> spacing) { o.grid.spacing = spacing; },
          nb::arg().none())
      .def_prop_rw(
          "spacing_z", [](const CertifyOptions& o) { return o.grid.spacing_z; },
          [](CertifyOptions& o, std::optional<double> spacing) { o.grid.spacing_z = spacing; },
          nb::arg().none())
      .def_prop_rw(
          "origin", [](const CertifyOptions& o) { return o.grid.origin; },
          [](CertifyOptions& o, std::optional<Vec3> origin) { o.grid.origin = origin; }, nb::arg().none())
      .def_prop_rw(
          "upsampling", [](const CertifyOptions& o) { return o.rates.upsampling; },
          [](CertifyOptions& o, std::optional<int> n) { o.rates.upsampling = n; }, nb::arg().none())
      .def_prop_rw(
          "u_filter", [](const CertifyOptions& o) { return o.rates.interpolation; },
          [](CertifyOptions& o, std::optional<Interpolation> i) { o.rates.interpolation = i; },
          nb::arg().none())
      .def_prop_rw(
          "gold", [](const CertifyOptions& o) { return o.rates.gold; },
          [](CertifyOptions& o, std::optional<int> n) { o.rates.gold = n; }, nb::arg().none())
      .def_prop_rw(
          "forecast", [](const CertifyOptions& o) { return o.plan.forecast; },
          [](CertifyOptions& o, bool forecast) { o.plan.forecast = forecast; })
      .def_prop_rw(
          "levels", [](const CertifyOptions& o) { return o.plan.levels; },
          [](CertifyOptions& o, Levels levels) { o.plan.levels = levels; })
      .def_prop_rw(
          "granularity", [](const CertifyOptions& o) { return o.plan.granularity; },
          [](CertifyOptions& o, int n) { o.plan.granularity = n; })
      .def_prop_rw(
          "comparison", [](const CertifyOptions& o) { return o.plan.comparison; },
          [](CertifyOptions& o, const Comparison& c) { o.plan.comparison = c; })
      .def_prop_rw(
          "coarsening", [](const CertifyOptions& o) { return o.plan.coarsening; },
          [](CertifyOptions& o, std::optional<LevelTriple> c) { o.plan.coarsening = c; }, nb::arg().none())
      .def_prop_rw(
          "window", [](const CertifyOptions& o) { return o.build.window; },
          [](CertifyOptions& o, std::optional<std::pair<double, double>> w) { o.build.window = w; },
          nb::arg().none())
      .def_prop_rw(
          "storage", [](const CertifyOptions& o) { return o.build.storage; },
          [](CertifyOptions& o, StorageChoice s) { o.build.storage = s; })
      .def_prop_rw(
          "roi", [](const CertifyOptions& o) { return o.build.roi; },
          [](CertifyOptions& o, std::optional<std::array<double, 6>> roi) { o.build.roi = roi; },
          nb::arg().none());
  nb::class_<Rates>(m, "Rates", "How densely projections and gold are sampled.")
      .def_ro("upsampling", &Rates::upsampling)
      .def_ro("interpolation", &Rates::interpolation)
      .def_ro("gold", &Rates::gold);
  nb::class_<Plan>(m, "Plan",
                   "What a build would do and cost. Lengths in the scan's unit, densities per unit length.")
      .def_ro("grid", &Plan::grid)
      .def_ro("epsilon", &Plan::epsilon, "The tolerance as a fraction of `reference_range`.")
      .def_ro("epsilon_abs", &Plan::epsilon_abs, "The same as a density.")
      .def_ro("reference_range", &Plan::reference_range,
              "Density: maximum less minimum of F at covered samples.")
      .def_ro("rates", &Plan::rates)
      .def_ro("gold_samples", &Plan::gold_samples)
      .def_ro("memory_bytes", &Plan::memory_bytes, "Foreseen at the peak.")
      .def_ro("seconds", &Plan::seconds, "Foreseen for `build`.")
      .def_ro("samples_ratio", &Plan::samples_ratio,
              "Foreseen samples stored, over those of the uniform grid.")
      .def_ro("not_covered_fraction", &Plan::not_covered_fraction)
      .def_ro("notes", &Plan::notes);
  m.def(
      "make_plan",
      [](Device& device, const ProjectionSet& scan, const Asked& asked, const CertifyOptions& options,
         nb::handle progress) {
        auto plan = std::make_unique<Plan>();
        run_long(progress, [&](const Progress& report) {
          *plan = asked.sigmas ? make_plan_in_sigma(device, scan, *asked.sigmas, known_noise(scan, asked),
                                                    options, report)
                                     .plan
                               : make_plan(device, scan, asked.tolerance, options, report);
        });
        plan->prepared.reset();
        return plan;
      },
      "device"_a, "scan"_a, "asked"_a, "options"_a, "progress"_a.none());
}

}  // namespace

void add_scans(nb::module_& m) {
  add_devices(m);
  add_geometry(m);
  add_projections(m);
  add_plans(m);
}

}  // namespace vdvr::python
