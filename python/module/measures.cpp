// What is measured on certified volumes, as dictionaries of intervals and arrays.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <memory>

#include "arrays.hpp"
#include "asked.hpp"
#include "held_volume.hpp"
#include "long_work.hpp"
#include "parts.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/components.hpp"
#include "vdvr/expert/mean_of_scan.hpp"
#include "vdvr/expert/measure.hpp"
#include "vdvr/expert/measure_line.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace vdvr::python {
namespace {

using MaskArray = nb::ndarray<const std::uint8_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

nb::tuple pair_of(const Interval& i) { return nb::make_tuple(i.lo, i.hi); }

/// float64 [n, 2].
nb::object array_of(const std::vector<Interval>& intervals) {
  std::vector<double> out;
  for (const Interval& i : intervals) out.insert(out.end(), {i.lo, i.hi});
  return nb::cast(as_array(std::move(out), {intervals.size(), 2}));
}

/// A mask on the samples of the volume's grid.
std::shared_ptr<const Volume> mask_of(const HeldVolume& held, const MaskArray& mask) {
  auto out = std::make_shared<Volume>();
  out->grid = held.file().volume.grid;
  const Index3 n = out->grid.samples();
  for (std::size_t a = 0; a < 3; ++a)
    if (mask.shape(2 - a) != static_cast<std::size_t>(n[a]))
      throw InputError("mask: its shape is not that of the volume's grid; to_numpy() has it");
  out->samples.assign(mask.data(), mask.data() + mask.size());
  return out;
}

MeasureRegion region_of(const HeldVolume& held, const std::optional<std::array<double, 6>>& box,
                        const std::vector<std::array<double, 5>>& rounds,
                        const std::optional<MaskArray>& mask) {
  MeasureRegion region;
  region.box = box;
  for (const auto& r : rounds) region.rounds.push_back({{r[0], r[1], r[2]}, r[3], r[4] != 0});
  if (mask) region.mask = mask_of(held, *mask);
  return region;
}

class Measures {
 public:
  Measures(HeldVolume& held, const std::optional<std::array<double, 6>>& box,
           const std::vector<std::array<double, 5>>& rounds, const std::optional<MaskArray>& mask)
      : measurement_(held.file().volume, held.file().certificate, region_of(held, box, rounds, mask)) {}

  nb::dict volume(std::optional<double> least, std::optional<double> largest) {
    VolumeMeasure v;
    run_long(nb::none(), [&](const Progress& p) { v = measurement_.volume({least, largest}, {}, p); });
    nb::dict out;
    out["volume"] = pair_of(v.volume);
    out["fraction"] = pair_of(v.fraction);
    out["region"] = pair_of(v.region);
    return out;
  }
  nb::dict mean() {
    MeanMeasure v;
    run_long(nb::none(), [&](const Progress& p) { v = measurement_.mean(p); });
    nb::dict out;
    out["mean"] = pair_of(v.mean);
    out["mass"] = pair_of(v.integral);
    out["region"] = pair_of(v.region);
    return out;
  }
  nb::dict mean_of_scan(const ProjectionSet& scan, const std::optional<ScanSource>& source,
                        const Understood& understood) {
    MeanOfScan v;
    run_long(nb::none(), [&](const Progress& p) {
      std::string why;
      MeanNoise noise{{}, understood.flats};
      if (const auto found = find_noise(scan, {}, source, why)) noise.model = found->model;
      v = measurement_.mean_of_scan(scan, noise, 0, p);
    });
    nb::dict out;
    out["field_mean"] = v.mean;
    out["sigma"] = v.sigma ? nb::cast(*v.sigma) : nb::none();
    return out;
  }
  nb::dict extremes() {
    ExtremesMeasure v;
    run_long(nb::none(), [&](const Progress& p) { v = measurement_.extremes(p); });
    nb::dict out;
    out["least"] = pair_of(v.least);
    out["largest"] = pair_of(v.largest);
    return out;
  }
  nb::dict distribution(const std::vector<double>& edges) {
    Distribution v;
    run_long(nb::none(), [&](const Progress& p) { v = measurement_.distribution(edges, p); });
    nb::dict out;
    out["edges"] = as_array(std::vector<double>(v.edges), {v.edges.size()});
    out["at_least"] = array_of(v.at_least);
    out["within"] = array_of(v.within);
    return out;
  }
  nb::dict along(const Vec3& p, const Vec3& q, std::int64_t samples, std::optional<double> value) {
    LineMeasure v;
    run_long(nb::none(), [&](const Progress&) { v = measurement_.along(p, q, {samples, value}); });
    nb::dict out;
    out["length"] = v.length;
    out["at"] = as_array(std::vector<double>(v.at), {v.at.size()});
    out["value"] = array_of(v.value);
    if (!value) return out;
    std::vector<Interval> crossings;
    for (const LineCrossing& c : v.crossings) crossings.push_back(c.at);
    nb::list runs;
    for (const LineRun& r : v.runs) {
      nb::dict run;
      run["above"] = r.above;
      run["width"] = r.width ? nb::object(pair_of(*r.width)) : nb::none();
      runs.append(run);
    }
    out["crossings"] = array_of(crossings);
    out["runs"] = runs;
    out["undecided"] = v.undecided;
    return out;
  }
  nb::dict components(std::optional<double> least, std::optional<double> largest, double least_volume,
                      const std::optional<PointArray>& points);

 private:
  Measurement measurement_;
};

nb::dict Measures::components(std::optional<double> least, std::optional<double> largest, double least_volume,
                              const std::optional<PointArray>& points) {
  ComponentsOptions options;
  options.least_volume = least_volume;
  if (points) {
    const auto all = points_of(*points);
    options.points.assign(all.begin(), all.end());
  }
  ComponentTable t;
  run_long(nb::none(), [&](const Progress& p) { t = measurement_.components({least, largest}, options, p); });
  const std::size_t n = t.rows.size();
  std::vector<Interval> volumes;
  std::vector<double> boxes;
  std::vector<std::int64_t> parts;
  std::vector<std::uint8_t> spans;
  for (const MeasuredComponent& c : t.rows) {
    volumes.push_back(c.volume);
    boxes.insert(boxes.end(), c.box.begin(), c.box.end());
    parts.push_back(c.sure_parts);
    for (const Answer a : c.spans) spans.push_back(static_cast<std::uint8_t>(a));
  }
  std::vector<std::int64_t> possible, sure;
  for (const ComponentOfPoint& p : t.points) {
    possible.push_back(p.possible.value_or(-1));
    sure.push_back(p.sure.value_or(-1));
  }
  nb::dict out;
  out["certain"] = t.certain;
  out["possible"] = t.possible;
  out["total"] = pair_of(t.volume);
  out["uncertain_volume"] = t.uncertain_volume;
  out["largest_uncertain"] = t.largest_uncertain;
  out["volume"] = array_of(volumes);
  out["box"] = as_array(std::move(boxes), {n, 6});
  out["sure_parts"] = as_array(std::move(parts), {n});
  out["spans"] = as_array(std::move(spans), {n, 3});
  out["possible_of_point"] = as_array(std::move(possible), {t.points.size()});
  out["sure_of_point"] = as_array(std::move(sure), {t.points.size()});
  return out;
}

}  // namespace

void add_measures(nb::module_& m) {
  nb::class_<Measures>(m, "Measures")
      .def(nb::init<HeldVolume&, const std::optional<std::array<double, 6>>&,
                    const std::vector<std::array<double, 5>>&, const std::optional<MaskArray>&>(),
           "volume"_a, "box"_a.none(), "rounds"_a, "mask"_a.none(), nb::keep_alive<1, 2>())
      .def("volume", &Measures::volume, "least"_a.none(), "largest"_a.none())
      .def("mean", &Measures::mean)
      .def("mean_of_scan", &Measures::mean_of_scan, "scan"_a, "source"_a.none(), "understood"_a)
      .def("extremes", &Measures::extremes)
      .def("distribution", &Measures::distribution, "edges"_a)
      .def("along", &Measures::along, "p"_a, "q"_a, "samples"_a, "value"_a.none())
      .def("components", &Measures::components, "least"_a.none(), "largest"_a.none(), "least_volume"_a,
           "points"_a.none());
}

}  // namespace vdvr::python
