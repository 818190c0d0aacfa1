// The commands of the program, in the order in which --help lists them; of each the options that most users
// need.
#include "apps/vdvr/command.hpp"

namespace vdvr::cli {
namespace {

std::vector<Command> commands_of_scans() {
  return {
      {.name = "simulate",
       .usage = "(--phantom NAME|FILE.json | --volume FILE) -o FILE.h5",
       .purpose = "projections of a phantom or of a volume",
       .run = simulate_command,
       .main_options = {"output", "phantom", "volume", "angles", "arc", "detector", "pitch", "photons",
                        "cone", "help"},
       .examples = {{"vdvr simulate --phantom shepp-logan --pitch .05 --photons 5000 -o scan.h5",
                     "counts of 5,000 photons a pixel, with flats and darks"},
                    {"vdvr simulate --phantom sphere --cone 60,90 -o scan",
                     "cone beam: the source 60 from the axis and 90 from the detector"}}},
      {.name = "info",
       .usage = "FILE",
       .purpose = "what a file is: geometry, certificate, storage",
       .run = info_command,
       .main_options = {"angles-file", "entry", "views", "json", "help"},
       .examples = {{"vdvr info scan.h5", "its geometry, its noise, what can be certified of it"},
                    {"vdvr info result/volume.vdvr", "its certificate in words"}}},
      {.name = "center",
       .usage = "IN [-o SHEET.png]",
       .purpose = "the centre of rotation, how sure it is, slices around it",
       .run = center_command,
       .main_options = {"output", "row", "step", "count", "angles-file", "entry", "views", "json", "help"},
       .examples = {{"vdvr center scan.h5 -o center.png", "the column, and slices to judge it by"}}},
      {.name = "reconstruct",
       .usage = "IN -o OUT",
       .purpose = "uniform filtered back-projection",
       .run = reconstruct_command,
       .main_options = {"output", "center", "filter", "size", "spacing", "roi", "device", "max-memory",
                        "force", "help"},
       .examples = {{"vdvr reconstruct scan.h5 -o volume.mha",
                     "the covered region at the detector's pitch"}}},
      {.name = "plan",
       .usage = "IN --epsilon E",
       .purpose = "bounds, rates, storage, memory and time foreseen; builds nothing",
       .run = plan_command,
       .main_options = {"epsilon", "center", "filter", "photons", "roi", "device", "max-memory", "json",
                        "help"},
       .examples = {{"vdvr plan scan.h5 --epsilon 3%",
                     "what 3 % of the range would store, what it is in units of the scan's noise"},
                    {"vdvr plan scan.h5 --epsilon 1sigma --filter hann",
                     "the same with another ramp filter"}}},
      {.name = "build",
       .usage = "IN --epsilon E -o OUT.vdvr",
       .purpose = "the certified mixed-resolution volume",
       .run = build_command,
       .main_options = {"output", "epsilon", "center", "filter", "roi", "resume", "device", "max-memory",
                        "force", "help"},
       .examples = {{"vdvr build scan.h5 --epsilon 3% -o volume.vdvr",
                     "the field within 3 % of its range everywhere"},
                    {"vdvr build scan.h5 --epsilon 1sigma -o volume.vdvr",
                     "within one standard deviation of the scan's own noise, brick by brick"}}},
      {.name = "verify",
       .usage = "OUT.vdvr --projections IN",
       .purpose = "measures a certificate again from scratch",
       .run = verify_command,
       .main_options = {"projections", "picture", "rays", "exhaustive", "device", "max-memory", "json",
                        "help"},
       .examples = {{"vdvr verify volume.vdvr --projections scan.h5",
                     "a sample of bricks and the worst; exit code 1 where the certificate is not true"},
                    {"vdvr verify volume.vdvr --projections scan.h5 --exhaustive", "every brick"}}},
      {.name = "probe",
       .usage = "FILE --points P.csv -o V.csv",
       .purpose = "values at points of a volume or of the exact field",
       .run = probe_command,
       .main_options = {"points", "output", "exact", "like", "projections", "device", "max-memory", "force",
                        "help"},
       .examples = {{"vdvr probe volume.vdvr --points p.csv -o v.csv", "value, bound and sigma at each"},
                    {"vdvr probe scan.h5 --exact --like volume.vdvr --points p.csv -o f.csv",
                     "the field itself, in double precision"}}},
      {.name = "residual",
       .usage = "SCAN FILE -o OUT",
       .purpose = "where no interpolation can explain the measured rays",
       .run = residual_command,
       .main_options = {"output", "picture", "rows", "picture-row", "views", "device", "max-memory", "force",
                        "help"},
       .examples = {{"vdvr residual scan.h5 volume.vdvr -o residual.png",
                     "motion, drift, a wrong centre: what is not due to the volume"}}}};
}

std::vector<Command> commands_of_volumes() {
  return {
      {.name = "measure",
       .usage = "FILE (--above C | --mean | ...)",
       .purpose = "volumes, means, lines, components: intervals that hold for F",
       .run = measure_command,
       .main_options = {"above", "below", "mean", "histogram", "along", "components", "roi", "mask", "output",
                        "help"},
       .examples = {{"vdvr measure volume.vdvr --below 0.3", "the porosity, as an interval"},
                    {"vdvr measure volume.vdvr --below 0.3 --components -o pores.csv",
                     "pores that exist for sure, and those that may"},
                    {"vdvr measure volume.vdvr --mean --ball 0,0,0,5", "the mean density in a ball"}}},
      {.name = "audit",
       .usage = "VOLUME --projections SCAN",
       .purpose = "how far another program's volume lies from the exact field",
       .run = audit_command,
       .main_options = {"projections", "within", "interpolate", "as-is", "center", "filter", "spacing",
                        "origin", "output", "help"},
       .examples = {{"vdvr audit theirs.mha --projections scan.h5",
                     "what is off in words; the error at samples and between them, with a proved upper end"},
                    {"vdvr audit slices/ --projections scan.h5 --within 5% -o worst.png",
                     "exit code 1 unless it lies within 5 % of the range everywhere; a picture"}}},
      {.name = "render",
       .usage = "FILE -o IMG.png",
       .purpose = "a picture, or a turntable of pictures",
       .run = render_command,
       .main_options = {"output", "mode", "size", "tf", "iso", "certify", "azimuth", "elevation", "turntable",
                        "help"},
       .examples = {{"vdvr render volume.vdvr -o picture.png", "a transfer function that suits the volume"},
                    {"vdvr render volume.vdvr --mode iso --iso 0.5 -o surface.png", "a surface"},
                    {"vdvr render volume.vdvr --certify fast -o picture.png",
                     "with a bound for every pixel, and its certificate"},
                    {"vdvr render volume.vdvr --turntable 72 -o turn.gif", "an animation"}}},
      {.name = "serve",
       .usage = "FILE",
       .purpose = "a volume in the browser, to be turned with the mouse",
       .run = serve_command,
       .main_options = {"address", "port", "name", "device", "max-memory", "help"},
       .examples = {{"vdvr serve volume.vdvr", "prints the address to open"}}},
      {.name = "export",
       .usage = "OUT.vdvr -o VOL",
       .purpose = "a certified volume in the format of other programs",
       .run = export_command,
       .main_options = {"output", "oversampling", "format", "samples", "range", "sigma", "compression",
                        "force", "help"},
       .examples = {{"vdvr export volume.vdvr -o volume.mha", "one uniform grid"},
                    {"vdvr export volume.vdvr -o slices --samples u16", "a folder of TIFF slices"}}},
      {.name = "convert-geometry",
       .usage = "IN -o geometry.xml",
       .purpose = "RTK's geometry file of a cone-beam scan",
       .run = convert_geometry_command,
       .main_options = {"output", "angles-file", "views", "force", "help"},
       .examples = {{"vdvr convert-geometry scan -o geometry.xml", "for rtkfdk and its kin"}}}};
}

std::vector<Command> all_commands() {
  std::vector<Command> all{
      {.name = "devices",
       .usage = "[--probe]",
       .purpose = "OpenCL devices, their limits, and which sampler they use",
       .run = devices_command,
       .examples = {{"vdvr devices --probe", "also how exact their arithmetic and their texture unit are"}}}};
  all.push_back({.name = "run",
                 .usage = "IN --epsilon E -o DIR",
                 .purpose = "plan, build, verify, render: everything from one scan",
                 .run = run_command,
                 .main_options = {"output", "epsilon", "center", "filter", "roi", "resume", "device",
                                  "max-memory", "force", "help"},
                 .examples = {{"vdvr run scan.h5 -o result",
                               "a volume as exact as the scan's noise allows, pictures and a report"},
                              {"vdvr run scan.h5 --epsilon 3% -o result", "within 3 % of the range"}}});
  for (Command& c : commands_of_scans()) all.push_back(std::move(c));
  for (Command& c : commands_of_volumes()) all.push_back(std::move(c));
  all.push_back({.name = "bench",
                 .usage = "fbp|build|render ...",
                 .purpose = "timings: a table on a terminal, else one JSON line per case",
                 .run = bench_command,
                 .cases = {"fbp", "fdk", "build", "render"},
                 .examples = {{"vdvr bench fbp --size 256", "the reconstruction alone"},
                              {"vdvr bench render volume.vdvr", "frames per second"}}});
  return all;
}

}  // namespace

const std::vector<Command>& commands() {
  static const std::vector<Command> table = all_commands();
  return table;
}

}  // namespace vdvr::cli
