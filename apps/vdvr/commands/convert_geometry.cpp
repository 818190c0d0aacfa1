// vdvr convert-geometry: a cone-beam scan's geometry as RTK's XML.
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/common/progress.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/output.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/output_file.hpp"
#include "vdvr/expert/rtk_geometry.hpp"

namespace vdvr::cli {
namespace {

/// Of the stack: --pitch, else the detector's own pixels where the scan says how far it is, else those at the
/// axis, where RTK then finds the detector.
StackPlace stack_of(const Arguments& args, const ProjectionSet& scan) {
  const ParallelGeometry& g = scan.geometry;
  const ConeView first = cone_view(scan.cone->views.front());
  const double detector = scan.report.source_to_detector,
               zoom = detector > 0 ? detector / first.source_to_axis : 1;
  double pitch_u = first.pitch_u * zoom, pitch_v = first.pitch_v * zoom;
  if (const auto pitch = args.one_or_two("pitch")) {
    pitch_u = (*pitch)[0];
    pitch_v = (*pitch)[1];
  }
  return centred_stack(g.columns, g.rows, pitch_u, pitch_v);
}

}  // namespace

int convert_geometry_command(Arguments& args) {
  args.positional("IN", "a cone-beam scan")
      .value("output,o", "geometry.xml", "RTK's ThreeDCircularGeometry, version 3")
      .value("center", "C", "column onto which the axis projects; overrides the scan's")
      .value("pitch", "P[,PV]",
             "sides of a pixel, which put the detector at its distance (default: as the scan says, or those "
             "at the axis)");
  add_scan(args);
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  const auto path = args.path("IN"), output = args.path("output");
  check_output(output, common.force, {path});

  ProgressLine progress(args.who(), common.quiet);
  FieldOptions field;
  field.center = args.number("center");
  const ProjectionSet scan = load_scan(path, args, field, progress.callback());
  if (!scan.cone)
    throw InputError(
        fmt::format("{}: is a scan of parallel beam; RTK's file describes cone beam", path.string()));
  const StackPlace stack = stack_of(args, scan);
  std::string text;
  try {
    text = rtk_geometry_text(*scan.cone, stack);
  } catch (InputError& e) {
    e.add_context(path.string());
    throw;
  }
  throw_if_stopped();
  io::write_file(output, text);
  progress.clear();
  const Json json = {{"output", output.string()},
                     {"views", scan.geometry.views()},
                     {"origin", stack.origin},
                     {"spacing", stack.spacing},
                     {"unit", scan.geometry.unit}};
  print_result(common, json, [&] {
    print_scan(scan);
    fmt::print("written        {}: {} projections\n", output.string(), scan.geometry.views());
    fmt::print(
        "  stack        Offset = {:.17g} {:.17g} 0, ElementSpacing = {:.17g} {:.17g} 1: the file holds "
        "for a MetaImage stack of that place\n",
        stack.origin[0], stack.origin[1], stack.spacing[0], stack.spacing[1]);
    fmt::print("  world        a point (x, y, z) here is (x, z, -y) in RTK, whose axis of rotation is y\n");
  });
  return 0;
}

}  // namespace vdvr::cli
