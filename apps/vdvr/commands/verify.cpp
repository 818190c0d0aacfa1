// vdvr verify: measures a certificate again from the projections and the packed volume alone.
#include "vdvr/verify_file.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/common/progress.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/verification.hpp"
#include "apps/vdvr/verify_picture.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/preparation.hpp"

namespace vdvr::cli {

namespace {

/// Windows that were left to the detector are those that the file names.
bool same_preparation(Preparation given, const Preparation& stored) {
  if (given.stripes && stored.stripes) {
    if (given.stripes->large == 0) given.stripes->large = stored.stripes->large;
    if (given.stripes->small == 0) given.stripes->small = stored.stripes->small;
  }
  if (!given.half_acquisition) given.half_acquisition = stored.half_acquisition;
  if (!given.flats_in_time) given.flats_in_time = stored.flats_in_time;
  given.beam_current = stored.beam_current;  // an option of the input
  if (given.flats_in_time == false) given.flats_in_time = {};
  return given == stored;
}

/// F is the file's; options given anyway must say the same.
void check_field_options(const Arguments& args, const FieldOptions& stored) {
  if (!has_field_options(args)) return;
  const FieldOptions given = field_options(args);
  const bool same =
      (!args.has("filter") || given.filter == stored.filter) &&
      (!args.has("filter-cutoff") || given.cutoff == stored.cutoff) &&
      (!args.has("center") ||
       binned_center(args.number("center").value(), stored.preparation.binning) == stored.center) &&
      (!has_preparation_options(args) || same_preparation(given.preparation, stored.preparation));
  if (!same)
    throw InputError(fmt::format(
        "the file was certified for filter {}, cutoff {}, centre {}, preparation {}; verify takes "
        "them from it",
        text_of(stored.filter), stored.cutoff,
        unbinned_center(stored.center.value_or(0), stored.preparation.binning), text_of(stored.preparation)));
}

}  // namespace

int verify_command(Arguments& args) {
  args.positional("FILE", "the certified volume")
      .value("projections", "IN", "the projections it was built from")
      .value("picture", "X.certificate.json",
             "a certified picture of the volume instead: hashes, the intervals again, and with --projections "
             "F itself along random rays")
      .value("rays", "R", "of --picture, how many (default 16)")
      .flag("exhaustive", "every gold node; otherwise a stratified sample of bricks and the worst ones");
  add_scan(args);
  add_field(args);
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  if (args.has("picture")) {
    refuse(args, {"exhaustive"}, "does not apply to --picture");
    return verify_picture_command(args, common);
  }
  refuse(args, {"rays"}, "goes with --picture");
  const auto path = args.path("FILE"), projections = args.path("projections");
  require_certified(path, args);

  ProgressLine progress(args.who(), common.quiet);
  const VdvrFile file = read_to_verify(path, common.max_memory);
  const Certificate& certificate = file.certificate;
  check_field_options(args, certificate.field);
  const ProjectionSet scan = load_scan_to_verify(projections, args, certificate, progress.callback());
  check_projections(projections, scan, certificate);
  Device device = open_device(common);
  VerifyOptions options;
  options.exhaustive = args.has("exhaustive");
  const FileVerification result = verify_file(device, file, scan, options, progress.callback());
  progress.clear();

  Json json = {{"file", path.string()},
               {"projections", projections.string()},
               {"exhaustive", result.exhaustive},
               {"seal", text_of(file.seal)},
               {"content_matches", result.content_matches}};
  json.update(verification_json(result.measured, certificate));
  print_result(common, json, [&] {
    fmt::print("{}: {}, {}input matches its hash\n", path.string(), text_of(file.seal),
               result.content_matches ? "content matches its hash, " : "");
    print_verification(result.measured, certificate);
    if (certificate.noise && certificate.noise->split_ratio)
      fmt::print("  split        {}, as the certificate has it\n",
                 split_words(*certificate.noise->split_ratio, certificate.noise->split_resolved));
  });
  if (!result.holds) throw MismatchError(fmt::format("{}: {}", path.string(), result.failure));
  return 0;
}

}  // namespace vdvr::cli
