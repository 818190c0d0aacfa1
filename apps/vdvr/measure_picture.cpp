#include "apps/vdvr/measure_picture.hpp"

#include <fmt/format.h>

#include "vdvr/error.hpp"

namespace vdvr::cli {

void add_measure_picture(Arguments& args) {
  args.group("Picture")
      .value("picture", "X.png",
             "a slice: what is surely, possibly and surely not in the range; with --components each in a "
             "colour of its own; of --histogram its band")
      .value("slice-axis", "x|y|z", "default z")
      .value("slice-position", "P", "world (default: the middle of what is measured)")
      .value("size", "512x512", "pixels, at most");
}

void check_measure_picture(const Arguments& args, bool of_range, bool of_histogram) {
  if (!args.has("picture")) {
    refuse(args, {"slice-axis", "slice-position", "size"}, "is of --picture");
    return;
  }
  if (args.path("picture").extension() != ".png")
    throw InputError(fmt::format("--picture: {}: is written as .png", args.text("picture")));
  if (of_range == of_histogram)
    throw InputError(
        "--picture: of what? Give either --above, --below or --between, or --histogram, and not --along");
  if (of_histogram) refuse(args, {"slice-axis", "slice-position"}, "is not of --histogram");
}

MeasurePictureOptions measure_picture_options(const Arguments& args) {
  MeasurePictureOptions o;
  o.axis = args.choice("slice-axis", "z")[0] - 'x';
  o.position = args.number("slice-position");
  if (const auto size = args.sizes("size", 2)) {
    o.width = (*size)[0];
    o.height = (*size)[1];
  }
  return o;
}

}  // namespace vdvr::cli
