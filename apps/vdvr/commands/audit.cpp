// vdvr audit: how far anybody's volume lies from F, at its samples and between them.
#include "vdvr/expert/audit.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/common/progress.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/output.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/audit_picture.hpp"

namespace fs = std::filesystem;

namespace vdvr::cli {
namespace {

/// 3 %, or a density.
void take_within(const Arguments& args, AuditOptions& options) {
  if (!args.has("within")) return;
  options.within_share = args.text("within").ends_with('%');
  options.within = options.within_share ? fraction_option(args, "within") : args.positive_or("within", 0);
}

AuditOptions audit_options(const Arguments& args) {
  AuditOptions options;
  options.field = field_options(args);
  options.between = between_of(args.has("interpolate") ? args.choice("interpolate", "linear") : "linear")
                        .value_or(Between::linear);
  options.as_is = args.has("as-is");
  if (args.has("radius")) options.radius = args.positive_or("radius", 0);
  options.roi = build_options(args).roi;
  take_within(args, options);
  return options;
}

PlaceOptions place_options(const Arguments& args) {
  const GridOptions asked = grid_options(args);
  PlaceOptions place;
  if (asked.spacing)
    place.spacing = Vec3{*asked.spacing, *asked.spacing, asked.spacing_z.value_or(*asked.spacing)};
  place.origin = asked.origin;
  return place;
}

// --- what is printed ---

Json figures_json(const AuditFigures& f, Between between) {
  const auto share = [&](double e) { return f.span() > 0 ? Json(e / f.span()) : Json(); };
  return {{"samples", f.samples},
          {"range", {f.range.first, f.range.second}},
          {"rms", f.rms},
          {"rms_share", share(f.rms)},
          {"largest", f.largest},
          {"largest_share", share(f.largest)},
          {"largest_at", f.largest_at},
          {"interpolation", text_of(between)},
          {"lower", f.lower},
          {"lower_share", share(f.lower)},
          {"lower_at", f.lower_at},
          {"volume_there", f.w_there},
          {"field_there", f.f_there},
          {"upper", f.upper ? Json(*f.upper) : Json()},
          {"upper_share", f.upper ? share(*f.upper) : Json()},
          {"why_no_upper", f.why_no_upper},
          {"finest_rate", f.finest_rate}};
}

Json registration_json(const Registration& r) {
  return {{"found", r.words},
          {"doubt", r.doubt},
          {"axes", r.axes},
          {"mirrored", r.mirrored},
          {"scale", r.scale},
          {"offset", r.offset},
          {"shift_samples", r.shift},
          {"center_off", r.center},
          {"filter", text_of(r.window)},
          {"unexplained", r.unexplained},
          {"unexplained_registered", r.unexplained_registered}};
}

void print_figures(const AuditFigures& f, Between between) {
  const auto both = [&](double e) {
    return f.span() > 0 ? fmt::format("{:.4g} ({:.3g} % of F's range)", e, 100 * e / f.span())
                        : fmt::format("{:.4g}", e);
  };
  fmt::print("  at samples   rms {}, largest {} at {}\n", both(f.rms), both(f.largest),
             vec_text(f.largest_at));
  fmt::print("  between      {}: at least {} at {}, where it is {:.6g} and F {:.6g}\n", text_of(between),
             both(f.lower), vec_text(f.lower_at), f.w_there, f.f_there);
  if (f.upper)
    fmt::print("  certified    nowhere above {} in cells whose samples all views see ({} samples)\n",
               both(*f.upper), f.samples);
  else fmt::print("  certified    nothing: {}\n", f.why_no_upper);
}

void print_audit(const Audit& a, const AuditOptions& options) {
  if (a.registration) {
    const Registration& r = *a.registration;
    if (!r.doubt.empty()) fmt::print("registered     {}\n", r.doubt);
    else if (r.words.empty())
      fmt::print("registered     nothing is off: turns, factor, shift, centre and window fit\n");
    for (std::size_t i = 0; i < r.words.size(); ++i)
      fmt::print("{:<15}{}\n", i == 0 ? "registered" : "", r.words[i]);
    fmt::print("{:<15}F leaves {:.3g} % of its variance unexplained{}\n", "", 100 * r.unexplained,
               r.words.empty()
                   ? ""
                   : fmt::format(", {:.3g} % once that is put right", 100 * r.unexplained_registered));
  }
  fmt::print("as it is\n");
  print_figures(a.as_is, options.between);
  if (a.registered) {
    fmt::print("once that is put right\n");
    print_figures(*a.registered, options.between);
  }
  fmt::print(
      "a distance     to F, the filtered back-projection of this scan. What is no such back-projection, as "
      "of an "
      "iterative program, may lie far from F and be right; `vdvr residual` tells what F itself does not "
      "explain\n");
}

std::string verdict(const fs::path& path, const AuditFigures& f) {
  const double e = *f.within;
  if (f.lower > e)
    return fmt::format("{}: |W - F| reaches {:.6g} > {:.6g} at {}", path.string(), f.lower, e,
                       vec_text(f.lower_at));
  if (f.upper)
    return fmt::format("{}: not shown to be within {:.6g}: |W - F| reaches {:.6g} and may reach {:.6g}",
                       path.string(), e, f.lower, *f.upper);
  return fmt::format(
      "{}: not shown to be within {:.6g}: |W - F| reaches {:.6g}, and there is no upper end: {}",
      path.string(), e, f.lower, f.why_no_upper);
}

void declare_audit(Arguments& args) {
  args.positional("VOLUME", "a uniform volume of any program: MHA, NRRD, NPY, FILE.h5:/dataset, TIFF slices")
      .value("projections", "SCAN", "the projections that it was reconstructed from")
      .value("interpolate", "nearest|linear|cubic", "what it is between its samples (default linear)")
      .value("within", "E|P%",
             "exit code 1 unless it lies within E of F everywhere, or within a share of F's range")
      .flag("as-is", "do not look for turns, mirrors, factors, shifts, another centre or window")
      .value("radius", "R", "compare only what is that near to the axis")
      .value("output,o", "PNG", "a picture: |W - F| on the slice through the worst point");
  add_volume_input(args);
  add_scan(args);
  add_field(args);
  add_grid(args);
  add_common(args);
}

}  // namespace

int audit_command(Arguments& args) {
  declare_audit(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  const fs::path path = args.path("VOLUME"), projections = args.path("projections"),
                 picture = args.has("output") ? args.path("output") : fs::path();
  const AuditOptions options = audit_options(args);
  refuse(args, {"size"}, "the volume has its samples");
  if (!picture.empty()) {
    if (picture.extension() != ".png")
      throw InputError(fmt::format("{}: write the picture as .png", picture.string()));
    check_output(picture, common.force, {path, projections});
  }
  if (path.extension() == ".vdvr")
    throw InputError(
        fmt::format("{}: a certified volume; `vdvr verify` measures its certificate again", path.string()));

  ProgressLine progress(args.who(), common.quiet);
  Volume volume = load_volume(path, args);
  const ProjectionSet scan = load_scan(projections, args, options.field, progress.callback());
  Device device = open_device(common);
  const PlacedVolume w = placed_volume(std::move(volume), scan, options.field, place_options(args));
  const Audit result = audit(device, scan, w.volume, options, progress.callback());
  if (!picture.empty())
    write_png(picture, audit_picture(device, scan, w.volume, result, options, progress.callback()));
  progress.clear();

  const AuditFigures& f = result.as_is;
  const bool met = !f.within || (f.upper && *f.upper <= *f.within);
  Json json = {{"volume", path.string()},
               {"projections", projections.string()},
               {"grid", grid_json(w.volume.grid)},
               {"spacing_from", w.spacing_from},
               {"origin_from", w.origin_from},
               {"geometry", geometry_json(scan.geometry)},
               {"registration", result.registration ? registration_json(*result.registration) : Json()},
               {"as_is", figures_json(f, options.between)},
               {"registered", result.registered ? figures_json(*result.registered, options.between) : Json()},
               {"within", f.within ? Json(*f.within) : Json()},
               {"met", f.within ? Json(met) : Json()},
               {"picture", picture.empty() ? Json() : Json(picture.string())},
               {"device", device.info().name},
               {"seconds", seconds_json(progress.seconds())}};
  print_result(common, json, [&] {
    print_scan(scan);
    print_grid(w.volume.grid);
    if (w.spacing_from != "file" || w.origin_from != "file")
      fmt::print("{:<15}spacing: {}; origin: {}\n", "", w.spacing_from, w.origin_from);
    print_audit(result, options);
    if (!picture.empty()) fmt::print("written        {}\n", picture.string());
  });
  if (!met) throw MismatchError(verdict(path, f));
  return 0;
}

}  // namespace vdvr::cli
