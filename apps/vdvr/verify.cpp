// vdvr verify: measures a certificate again from the projections and the packed volume alone.
#include "vdvr/verify.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "apps/vdvr/inputs.hpp"
#include "apps/common/progress.hpp"
#include "apps/vdvr/verification.hpp"
#include "vdvr/error.hpp"

namespace vdvr::cli {

namespace {

/// What `verify` measures: the total with the device's worse sampler.
double certified_total(const Certificate& c) {
  return std::max(c.total_buffer, c.total_image3d.value_or(c.total_buffer));
}

/// Per sampler: what it may err, whether that holds, or why it was not judged.
Json samplers_json(const VerifyResult& m, const Certificate& c) {
  Json json = Json::object();
  const auto add = [&](const char* name, bool promised, const std::optional<double>& total,
                       const std::optional<bool>& holds) {
    Json& entry = json[name];
    entry["promised"] = promised;
    entry["total"] = total ? Json(*total) : Json(nullptr);
    entry["holds"] = holds ? Json(*holds) : Json(nullptr);
  };
  add("buffer", c.holds_buffer, m.total_buffer, m.holds_buffer);
  add("image3d", c.holds_image3d.value_or(false), m.total_image3d, m.holds_image3d);
  return json;
}

std::string sampler_text(bool promised, const std::optional<double>& total,
                         const std::optional<bool>& holds) {
  if (!total) return promised ? "promised, but this device has no such sampler" : "not on this device";
  return fmt::format("{:.5g}, {}", *total, !holds ? "not promised" : *holds ? "holds" : "DOES NOT HOLD");
}

}  // namespace

Json verification_json(const VerifyResult& m, const Certificate& c) {
  return {{"holds", m.holds},
          {"epsilon_abs", m.epsilon_abs},
          {"measured",
           {{"measured_max", m.measured_max}, {"measured_total", m.measured_total}, {"total", m.total}}},
          {"certified",
           {{"measured_max", c.measured_max},
            {"measured_total", c.measured_total},
            {"total", certified_total(c)}}},
          {"arithmetic", m.arithmetic},
          {"samplers", samplers_json(m, c)},
          {"worst_at", m.worst_at},
          {"worst",
           {{"brick", m.worst.brick},
            {"brick_zyx", {m.worst.brick_at[2], m.worst.brick_at[1], m.worst.brick_at[0]}},
            {"level", m.worst.level},
            {"dataset", m.worst.dataset},
            {"tile", m.worst.tile},
            {"sample_zyx", {m.worst.sample[2], m.worst.sample[1], m.worst.sample[0]}},
            {"value", m.worst.value},
            {"field", m.worst.field}}},
          {"bricks_tested", m.bricks_tested},
          {"bricks", m.bricks},
          {"nodes_tested", m.nodes_tested},
          {"cells_tested", m.cells_tested},
          {"bricks_finer", m.bricks_finer},
          {"finest_rate", m.finest_rate},
          {"seams", m.seams},
          {"points_evaluated", m.points_evaluated},
          {"worst_share", m.worst_share},
          {"differences", m.differences},
          {"failure", m.failure}};
}

void print_verification(const VerifyResult& m, const Certificate& c) {
  fmt::print("verification   {} of {} bricks, {} gold cells, {} gold nodes: {}\n", m.bricks_tested, m.bricks,
             m.cells_tested, m.nodes_tested, m.holds ? "holds" : "DOES NOT HOLD");
  if (m.bricks_finer > 0)
    fmt::print("    {} bricks again on finer gold, up to {}x\n", m.bricks_finer, m.finest_rate);
  const auto line = [](const char* what, double measured, double certified) {
    fmt::print("    {:<18} measured {:>11.5g}   certified {:>11.5g}\n", what, measured, certified);
  };
  line("|V - F| at nodes", m.measured_max, c.measured_max);
  line("and between them", m.measured_total, c.measured_total);
  line("total", m.total, certified_total(c));
  fmt::print("    {:<18} {}\n    {:<18} {}\n", "sampler buffer",
             sampler_text(c.holds_buffer, m.total_buffer, m.holds_buffer), "sampler image3d",
             sampler_text(c.holds_image3d.value_or(false), m.total_image3d, m.holds_image3d));
  fmt::print("    {:<18} {:>20.5g}\n    worst at           {}\n", "tolerance", m.epsilon_abs,
             vec_text(m.worst_at));
  if (m.points_evaluated > 0)
    fmt::print("    {:<18} {} between nodes: at most {:.1f} % of what the certificate bounds there\n",
               "points", m.points_evaluated, 100 * m.worst_share);
  for (const std::string& what : m.differences) fmt::print("    DIFFERS            {}\n", what);
}

namespace {

/// F is the file's; options given anyway must say the same.
void check_field_options(const Arguments& args, const FieldOptions& stored) {
  if (!has_field_options(args)) return;
  const FieldOptions given = field_options(args);
  const bool same = (!args.has("filter") || given.filter == stored.filter) &&
                    (!args.has("filter-cutoff") || given.cutoff == stored.cutoff) &&
                    (!args.has("center") || given.center == stored.center);
  if (!same)
    throw InputError(
        fmt::format("the file was certified for filter {}, cutoff {}, centre {}; verify takes them from it",
                    stored.filter, stored.cutoff, stored.center.value_or(0)));
}

}  // namespace

int verify_command(Arguments& args) {
  args.positional("FILE", "the certified volume")
      .value("projections", "IN", "the projections it was built from")
      .flag("exhaustive", "every gold node; otherwise a stratified sample of bricks and the worst ones");
  add_scan(args);
  add_field(args);
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  const auto path = args.path("FILE"), projections = args.path("projections");
  if (kind_of(path, args) != InputKind::certified)
    throw InputError(fmt::format("{}: is not a certified volume", path.string()));

  ProgressLine progress(args.who(), common.quiet);
  const VdvrFile file = read_vdvr(path, common.max_memory, Altered::report);
  const Certificate& certificate = file.certificate;
  const std::string& altered = file.altered;
  // Damaged samples are named below; a certificate that is not the one written has nothing to compare with.
  if (file.seal == Seal::broken && content_sha256(file.volume) == certificate.content_sha256)
    throw MismatchError(fmt::format("{}: {}", path.string(), altered));
  if (altered.empty()) check_consistency(path, certificate);
  if (certificate.comparison)
    throw MismatchError(
        fmt::format("{}: was built for comparison: it carries no promise to verify", path.string()));
  check_field_options(args, certificate.field);
  const ProjectionSet scan = load_scan(projections, args, certificate.field, progress.callback());
  check_input(projections, scan, certificate);
  Device device = open_device(common);
  VerifyOptions options;
  // An altered content may err anywhere: say where it does.
  options.exhaustive = args.has("exhaustive") || !altered.empty();
  const VerifyResult result = verify(device, scan, file.volume, certificate, options, progress.callback());
  progress.clear();

  Json json = {{"file", path.string()},
               {"projections", projections.string()},
               {"exhaustive", options.exhaustive},
               {"seal", text_of(file.seal)},
               {"content_matches", altered.empty()}};
  json.update(verification_json(result, certificate));
  print_result(common, json, [&] {
    fmt::print("{}: {}, {}input matches its hash\n", path.string(), text_of(file.seal),
               altered.empty() ? "content matches its hash, " : "");
    print_verification(result, certificate);
  });
  if (!altered.empty())
    throw MismatchError(
        fmt::format("{}: {}; {}", path.string(), altered,
                    result.holds ? "it is still within epsilon everywhere tested" : result.failure));
  if (!result.holds) throw MismatchError(fmt::format("{}: {}", path.string(), result.failure));
  return 0;
}

}  // namespace vdvr::cli
