// The table of claims: what the paper says, what was found in this run, and what that makes of it. Verdicts
// are computed from the JSON of the other sections; reasons are given where a claim does not hold.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/paper/report.hpp"

namespace vdvr::paper {
namespace {

enum class Verdict { reproduced, improved, not_reproduced, not_run };
const char* text_of(Verdict v) {
  switch (v) {
    case Verdict::reproduced:
      return "reproduced";
    case Verdict::improved:
      return "improved on";
    case Verdict::not_reproduced:
      return "not reproduced";
    case Verdict::not_run:
      break;
  }
  return "not run";
}

struct Claim {
  std::string where, says, found;
  Verdict verdict;
  std::string why;
};

Verdict held(bool holds) { return holds ? Verdict::reproduced : Verdict::not_reproduced; }

/// The element of a list whose member has this value; null where there is none.
Json with(const Json& list, const std::string& member, const Json& value) {
  for (const auto& j : list)
    if (j.contains(member) && j[member] == value) return j;
  return {};
}
Json case_of(const Json& list, const std::string& settings, double epsilon) {
  for (const auto& j : list)
    if (j["settings"] == settings && j["epsilon"] == epsilon) return j;
  return {};
}

void claim_projections(const Json& all, std::vector<Claim>& claims) {
  const Json at30 = with(all["figure_3"], "angles", 30), at72 = with(all["figure_3"], "angles", 72),
             at120 = with(all["figure_3"], "angles", 120);
  const double up72 = at72["upsampled"]["rms_normalised"], up120 = at120["upsampled"]["rms_normalised"];
  const double d30 = at30["d2vr"]["rms_normalised"], d72 = at72["d2vr"]["rms_normalised"],
               d120 = at120["d2vr"]["rms_normalised"];
  claims.push_back({"Fig. 3", "8x upsampled: RMSE 0.7 % at 72 views", percent(up72),
                    held(up72 >= 0.006 && up72 <= 0.008), ""});
  claims.push_back({"Section 3.2", "the upsampled error still falls after 72 views",
                    fmt::format("{} at 72, {} at 120", percent(up72), percent(up120)), held(up120 < up72),
                    ""});
  claims.push_back({"Fig. 3", "D2VR stops improving after 30 views",
                    fmt::format("{} at 30, {} at 72, {} at 120", percent(d30), percent(d72), percent(d120)),
                    held(d120 > 0.85 * d30), "held while 120 views leave more than 85 % of the error of 30"});
  claims.push_back({"Fig. 3", "D2VR stalls at about 5 % RMSE", percent(d72),
                    held(d72 >= 0.045 && d72 <= 0.065),
                    "half of it in per cent of the range, the unit in which the upsampled error agrees; the "
                    "paper's unit is not given"});
  const double e1 = all["figure_4"][0]["by_axes"][0], e8 = all["figure_4"][3]["by_axes"][0],
               e8_2 = all["figure_4"][3]["by_axes"][1], e8_3 = all["figure_4"][3]["by_axes"][2];
  claims.push_back({"Section 3.3.1", "a wave errs up to 100 % at 1x, below 1.92 % at 8x",
                    fmt::format("{} and {} (one dimension)", percent(e1, 4), percent(e8, 4)),
                    held(std::abs(e1 - 1) < 1e-6 && e8 < 0.01925), ""});
  claims.push_back({"Fig. 5, Section 3.3.2",
                    "8x removes the error almost completely, below 2 %, in two dimensions too",
                    fmt::format("2D {}, 3D {}", percent(e8_2), percent(e8_3)), held(e8_3 < 0.02),
                    "below 2 % holds in one dimension only: the errors of the axes add"});
  const Json sums = all["figure_5"]["row_sums"]["projection"];
  const double one = sums["1x"], eight = sums["8x"];
  claims.push_back({"Fig. 5c",
                    "the sum falls by almost two orders of magnitude from 1x to 8x (22 % to 0.4 %)",
                    fmt::format("{} to {}, {:.0f} times", percent(one), percent(eight), one / eight),
                    held(one / eight > 30), "another object: the sums differ, the factor is the claim"});
}

/// What the paper's own settings give at one tolerance.
void claim_threshold(const Json& table, double e, std::vector<Claim>& claims) {
  const Json cells = case_of(table, "paper, cell by cell", e),
             open = case_of(table, "paper, closing none", e), closed = case_of(table, "paper", e);
  if (cells.is_null() || open.is_null() || closed.is_null()) {
    claims.push_back({"Table 2", fmt::format("Marschner-Lobb at {}", percent(e)), "", Verdict::not_run,
                      "--quick leaves it out"});
    return;
  }
  const double said_rms = open["paper"]["rms"], said = open["paper"]["samples_ratio"];
  const double rms = cells["to_function"]["rms"], closed_rms = closed["to_function"]["rms"];
  const double before = open["storage"]["interior"]["samples_ratio"],
               after = closed["storage"]["interior"]["samples_ratio"];
  claims.push_back({"Table 2", fmt::format("{}: RMS {:.3g}", percent(e), said_rms),
                    fmt::format("{:.3g} refined cell by cell ({:+.1f} %), {:.3g} in closed bricks of 4", rms,
                                100 * (rms / said_rms - 1), closed_rms),
                    held(std::abs(rms / said_rms - 1) <= 0.1),
                    "held within 10 %; whole bricks refine more than need be"});
  claims.push_back(
      {"Table 2", fmt::format("{}: storage {:.2f} times", percent(e), said),
       fmt::format("{:.2f} before closing ({:+.0f} %), {:.2f} after", before, 100 * (before / said - 1),
                   after),
       held(std::abs(before / said - 1) <= 0.16),
       fmt::format("held within 16 % before closing; the closing of Fig. 9 makes it {:.1f} times as much",
                   after / before)});
}

/// The same tolerance, certified.
void claim_ours(const Json& table, double e, std::vector<Claim>& claims) {
  const Json ours = case_of(table, "ours", e);
  if (ours.is_null()) return;
  const double said = ours["paper"]["samples_ratio"], mine = ours["storage"]["interior"]["samples_ratio"],
               bytes = ours["storage"]["interior"]["bytes_ratio"];
  claims.push_back({"Table 2, ours", fmt::format("{}: the same tolerance, certified", percent(e)),
                    fmt::format("{:.2f} samples, {:.2f} bytes per base", mine, bytes),
                    mine < said ? Verdict::improved : Verdict::not_reproduced,
                    mine < said
                        ? "coefficients fitted to the filter, closing to the coarse side, integer tiles"
                        : "a certificate counts the errors of gold, projections and rounding too"});
}

void claim_thresholds(const Json& all, std::vector<Claim>& claims) {
  for (const double e : {0.04, 0.03, 0.02, 0.01}) {
    claim_threshold(all["table_2_marschner_lobb"], e, claims);
    claim_ours(all["table_2_marschner_lobb"], e, claims);
  }
}

/// In the unit of the paper's tolerances, the field's maximum.
void claim_maps(const Json& all, std::vector<Claim>& claims) {
  const auto slice = [&](const std::string& method, const char* truth) {
    const Json j = with(all["figure_12"], "method", method);
    return j.is_null() ? std::nan("") : j["slice"][truth]["max"].get<double>() / j["maximum"].get<double>();
  };
  const auto found = [&](const std::string& method) {
    return fmt::format("{} against F, {} against the function (of F's maximum)",
                       percent(slice(method, "to_field")), percent(slice(method, "to_function")));
  };
  for (const char* method : {"VDVR (paper) 3 %", "VDVR (ours) 3 %"})
    claims.push_back({"Fig. 12c", fmt::format("all pixels of {} lie below 3 %", method), found(method),
                      held(slice(method, "to_field") < 0.03),
                      "against F, which is what a tolerance is about; F itself differs from the function"});
  const double dvr = slice("uniform DVR", "to_field"), d2vr = slice("D2VR", "to_field");
  claims.push_back({"Fig. 12b", "uniform DVR errs up to 4 %", found("uniform DVR"),
                    held(dvr > 0.035 && dvr < 0.045), "held from 3.5 to 4.5 % against F"});
  claims.push_back({"Fig. 12a", "D2VR has rings of up to 6 %", found("D2VR"), held(d2vr >= 0.06),
                    "held from 6 % on; the paper takes this largest error for the RMSE of its Fig. 3"});
}

Json speed_of(const Json& list, const std::string& object, const std::string& method) {
  for (const auto& j : list)
    if (j["object"] == object && j["method"] == method) return j;
  return {};
}

void claim_speeds(const Json& list, std::vector<Claim>& claims) {
  for (const char* object :
       {"Marschner-Lobb", "Shepp-Logan", "Shepp-Logan, the middle", "head at carp size"}) {
    const Json ours = speed_of(list, object, "VDVR (ours)"), uniform = speed_of(list, object, "uniform DVR");
    if (ours.is_null() || uniform.is_null()) continue;
    const double times = ours["times_d2vr"], dvr_times = uniform["times_d2vr"];
    claims.push_back(
        {"Section 1", fmt::format("{}: D2VR is about 50 times slower than DVR", object),
         fmt::format("{:.0f} times; than VDVR {:.0f} times", dvr_times, times), held(dvr_times >= 30),
         dvr_times >= 30
             ? "held from 30 times on"
             : "held from 30 times on; few views whose projections stay in the caches favour D2VR"});
  }
  const Json d2vr = speed_of(list, "Marschner-Lobb", "D2VR"),
             fine = speed_of(list, "Marschner-Lobb", "D2VR, 8x upsampled");
  const double growth = fine["bytes"].get<double>() / d2vr["bytes"].get<double>();
  claims.push_back({"Section 3.2", "upsampling the projections 8 times costs D2VR 64 times the memory",
                    fmt::format("{:.0f} times", growth), held(growth > 55 && growth < 72), ""});
}

void claim_pictures(const Json& all, std::vector<Claim>& claims) {
  const Json mixed = with(all["figure_11"], "volume", "VDVR (ours) 2 %"),
             upsampled = with(all["figure_11"], "volume", "upsampled, equal");
  const double a = mixed["to_field"]["rms"], b = upsampled["to_field"]["rms"],
               a_max = mixed["to_field"]["max"], b_max = upsampled["to_field"]["max"];
  claims.push_back({"Fig. 11", "with equal samples, mixed resolution shows more detail than upsampling",
                    fmt::format("against F: largest {} for {}, RMSE {} for {}", percent(a_max),
                                percent(b_max), percent(a), percent(b)),
                    held(a_max < b_max), ""});
  const Json flat = with(all["figure_10"], "field", "uniform 1x"),
             fine = with(all["figure_10"], "field", "VDVR (ours)"),
             truth = with(all["figure_10"], "field", "function");
  const double low = flat["thin_over_thick"], high = fine["thin_over_thick"];
  claims.push_back({"Fig. 10", "thin tumours look dimmer at base resolution, and right in VDVR",
                    fmt::format("thin over thick: {:.3f} uniform, {:.3f} VDVR, {:.3f} the function", low,
                                high, truth["thin_over_thick"].get<double>()),
                    held(std::abs(high - 1) < std::abs(low - 1)), ""});
  claim_speeds(all["speed"], claims);
}

void claim_objects(const Json& all, std::vector<Claim>& claims) {
  if (all["figure_14"].is_string()) {
    claims.push_back({"Fig. 14, Tables 1 and 2", "carp and beetle", "", Verdict::not_run, "give --head"});
    return;
  }
  const Json carp = case_of(all["table_2_head"], "ours", 0.03),
             theirs = case_of(all["table_2_head"], "paper", 0.03);
  claims.push_back(
      {"Fig. 14", "a practical object at 3 % takes 2.4 times the storage",
       fmt::format("{:.2f} samples, {:.2f} bytes (paper's settings {:.2f})",
                   carp["storage"]["samples_ratio"].get<double>(),
                   carp["storage"]["bytes_ratio"].get<double>(),
                   theirs["storage"]["samples_ratio"].get<double>()),
       carp["storage"]["bytes_ratio"].get<double>() < 2.41 ? Verdict::improved : Verdict::not_reproduced,
       "another object: a head, not the carp"});
  const Json mixed = with(all["figure_14"], "volume", "VDVR (ours) 3 %"),
             upsampled = with(all["figure_14"], "volume", "upsampled, equal");
  const double a = mixed["to_field"]["max"].get<double>() / mixed["range"].get<double>(),
               b = upsampled["to_field"]["max"].get<double>() / mixed["range"].get<double>();
  claims.push_back({"Fig. 14", "at equal storage, mixed resolution resolves what upsampling does not",
                    fmt::format("largest error against F {} for {}", percent(a), percent(b)), held(a < b),
                    ""});
}

}  // namespace

void add_claims(Report& run) {
  std::vector<Claim> claims;
  claim_projections(run.json, claims);
  claim_thresholds(run.json, claims);
  claim_maps(run.json, claims);
  claim_pictures(run.json, claims);
  claim_objects(run.json, claims);
  Table table{"claims",
              "What the paper says, and what this run found",
              {"where", "the paper", "found", "verdict", "why"},
              {}};
  Json list = Json::array();
  for (const Claim& c : claims) {
    table.rows.push_back({c.where, c.says, c.found, text_of(c.verdict), c.why});
    list.push_back({{"where", c.where},
                    {"paper", c.says},
                    {"found", c.found},
                    {"verdict", text_of(c.verdict)},
                    {"why", c.why}});
  }
  run.json["claims"] = list;
  // First on the page: what the rest gives the numbers for.
  run.sections.insert(run.sections.begin(),
                      {"Claims", {"Verdicts follow from this run's numbers."}, {}, {std::move(table)}, {}});
}

}  // namespace vdvr::paper
