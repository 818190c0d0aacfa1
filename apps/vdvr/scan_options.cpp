#include "apps/vdvr/scan_options.hpp"

#include <fmt/format.h>

#include "vdvr/error.hpp"

namespace vdvr::cli {
namespace {

// Digits, colons and commas make ranges; anything else that ends so is a file.
bool names_file(const Arguments& args) {
  return args.has("views") && args.text("views").find_first_not_of("0123456789:,") != std::string::npos;
}

/// --darks and --flats: a level, or none.
std::optional<double> level(const Arguments& args, const std::string& name, double if_none) {
  if (!args.has(name)) return {};
  const std::string text = args.text(name);
  return text == "none" ? if_none : parse_number("--" + name, text);
}

}  // namespace

void add_scan(Arguments& args) {
  args.group("Input (what its files do not say, or say otherwise)")
      .value("angles-file", "FILE",
             "for stacks and HDF5 files: angles, one per view; degrees, unless --angle-unit says otherwise")
      .value("angle-unit", "degrees|radians", "of the angles, whatever the file of them says")
      .value("beam", "cone|parallel",
             "cone: by the distances of an NXtomo file, which is read as parallel beam otherwise")
      .value("entry", "NAME", "the group of an HDF5 file that holds the scan, where there are several")
      .value("views", "RANGES", "the projections used, half-open ranges counted from 0: 0:40,41:90")
      .value("darks", "none|LEVEL", "counts without beam, in place of darks; none: 0")
      .value("flats", "none|LEVEL", "counts of the open beam, in place of flats; none: 1")
      .flag("transmission", "values are transmissions: normalised by flats and darks, without -log")
      .flag("line-integrals", "values are line integrals: normalised, and -log was taken")
      .flag("follow-links",
            "read and hash what HDF5 links and virtual datasets name outside the scan's folder too");
}

InputStatement input_statement(const Arguments& args, const InputStatement& stored) {
  InputStatement s = stored;
  if (args.has("entry")) s.entry = args.text("entry");
  if (args.has("views") && !names_file(args)) s.views = view_ranges_of(args.text("views"));
  else if (args.has("views") && !args.has("picture-tolerance"))
    throw InputError(
        fmt::format("--views: '{}' is no list of ranges, such as 0:40,41:90 (files of cameras go with "
                    "--picture-tolerance)",
                    args.text("views")));
  if (const auto dark = level(args, "darks", 0)) s.dark = dark;
  if (const auto flat = level(args, "flats", 1)) s.flat = flat;
  if (args.has("transmission") && args.has("line-integrals"))
    throw InputError("--transmission and --line-integrals exclude each other");
  if (args.has("transmission")) s.values = SampleValues::transmission;
  if (args.has("line-integrals")) s.values = SampleValues::line_integrals;
  if (args.has("angle-unit")) {
    s.angle_unit = angle_unit_of(args.text("angle-unit"));
    if (!s.angle_unit)
      throw InputError(
          fmt::format("--angle-unit: '{}'; it must be degrees or radians", args.text("angle-unit")));
  }
  return s;
}

bool has_picture_views(const Arguments& args) {
  return args.has("picture-views") || (args.has("picture-tolerance") && names_file(args));
}

std::string picture_views(const Arguments& args) {
  return args.text(args.has("picture-views") ? "picture-views" : "views");
}

}  // namespace vdvr::cli
