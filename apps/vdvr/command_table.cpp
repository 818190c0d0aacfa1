// The commands of the program, in the order in which --help lists them.
#include "apps/vdvr/command.hpp"

namespace vdvr::cli {

const std::vector<Command>& commands() {
  static const std::vector<Command> table{
      {"devices", "[--probe]", "OpenCL devices, their limits, and which sampler they use", devices_command},
      {"simulate", "(--phantom NAME|FILE.json | --volume FILE) -o FILE.h5",
       "projections of a phantom or of a volume", simulate_command},
      {"info", "FILE", "what a file is: geometry, certificate, storage", info_command},
      {"center", "IN [-o SHEET.png]", "the centre of rotation, how sure it is, slices around it",
       center_command},
      {"reconstruct", "IN -o OUT", "uniform filtered back-projection", reconstruct_command},
      {"plan", "IN --epsilon E", "bounds, rates, storage, memory and time foreseen; builds nothing",
       plan_command},
      {"build", "IN --epsilon E -o OUT.vdvr", "the certified mixed-resolution volume", build_command},
      {"verify", "OUT.vdvr --projections IN", "measures a certificate again from scratch", verify_command},
      {"probe", "FILE --points P.csv -o V.csv", "values at points of a volume or of the exact field",
       probe_command},
      {"residual", "SCAN FILE -o OUT", "where no interpolation can explain the measured rays",
       residual_command},
      {"measure", "FILE (--above C | --mean | ...)",
       "volumes, means, lines, components: intervals that hold for F", measure_command},
      {"render", "FILE -o IMG.png", "a picture, or a turntable of pictures", render_command},
      {"serve", "FILE", "a volume in the browser, to be turned with the mouse", serve_command},
      {"export", "OUT.vdvr -o VOL", "a certified volume in the format of other programs", export_command},
      {"convert-geometry", "IN -o geometry.xml", "RTK's geometry file of a cone-beam scan",
       convert_geometry_command},
      {"run", "IN --epsilon E -o DIR", "plan, build, verify, render: everything from one scan", run_command},
      {"bench",
       "fbp|build|render ...",
       "timings, one JSON line per case",
       bench_command,
       "vdvr",
       {"fbp", "fdk", "build", "render", "bounds", "tune"}}};
  return table;
}

}  // namespace vdvr::cli
