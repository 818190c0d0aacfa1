// vdvr info: what any file of ours or any input is.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/common/progress.hpp"
#include "apps/vdvr/cone.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/noise_words.hpp"
#include "apps/vdvr/output.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certify.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr::cli {
namespace {

std::string seal_text(Seal seal) {
  switch (seal) {
    case Seal::none:
      return "unsealed: of an earlier version, or edited since; `vdvr verify` compares with the projections";
    case Seal::whole:
      return "sealed: certificate, totals by brick and attributes are as they were written";
    case Seal::broken:
      break;
  }
  return text_of(seal);
}

int certified_info(const std::filesystem::path& path, const CommonOptions& common) {
  const VdvrFile file = read_large_vdvr(path, common.max_memory, common.scratch, Altered::report);
  std::string mismatch = file.altered;
  if (const std::string what = contradiction(file.certificate); mismatch.empty() && !what.empty())
    mismatch = "the certificate contradicts itself: " + what;
  const std::string kind = file.certificate.comparison ? "volume for comparison" : "certified volume";
  Json json = {{"file", path.string()},
               {"kind", kind},
               {"generator", file.generator},
               {"format_version", file.format_version},
               {"grid", grid_json(file.volume.grid)}};
  json["grid"]["granularity"] = file.volume.granularity;
  json["grid"]["cells_per_base_sample"] = cells_per_base_sample(file.volume.coarsening);
  json["grid"]["rate"] = file.volume.rate;
  json["bricks"] = levels_json(file.volume);
  json["storage"] = storage_json(file.volume, file.file_bytes);
  json["seal"] = text_of(file.seal);
  json["content_matches"] = mismatch.empty();
  json["content_sha256"] = file.certificate.content_sha256;
  json[record_name(file.certificate)] = certificate_json(file.certificate);
  print_result(common, json, [&] {
    fmt::print("{}: {}, format {}, by {}\n", path.string(), kind, file.format_version, file.generator);
    print_grid(file.volume.grid);
    print_storage(file.volume, file.file_bytes);
    print_certificate(file.certificate);
    fmt::print("seal           {}\n", seal_text(file.seal));
    if (mismatch.empty()) fmt::print("content        matches the certificate's hash\n");
  });
  if (!mismatch.empty()) throw MismatchError(fmt::format("{}: {}", path.string(), mismatch));
  return 0;
}

int volume_info(const std::filesystem::path& path, const Arguments& args, const CommonOptions& common) {
  const Volume volume = load_volume(path, args);
  const auto range = std::minmax_element(volume.samples.begin(), volume.samples.end());
  const Json json = {{"file", path.string()},
                     {"kind", "volume"},
                     {"grid", grid_json(volume.grid)},
                     {"range", {*range.first, *range.second}}};
  print_result(common, json, [&] {
    fmt::print("{}: volume, samples {:.6g} to {:.6g}\n", path.string(), *range.first, *range.second);
    print_grid(volume.grid);
  });
  return 0;
}

/// Of `build`, which certifies what the scan covers; none where that is nothing. `reconstruct` fills another.
std::optional<Grid> certified_grid_of(const ProjectionSet& scan) {
  try {
    return grid_to_certify(scan, {});
  } catch (const InputError&) {
    return {};
  }
}

int scan_info(const std::filesystem::path& path, const Arguments& args, const CommonOptions& common) {
  ProgressLine progress(args.who(), common.quiet);
  Understood understood;
  const ProjectionSet scan = load_scan(path, args, {}, progress.callback(), &understood);
  const NoiseFound noise = noise_of_scan(path, args, {}, scan);
  const Grid grid = make_grid(scan, {});
  const std::optional<Grid> certified = certified_grid_of(scan);
  const bool differ = certified && (certified->cells != grid.cells || certified->origin != grid.origin ||
                                    certified->spacing != grid.spacing);
  // Where nobody states a roll, rows that say one are worth a word.
  std::optional<RollEstimate> roll;
  if (scan.geometry.axis_roll_deg == 0 && !understood.stated.axis_roll_deg) roll = find_roll(scan);
  if (roll && !roll->significant) roll.reset();
  const ProjectionSet measured = own_rows(scan);
  const auto range = std::minmax_element(measured.data.begin(), measured.data.end());
  progress.clear();
  Json json = {{"file", path.string()},
               {"kind", "projections"},
               {"geometry", geometry_json(scan.geometry)},
               {"understood", understood_json(scan, understood)},
               {"report", report_json(scan.report)},
               {"range", {*range.first, *range.second}},
               {"default_grid", grid_json(grid)}};
  if (certified) json["certified_grid"] = grid_json(*certified);
  if (scan.cone) json["cone"] = cone_json(scan);
  if (roll) json["roll_found"] = {{"degrees", roll->roll_deg}, {"uncertainty", roll->uncertainty_deg}};
  json["noise"] = noise_json(noise);
  print_result(common, json, [&] {
    print_scan(scan, &understood);
    if (roll) fmt::print("  axis roll    {}\n", words_of(*roll, 0));
    print_noise(noise);
    fmt::print("  integrals    {:.6g} to {:.6g}\n", *range.first, *range.second);
    print_grid(differ ? *certified : grid);
    if (differ)
      fmt::print("  reconstruct  {} x {} x {} cells, first sample at {}\n", grid.cells[0], grid.cells[1],
                 grid.cells[2], vec_text(grid.origin));
  });
  return 0;
}

}  // namespace

int info_command(Arguments& args) {
  args.positional("FILE", "a certified volume, a volume, or projections");
  add_scan(args);
  add_volume_input(args);
  add_noise(args);
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  const auto path = args.path("FILE");
  switch (kind_of(path, args)) {
    case InputKind::certified:
      return certified_info(path, common);
    case InputKind::volume:
      return volume_info(path, args, common);
    case InputKind::scan:
      break;
  }
  return scan_info(path, args, common);
}

}  // namespace vdvr::cli
