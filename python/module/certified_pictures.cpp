// Certified pictures: what is certain of each pixel, written and verified.
#include <nanobind/nanobind.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <utility>

#include "arrays.hpp"
#include "held_volume.hpp"
#include "long_work.hpp"
#include "parts.hpp"
#include "vdvr/certified_picture.hpp"
#include "vdvr/expert/surface_picture.hpp"
#include "vdvr/verify_file.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace vdvr::python {
namespace {

std::size_t size(std::int64_t n) { return static_cast<std::size_t>(n); }

/// A copy: the picture keeps its own.
nb::object values_of(const FloatImage& image) {
  std::vector<float> values = image.values;
  if (image.channels == 1)
    return nb::cast(as_array(std::move(values), {size(image.height), size(image.width)}));
  return nb::cast(as_array(std::move(values), {size(image.height), size(image.width), size(image.channels)}));
}

nb::object image_of(const CertifiedPicture& p) {
  std::vector<std::uint8_t> rgb = p.drawn.image.rgb;
  return nb::cast(as_array(std::move(rgb), {size(p.drawn.image.height), size(p.drawn.image.width), 3}));
}

/// What is certain of a value: of F's depth, maximum or integral, else of the colour.
nb::object end_of(const CertifiedPicture& p, bool high) {
  switch (p.record.options.mode) {
    case RenderMode::iso:
      return values_of(high ? p.surface.last : p.surface.first);
    case RenderMode::mip:
      return values_of(high ? p.maxima.high : p.maxima.low);
    case RenderMode::integral:
      return values_of(high ? p.integrals.high : p.integrals.low);
    default:
      return values_of(high ? p.bounds.hi : p.bounds.lo);
  }
}

nb::object classes_of(const CertifiedPicture& p) {
  if (p.record.options.mode != RenderMode::iso) return nb::none();
  std::vector<std::uint8_t> hit = p.surface.hit;
  return nb::cast(as_array(std::move(hit), {size(p.surface.first.height), size(p.surface.first.width)}));
}

CertifiedPicture certify(HeldVolume& held, const std::shared_ptr<Device>& device,
                         const PictureRequest& request, nb::handle progress) {
  CertifiedPicture picture;
  run_long(progress, [&](const Progress& report) { picture = held.certified(device, request, report); });
  return picture;
}

PictureVerification verify(const std::shared_ptr<Device>& device, HeldVolume& held,
                           const std::filesystem::path& certificate, const ProjectionSet* scan,
                           std::int64_t rays, nb::handle progress) {
  PictureVerification v;
  run_long(progress, [&](const Progress& report) {
    v = verify_picture(*device, held.file(), certificate, {scan, rays}, report);
  });
  return v;
}

void add_request(nb::module_& m) {
  nb::class_<CertifyPictureOptions>(m, "CertifyPictureOptions")
      .def_rw("kappa", &CertifyPictureOptions::kappa)
      .def_rw("fast", &CertifyPictureOptions::fast)
      .def_rw("box", &CertifyPictureOptions::box);
  nb::class_<PictureRequest>(m, "PictureRequest")
      .def(nb::init<>())
      .def_rw("options", &PictureRequest::options)
      .def_rw("certify", &PictureRequest::certify)
      .def_rw("lit", &PictureRequest::lit)
      .def_rw("keep_steps", &PictureRequest::keep_steps)
      .def_rw("tolerance", &PictureRequest::tolerance, nb::arg().none());
}

void add_picture(nb::module_& m) {
  nb::class_<CertifiedPicture>(m, "CertifiedPicture",
                               "A picture of V, and what is certain of the one that F would give.")
      .def_prop_ro("image", &image_of, "uint8 [y, x, 3], sRGB: what was drawn.")
      .def_prop_ro(
          "levels",
          [](const CertifiedPicture& p) {
            return p.record.options.mode == RenderMode::iso ? nb::none() : values_of(p.bound.levels);
          },
          "float32 [y, x]: how far the ideal picture may lie from `image`, in levels of 255, of the worst "
          "channel. None of surfaces.")
      .def_prop_ro(
          "low", [](const CertifiedPicture& p) { return end_of(p, false); },
          "float32: the lower ends of what is certain. Of dvr and slice of the colour, [y, x, 3], 0 to 1; of "
          "mip "
          "of the largest F on the ray, of integral of its integral, of iso of the distance from the eye at "
          "which "
          "F passes the value first: [y, x].")
      .def_prop_ro(
          "high", [](const CertifiedPicture& p) { return end_of(p, true); }, "The upper ends.")
      .def_prop_ro(
          "classes", &classes_of,
          "Of surfaces uint8 [y, x]: 2 where F passes the value for sure, 1 where it may, 0 where it "
          "does not. None of other modes.")
      .def_prop_ro(
          "mean", [](const CertifiedPicture& p) { return p.bound.mean; }, "Of `levels`.")
      .def_prop_ro(
          "worst", [](const CertifiedPicture& p) { return p.bound.max; }, "The largest of `levels`.")
      .def(
          "write",
          [](const CertifiedPicture& p, const std::filesystem::path& path) {
            return write_certified_picture(path, p);
          },
          "path"_a)
      .def(
          "files",
          [](const CertifiedPicture& p, const std::filesystem::path& path) {
            std::vector<std::filesystem::path> files = beside_picture(path, p.record.options.mode);
            files.insert(files.begin(), path);
            return files;
          },
          "path"_a);
  nb::class_<PictureVerification>(m, "PictureVerification", "What `verify_picture` found.")
      .def_ro("holds", &PictureVerification::holds)
      .def_ro("failures", &PictureVerification::failures, "One line each.")
      .def_ro("same_pixels", &PictureVerification::same_pixels,
              "Another device may draw other pixels; the bound is then of those.")
      .def_prop_ro(
          "rays", [](const PictureVerification& v) { return v.rays ? v.rays->rays : 0; },
          "Along how many rays F itself was evaluated.")
      .def_prop_ro(
          "rays_outside", [](const PictureVerification& v) { return v.rays ? v.rays->outside : 0; },
          "In how many places F was outside of what is certain.")
      .def("__bool__", [](const PictureVerification& v) { return v.holds; });
}

}  // namespace

void add_certified_pictures(nb::module_& m) {
  add_request(m);
  add_picture(m);
  m.def("certify_picture", &certify, "volume"_a, "device"_a, "request"_a, "progress"_a.none());
  m.def("verify_picture", &verify, "device"_a, "volume"_a, "certificate"_a, "scan"_a.none(), "rays"_a,
        "progress"_a.none());
}

}  // namespace vdvr::python
