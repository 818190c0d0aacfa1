#include "apps/vdvr/output.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include <nlohmann/json.hpp>

#include "apps/common/messages.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certify.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/preparation.hpp"

namespace fs = std::filesystem;

namespace vdvr::cli {

void check_output(const fs::path& path, bool force, const std::vector<fs::path>& inputs) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored))
    throw InputError(fmt::format("{}: is a folder, not a file to write", path.string()));
  for (const auto& input : inputs)
    if (fs::equivalent(path, input, ignored))
      throw InputError(fmt::format("{}: is also the input; choose another output", path.string()));
  if (fs::exists(path, ignored) && !force)
    throw InputError(fmt::format("{}: exists already; --force overwrites it", path.string()));
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, ignored))
    throw InputError(fmt::format("{}: folder '{}' does not exist", path.string(), folder.string()));
}

Json grid_json(const Grid& g) {
  return {{"cells", g.cells}, {"origin", g.origin}, {"spacing", g.spacing}, {"unit", g.unit}};
}

Json geometry_json(const ParallelGeometry& rows) {
  const ParallelGeometry g = own_detector(rows);
  Json j = {{"views", g.views()},   {"rows", g.rows},       {"columns", g.columns},
            {"pitch_u", g.pitch_u}, {"pitch_v", g.pitch_v}, {"center", stated_center({}, rows)},
            {"unit", g.unit}};
  if (g.axis_roll_deg != 0) j["axis_roll"] = g.axis_roll_deg;
  if (!g.series.none())
    j["series"] = {{"views", g.series.theta_rad.size()}, {"rows", g.series.rows}, {"first", g.series.first}};
  if (g.extension.cut > 0) j["columns_cut"] = g.extension.cut;
  if (rows.extension.before > 0 || rows.extension.after > 0)
    j["longer_rows"] = {{"half_acquisition", rows.extension.half_acquisition.value_or(false)},
                        {"pad", text_of(rows.extension.padding)},
                        {"columns_before", rows.extension.before},
                        {"columns_after", rows.extension.after}};
  if (!g.theta_rad.empty()) {
    j["first_angle_deg"] = g.theta_rad.front() * degrees_per_radian;
    j["last_angle_deg"] = g.theta_rad.back() * degrees_per_radian;
  }
  return j;
}

Json report_json(const InputReport& r) {
  return {{"name", r.name},
          {"sha256", r.sha256},
          {"format", r.format},
          {"dead_pixels", r.dead_pixels},
          {"transmission_floor", r.transmission_floor},
          {"center_source", r.center_source},
          {"air_background", r.air_background},
          {"notes", r.notes}};
}

Json bounds_json(const std::vector<Bound>& bounds) {
  Json list = Json::array();
  for (const auto& b : bounds)
    list.push_back({{"stage", b.stage},
                    {"method", b.method},
                    {"rate", b.rate},
                    {"value", b.value},
                    {"rigorous", b.rigorous}});
  return list;
}

namespace {

Json term_json(const ErrorTerm& t) { return {{"value", t.value}, {"method", t.method}}; }

}  // namespace

Json budget_json(const ErrorBudget& b) {
  Json sampler = {{"buffer", term_json(b.sampler.buffer)}};
  if (b.sampler.image3d) sampler["image3d"] = term_json(*b.sampler.image3d);
  return {{"grid", term_json(b.grid)},
          {"gold", term_json(b.gold)},
          {"projection", term_json(b.projection)},
          {"arithmetic", term_json(b.arithmetic)},
          {"sampler", sampler}};
}

Json certificate_json(const Certificate& certificate) { return Json::parse(to_json(certificate)); }
std::string record_name(const Certificate& certificate) {
  return certificate.comparison ? "comparison" : "certificate";
}

std::array<int, 3> cells_per_base_sample(const LevelTriple& c) { return {1 << c[2], 1 << c[1], 1 << c[0]}; }

Json seconds_json(const std::map<std::string, double>& seconds) { return Json(seconds); }

// --- text ---

std::string vec_text(const Vec3& v) { return fmt::format("{:.6g}, {:.6g}, {:.6g}", v[0], v[1], v[2]); }

std::string bytes_text(std::uint64_t bytes) {
  const double b = static_cast<double>(bytes);
  if (b < 1 << 20) return fmt::format("{:.1f} KiB", b / (1 << 10));
  if (b < 1 << 30) return fmt::format("{:.1f} MiB", b / (1 << 20));
  return fmt::format("{:.2f} GiB", b / (1 << 30));
}

void print_notes(const std::vector<std::string>& notes) {
  for (const auto& note : notes) fmt::print("  note         {}\n", with_options(note));
}

void print_grid(const Grid& g) {
  fmt::print("grid           {} x {} x {} cells of {:.6g} x {:.6g} x {:.6g} {}, first sample at {}\n",
             g.cells[0], g.cells[1], g.cells[2], g.spacing[0], g.spacing[1], g.spacing[2], g.unit,
             vec_text(g.origin));
}

void print_bounds(const std::vector<Bound>& bounds, double epsilon_abs) {
  if (bounds.empty()) return;
  // One row per method in the order computed, one column per rate.
  std::set<int> rates;
  std::vector<std::pair<std::string, std::string>> rows;
  std::map<std::pair<std::string, std::string>, std::map<int, double>> values;
  for (const auto& b : bounds) {
    const std::pair key{b.stage, b.method + (b.rigorous ? "" : " (comparison)")};
    if (!values.contains(key)) rows.push_back(key);
    values[key][b.rate] = b.value;
    rates.insert(b.rate);
  }
  std::stable_sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  fmt::print("bounds         % of the tolerance {:.4g}\n", epsilon_abs);
  fmt::print("  {:<11} {:<52}", "stage", "method");
  for (const int rate : rates) fmt::print(" {:>8}x", rate);
  fmt::print("\n");
  for (const auto& row : rows) {
    fmt::print("  {:<11} {:<52}", row.first, row.second);
    for (const int rate : rates) {
      const auto found = values[row].find(rate);
      if (found == values[row].end()) fmt::print(" {:>9}", "");
      else fmt::print(" {:>9.4g}", 100 * found->second / epsilon_abs);
    }
    fmt::print("\n");
  }
}

void print_budget(const ErrorBudget& budget, double epsilon_abs) {
  const auto line = [&](const char* name, const ErrorTerm& t) {
    fmt::print("    {:<18} {:>11.4g}  {:>6.1f} %  {}\n", name, t.value, 100 * t.value / epsilon_abs,
               t.method);
  };
  fmt::print("  shares of the tolerance {:.4g} (the largest of each; they do not peak at one point)\n",
             epsilon_abs);
  line("grid", budget.grid);
  line("gold", budget.gold);
  line("projection", budget.projection);
  line("arithmetic", budget.arithmetic);
  // A plan knows no stored samples yet, and so no sampler's share.
  if (!budget.sampler.buffer.method.empty()) line("sampler buffer", budget.sampler.buffer);
  if (budget.sampler.image3d) line("sampler image3d", *budget.sampler.image3d);
}

// A split that is this much more, or less, than what was predicted says something (docs/noise.md).
constexpr double much_more = 1.5, much_less = 0.8;

void print_noise_record(const Certificate& c) {
  const NoiseRecord& n = *c.noise;
  const double worst = worst_in_sigma(c, false);
  fmt::print("  noise        sigma of F {:.4g} ({:.4g} to {:.4g}), estimated from {}{}\n", n.median, n.least,
             n.largest, n.source, n.photons > 0 ? fmt::format(": {:.4g} photons a pixel", n.photons) : "");
  if (worst > 0 && !c.comparison)
    fmt::print("  in sigma     interpolation errs by at most {:.3g} sigma of its brick{}{}\n", worst,
               n.tolerance_sigmas ? fmt::format("; {:g} was asked for", *n.tolerance_sigmas) : "",
               n.rms_in_sigma ? fmt::format("; {:.2g} in the mean, estimated", *n.rms_in_sigma) : "");
  if (n.split_ratio) fmt::print("  split        {}\n", split_words(*n.split_ratio, n.split_resolved));
}

std::string split_words(double ratio, bool resolved) {
  const char* judgement = "";
  if (!resolved) judgement = ", with what so few views alias beside noise";
  else if (ratio > much_more)
    judgement = ": more than noise differs between neighbouring views (motion, beam, drift)";
  else if (ratio < much_less)
    judgement = ": less than predicted (texture taken for noise, or pixels that share theirs)";
  return fmt::format("halves of the views differ by {:.2f} of sigma{}", ratio, judgement);
}

void print_certificate(const Certificate& c) {
  const auto verdict = [&](const char* sampler, bool holds, double total) {
    fmt::print("  {:<12} {}: total {:.4g}, {:.1f} % of the tolerance\n", sampler,
               c.comparison ? "not certified"
               : holds      ? "holds"
                            : "DOES NOT HOLD",
               total, 100 * total / c.epsilon_abs);
  };
  if (c.comparison) fmt::print("NOT CERTIFIED  built for comparison; what the certificate would say:\n");
  fmt::print("certificate    |V - F| <= {:.4g} at every covered point{}{}: {:.4g} % of the range {:.4g}\n",
             c.epsilon_abs, c.roi ? " of the region of interest" : "", c.window ? " within the window" : "",
             100 * c.epsilon, c.reference_range);
  verdict("buffer", c.holds_buffer, c.total_buffer);
  if (c.holds_image3d && c.total_image3d) verdict("image3d", *c.holds_image3d, *c.total_image3d);
  print_budget(c.budget, c.epsilon_abs);
  if (c.noise) print_noise_record(c);
  fmt::print("  measured     |V - gold| {:.4g}, with gold's and the projections' own errors {:.4g}, at {}\n",
             c.measured_max, c.measured_total, vec_text(c.worst_at));
  fmt::print("  rates        u {}x {}, gold {}x\n", c.rates.upsampling, text_of(c.rates.interpolation),
             c.rates.gold);
  fmt::print("  field        filter {} to {:.4g} of Nyquist{}\n", text_of(c.field.filter), c.field.cutoff,
             c.field.center ? fmt::format(", centre {:.4f}", *c.field.center) : "");
  if (const InputStatement stated = noted_input(c); !stated.none())
    fmt::print("  stated       of the input: {}\n", text_of(stated));
  if (!c.field.preparation.none())
    fmt::print("  prepared     {}; F is that of the prepared projections\n", text_of(c.field.preparation));
  fmt::print("  not covered  {} samples ({:.2f} %)\n", c.not_covered_count, 100 * c.not_covered_fraction);
  if (c.window)
    fmt::print("  window       only where F lies in [{:.6g}, {:.6g}]\n", c.window->first, c.window->second);
  if (c.roi) {
    const auto& r = *c.roi;
    fmt::print("  roi          only the points from {} to {}\n", vec_text({r[0], r[1], r[2]}),
               vec_text({r[3], r[4], r[5]}));
  }
  fmt::print("  input        {} (sha256 {})\n  content      sha256 {}\n", c.input_name, c.input_sha256,
             c.content_sha256);
  print_notes(c.notes);
}

void print_storage(const MixedVolume& volume, std::uint64_t file_bytes) {
  const Storage all = storage_of(volume, false), interior = storage_of(volume, true);
  fmt::print("storage        {:.3f} samples per base sample (interior {:.3f}), {} on the device",
             all.samples_ratio, interior.samples_ratio, bytes_text(all.device_bytes));
  if (file_bytes != 0) fmt::print(", {} in the file", bytes_text(file_bytes));
  fmt::print("\n  bricks       {} of {}^3 cells; by level zyx: {}\n", volume.brick_count(),
             volume.granularity, levels_json(volume).dump());
  const auto base = cells_per_base_sample(volume.coarsening);
  fmt::print("  base         a sample every {} x {} x {} cells\n", base[0], base[1], base[2]);
}

void print_seconds(const std::map<std::string, double>& seconds) {
  double sum = 0;
  std::string text;
  for (const auto& [stage, s] : seconds) {
    text += fmt::format("{}{} {:.2f}", text.empty() ? "" : ", ", stage, s);
    sum += s;
  }
  fmt::print("seconds        {:.2f} ({})\n", sum, text);
}

}  // namespace vdvr::cli
