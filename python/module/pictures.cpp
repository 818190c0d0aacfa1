// How a volume is looked at: options of pictures.
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "parts.hpp"
#include "vdvr/automatic_view.hpp"
#include "vdvr/expert/camera.hpp"
#include "vdvr/expert/error_slice.hpp"
#include "vdvr/expert/framing.hpp"
#include "vdvr/expert/image.hpp"
#include "vdvr/expert/transfer_function.hpp"
#include "vdvr/raycast.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace vdvr::python {
namespace {

void add_choices(nb::module_& m) {
  nb::enum_<RenderMode>(m, "RenderMode")
      .value("dvr", RenderMode::dvr)
      .value("iso", RenderMode::iso)
      .value("mip", RenderMode::mip)
      .value("slice", RenderMode::slice)
      .value("error", RenderMode::error)
      .value("integral", RenderMode::integral);
  nb::enum_<RenderOutput>(m, "RenderOutput")
      .value("colour", RenderOutput::colour)
      .value("depth", RenderOutput::depth)
      .value("normal", RenderOutput::normal)
      .value("error", RenderOutput::error);
  nb::enum_<BrickQuantity>(m, "BrickQuantity")
      .value("bound", BrickQuantity::bound)
      .value("sigma", BrickQuantity::sigma)
      .value("bound_in_sigma", BrickQuantity::bound_in_sigma);
  nb::enum_<GradientKind>(m, "GradientKind")
      .value("auto", GradientKind::automatic)
      .value("central", GradientKind::central)
      .value("stored", GradientKind::stored)
      .value("analytic", GradientKind::analytic);
  nb::enum_<SamplerKind>(m, "SamplerKind")
      .value("auto", SamplerKind::automatic)
      .value("buffer", SamplerKind::buffer)
      .value("image3d", SamplerKind::image3d);
  nb::enum_<Classification>(m, "Classification")
      .value("post", Classification::post)
      .value("preintegrated", Classification::preintegrated);
  nb::enum_<StepMode>(m, "StepMode")
      .value("adaptive", StepMode::adaptive)
      .value("fixed", StepMode::fixed)
      .value("level", StepMode::level);
}

void add_transfer(nb::module_& m) {
  nb::class_<TransferFunction>(m, "TransferFunction", "Density to colour and opacity.")
      .def_ro("name", &TransferFunction::name)
      .def_ro("note", &TransferFunction::note, "What a file left open.")
      .def_prop_ro(
          "points",
          [](const TransferFunction& f) {
            std::vector<std::array<double, 5>> points;
            for (const TransferPoint& p : f.points)
              points.push_back({p.value, p.rgb[0], p.rgb[1], p.rgb[2], p.opacity});
            return points;
          },
          "(density, red, green, blue, opacity of one base cell), each of the last four from 0 to 1.");
  m.def(
      "transfer_of",
      [](const std::vector<std::array<double, 5>>& points) {
        TransferFunction f;
        f.name = "points";
        for (const auto& p : points) f.points.push_back({p[0], {p[1], p[2], p[3]}, p[4]});
        return f;
      },
      "points"_a);
  m.def("transfer_presets", [] {
    std::vector<std::string> names;
    for (const TransferPreset& p : transfer_presets()) names.push_back(p.name);
    return names;
  });
  m.def("preset_for", &preset_for, "name"_a, "brightness"_a);
  m.def("transfer_preset", &transfer_preset, "name"_a, "lo"_a, "hi"_a);
  m.def("read_transfer_function", &read_transfer_function, "path"_a);
  m.def("stretched", &stretched, "transfer"_a, "lo"_a, "hi"_a);
  m.def("per_base_cell", &per_base_cell, "transfer"_a, "grid"_a);
  m.def("two_material_transfer", &two_material_transfer, "brightness"_a);
}

void add_options(nb::module_& m) {
  nb::class_<Brightness>(m, "Brightness", "Where the picture-worthy densities of a volume lie.")
      .def_ro("lo", &Brightness::lo)
      .def_ro("hi", &Brightness::hi)
      .def_ro("grey_lo", &Brightness::grey_lo)
      .def_ro("grey_hi", &Brightness::grey_hi)
      .def_ro("threshold", &Brightness::threshold);
  nb::class_<Camera>(m, "Camera")
      .def_ro("position", &Camera::position)
      .def_ro("focal_point", &Camera::focal_point)
      .def_ro("view_up", &Camera::view_up)
      .def_ro("view_angle_deg", &Camera::view_angle_deg);
  nb::class_<OrbitFrame>(m, "OrbitFrame", "Where an orbit looks, and from how far.");
  m.def("frame_grid", &frame_grid, "grid"_a);
  m.def("orbit_camera", nb::overload_cast<const OrbitFrame&, double, double, double>(&orbit_camera),
        "frame"_a, "azimuth_deg"_a, "elevation_deg"_a, "zoom"_a);
  m.def("look_at", &look_at, "position"_a, "focal_point"_a, "view_up"_a.none(), "view_angle_deg"_a);
  nb::class_<IsoSurface>(m, "IsoSurface")
      .def_ro("value", &IsoSurface::value)
      .def_ro("opacity", &IsoSurface::opacity);
  m.def("iso_surfaces", &iso_surfaces, "densities"_a, "opacities"_a.none());
  nb::class_<RenderOptions>(m, "RenderOptions")
      .def(nb::init<>())
      .def_rw("mode", &RenderOptions::mode)
      .def_rw("output", &RenderOptions::output)
      .def_rw("width", &RenderOptions::width)
      .def_rw("height", &RenderOptions::height)
      .def_rw("camera", &RenderOptions::camera)
      .def_rw("transfer", &RenderOptions::transfer)
      .def_rw("step", &RenderOptions::step)
      .def_rw("classification", &RenderOptions::classification)
      .def_rw("step_mode", &RenderOptions::step_mode)
      .def_rw("surfaces", &RenderOptions::surfaces)
      .def_rw("slice_axis", &RenderOptions::slice_axis)
      .def_rw("slice_position", &RenderOptions::slice_position, nb::arg().none())
      .def_rw("slice_range", &RenderOptions::slice_range, nb::arg().none())
      .def_rw("shading", &RenderOptions::shading)
      .def(
          "set_clip",
          [](RenderOptions& o, const Vec3& low, const Vec3& high) {
            o.clip = Clip{low, high};
          },
          "low"_a, "high"_a)
      .def_rw("gradient", &RenderOptions::gradient)
      .def_rw("head_light", &RenderOptions::head_light)
      .def_rw("lights", &RenderOptions::lights)
      .def_rw("sampler", &RenderOptions::sampler)
      .def_rw("background_top", &RenderOptions::background_top)
      .def_rw("background_bottom", &RenderOptions::background_bottom);
}

}  // namespace

void add_pictures(nb::module_& m) {
  add_choices(m);
  add_transfer(m);
  add_options(m);
}

}  // namespace vdvr::python
