// vdvr measure: volumes, means, extremes, distributions, lines and components, each as an interval that holds
// for every field within the certificate's bounds.
#include "vdvr/expert/measure.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/common/progress.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/measure_picture.hpp"
#include "apps/vdvr/measure_scan.hpp"
#include "apps/vdvr/measure_tables.hpp"
#include "apps/vdvr/output.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/output_file.hpp"

namespace fs = std::filesystem;

namespace vdvr::cli {
namespace {

void declare_measure(Arguments& args) {
  args.positional("FILE", "a certified volume")
      .group("What is measured")
      .value("above", "C", "the volume where F is at least C, and its share of the region")
      .value("below", "C", "the same where F is at most C: pores, and the porosity")
      .value("between", "C1,C2", "the same where F lies between")
      .flag("mean", "the mean of F")
      .flag("mass", "the integral of F: density times volume")
      .flag("extremes", "the least and the largest F")
      .value("histogram", "N", "the distribution of F in N bins")
      .value("range", "LO,HI", "of the histogram (default from the least to the largest that F can be)")
      .value("along", "X,Y,Z,X,Y,Z",
             "F from one point to another; with --above or --below where it passes C, and how wide what lies "
             "between is")
      .value("samples", "N", "of that profile (default 257)")
      .flag("components", "the parts of what --above, --below or --between asks for")
      .value("least-volume", "V", "leave smaller components out of their table; all are counted")
      .value("connect", "X,Y,Z,X,Y,Z", "with --components: whether these two points are connected")
      .value("output,o", "OUT.csv", "the table of --histogram, --along or --components")
      .group("Where")
      .value("roi", "X0,Y0,Z0,X1,Y1,Z1", "in this box")
      .value("cylinder", "X,Y,Z0,Z1,R", "in an upright cylinder about x, y, from z0 to z1")
      .value("ball", "X,Y,Z,R", "in a ball")
      .value("mask", "VOLUME", "where the nearest sample of a uniform volume is not 0");
  args.group("The projections themselves")
      .value("projections", "SCAN",
             "with --mean: F's own mean by the projections that FILE was built from, and its sigma: what "
             "their noise leaves in it");
  add_scan(args);
  add_noise(args);
  add_measure_picture(args);
  add_volume_input(args);
  add_common(args);
}

struct Asked {
  std::string word;  ///< above, below, between
  ValueRange range;
  std::optional<double> value;  ///< of a line
  bool along = false, components = false, histogram = false;
  [[nodiscard]] bool has_range() const { return !word.empty(); }
};

Asked asked_of(const Arguments& args) {
  Asked asked;
  for (const char* word : {"above", "below", "between"}) {
    if (!args.has(word)) continue;
    if (asked.has_range())
      throw InputError(
          fmt::format("--{} and --{}: give one of them; --between takes two values", asked.word, word));
    asked.word = word;
  }
  if (asked.word == "above") asked.value = asked.range.least = args.number("above");
  if (asked.word == "below") asked.value = asked.range.largest = args.number("below");
  if (asked.word == "between") {
    const auto ends = args.numbers("between", 2).value();
    asked.range = {ends[0], ends[1]};
  }
  asked.along = args.has("along");
  asked.components = args.has("components");
  asked.histogram = args.has("histogram");
  if (asked.components && !asked.has_range())
    throw InputError("--components: of what? Give --above, --below or --between");
  if (!asked.components) refuse(args, {"least-volume", "connect"}, "is for --components");
  if (!asked.along) refuse(args, {"samples"}, "is for --along");
  if (asked.along) refuse(args, {"between"}, "has two values; a line takes --above or --below");
  if (asked.along) refuse(args, {"cylinder", "ball", "mask"}, "is not for --along, which --roi alone cuts");
  if (!asked.histogram) refuse(args, {"range"}, "is for --histogram");
  if (!args.has("mean")) refuse(args, {"projections"}, "is for --mean");
  if (!args.has("projections")) refuse(args, {"photons", "sigma-p"}, "is for --projections");
  check_measure_picture(args, asked.has_range() && !asked.along, asked.histogram);
  const int tables = int{asked.along} + int{asked.components} + int{asked.histogram};
  if (args.has("output") && tables != 1)
    throw InputError(
        "--output: takes the table of one of --histogram, --along and --components; give exactly one of "
        "these");
  if (tables == 0 && !asked.has_range() && !args.has("mean") && !args.has("mass") && !args.has("extremes"))
    throw InputError(
        "nothing to measure: give --above, --below, --between, --mean, --mass, --extremes, --histogram, "
        "--along or "
        "--components");
  return asked;
}

MeasureRegion region_of(const Arguments& args) {
  MeasureRegion region;
  constexpr double far = 1e300;
  if (const auto box = args.numbers("roi", 6)) {
    region.box.emplace();
    std::copy(box->begin(), box->end(), region.box->begin());
  }
  if (const auto c = args.numbers("cylinder", 5)) {
    const double low = (*c)[2], high = (*c)[3];
    if (!(low < high)) throw InputError(fmt::format("--cylinder: {} is not below {} along z", low, high));
    if (!region.box) region.box = {-far, -far, -far, far, far, far};
    (*region.box)[2] = std::max((*region.box)[2], low);
    (*region.box)[5] = std::min((*region.box)[5], high);
    if (!((*region.box)[2] < (*region.box)[5]))
      throw InputError("--cylinder: has no height in common with --roi");
    region.rounds.push_back({{(*c)[0], (*c)[1], 0}, (*c)[4], true});
  }
  if (const auto b = args.numbers("ball", 4))
    region.rounds.push_back({{(*b)[0], (*b)[1], (*b)[2]}, (*b)[3], false});
  if (args.has("mask")) {
    if (kind_of(args.path("mask"), args) != InputKind::volume)
      throw InputError(fmt::format(
          "--mask: {} is no uniform volume (MHA, NRRD, FILE.h5:/dataset, TIFF slices)", args.text("mask")));
    region.mask = std::make_shared<const Volume>(load_volume(args.path("mask"), args));
  }
  return region;
}

std::pair<Vec3, Vec3> points_of(const Arguments& args, const char* option) {
  const auto p = args.numbers(option, 6).value();
  return {{p[0], p[1], p[2]}, {p[3], p[4], p[5]}};
}

class Report {
 public:
  Report(const Arguments& args, const Asked& asked, const VdvrFile& file, const Measurement& measurement,
         const Progress& progress)
      : args_(args), asked_(asked), file_(file), m_(measurement), progress_(progress) {}

  void run() {
    if (asked_.has_range() && !asked_.along && !asked_.components) volume();
    if (args_.has("mean") || args_.has("mass")) mean();
    if (args_.has("extremes")) extremes();
    if (asked_.histogram) histogram();
    if (asked_.along) along();
    if (asked_.components) components();
    if (args_.has("picture") && !asked_.histogram) slice();
  }
  std::optional<Image> picture;
  Json json = Json::object();
  std::vector<std::string> lines;
  std::string csv;

 private:
  [[nodiscard]] std::string cubed() const { return file_.volume.grid.unit + "^3"; }
  void line(const char* name, const std::string& text) {
    lines.push_back(fmt::format("{:<15}{}", name, text));
  }
  void set_region(const Interval& region) {
    json["region"] = interval_json(region);
    region_text_ = interval_text(region, cubed());
  }

  void volume() {
    const VolumeMeasure v = m_.volume(asked_.range, {}, progress_);
    set_region(v.region);
    json["volume"] = interval_json(v.volume);
    json["fraction"] = interval_json(v.fraction);
    json["undecided"] = v.undecided;
    line("volume", interval_text(v.volume, cubed()));
    line("fraction", interval_text({100 * v.fraction.lo, 100 * v.fraction.hi}, "%") + ", of " + region_text_);
  }
  void mean() {
    const MeanMeasure v = m_.mean(progress_);
    set_region(v.region);
    json["mean"] = interval_json(v.mean);
    json["mass"] = interval_json(v.integral);
    json["mean_bound"] = v.bound;
    json["field_mean"] = nullptr;
    json["sigma"] = nullptr;
    if (args_.has("mean")) line("mean", interval_text(v.mean, "") + ", over " + region_text_);
    if (args_.has("projections")) mean_of_scan(v);
    else if (args_.has("mean")) line("sigma", "not known: the sigma of a mean needs --projections");
    if (args_.has("mass")) line("mass", interval_text(v.integral, "density x " + cubed()));
  }
  void mean_of_scan(const MeanMeasure& v) {
    const ScanOfFile scan = scan_of_file(args_, file_.certificate, progress_);
    const MeanOfScan own = m_.mean_of_scan(scan.projections, {scan.noise, scan.flats},
                                           common_options(args_).max_memory, progress_);
    json["field_mean"] = own.mean;
    json["sigma"] = own.sigma ? Json(*own.sigma) : Json();
    json["sigma_of_flats"] = own.sigma ? Json(own.of_flats) : Json();
    json["sigma_source"] = scan.source;
    for (const std::string& text : mean_of_scan_lines(own, v, scan.source)) lines.push_back(text);
  }
  void extremes() {
    const ExtremesMeasure v = m_.extremes(progress_);
    const auto end = [](const Interval& i, const Vec3& at) {
      Json out = interval_json(i);
      out["at"] = at;
      return out;
    };
    json["least"] = end(v.least, v.least_at);
    json["largest"] = end(v.largest, v.largest_at);
    line("least", interval_text(v.least, "") + ", V at " + vec_text(v.least_at));
    line("largest", interval_text(v.largest, "") + ", V at " + vec_text(v.largest_at));
  }
  void histogram() {
    const std::int64_t bins = args_.integer_or("histogram", 64, 1, 1 << 20);
    Interval range;
    if (const auto given = args_.numbers("range", 2)) range = {(*given)[0], (*given)[1]};
    else {
      const ExtremesMeasure ends = m_.extremes(progress_);
      range = {ends.least.lo, ends.largest.hi};
    }
    if (!(range.lo < range.hi))
      throw InputError(fmt::format("--range: {} is not below {}", range.lo, range.hi));
    std::vector<double> edges;
    for (std::int64_t i = 0; i <= bins; ++i)
      edges.push_back(range.lo + static_cast<double>(i) / static_cast<double>(bins) * range.width());
    const Distribution d = m_.distribution(edges, progress_);
    set_region(d.region);
    json["histogram"] = distribution_json(d);
    csv = distribution_csv(d);
    if (args_.has("picture")) {
      const MeasurePictureOptions o = measure_picture_options(args_);
      picture = histogram_picture(d, o.width, o.height);
    }
    line("histogram",
         fmt::format("{} bins from {:.6g} to {:.6g}, of {}", bins, range.lo, range.hi, region_text_));
  }
  void slice() {
    const MeasurePictureOptions o = measure_picture_options(args_);
    ComponentsOptions of_components;
    of_components.max_memory_bytes = common_options(args_).max_memory / 2;
    picture = asked_.components ? component_slice(m_, asked_.range, o, of_components, progress_)
                                : class_slice(m_, asked_.range, o);
  }
  void along() {
    const auto [p, q] = points_of(args_, "along");
    LineOptions options;
    options.samples = args_.integer_or("samples", options.samples, 2, 1 << 24);
    options.value = asked_.value;
    const LineMeasure l = m_.along(p, q, options);
    json["along"] = line_json(l, options.value.has_value());
    csv = line_csv(l, p, q);
    for (const std::string& text : line_lines(l, options.value, file_.volume.grid.unit))
      lines.push_back(text);
  }
  void components() {
    ComponentsOptions options;
    // Samples and index have the other half.
    options.max_memory_bytes = common_options(args_).max_memory / 2;
    options.least_volume = args_.number_or("least-volume", 0);
    if (args_.has("connect")) {
      const auto [p, q] = points_of(args_, "connect");
      options.points = {p, q};
    }
    const ComponentTable t = m_.components(asked_.range, options, progress_);
    json["volume"] = interval_json(t.volume);
    json["components"] = components_json(t);
    csv = components_csv(t);
    for (const std::string& text : components_lines(t, cubed())) lines.push_back(text);
    if (options.points.empty()) return;
    const Answer answer = connected(t.points[0], t.points[1]);
    json["components"]["connected"] = text_of(answer);
    line("connected", text_of(answer));
  }

  const Arguments& args_;
  const Asked& asked_;
  const VdvrFile& file_;
  const Measurement& m_;
  const Progress& progress_;
  std::string region_text_;
};

}  // namespace

int measure_command(Arguments& args) {
  declare_measure(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  const fs::path path = args.path("FILE");
  const Asked asked = asked_of(args);
  if (!args.has("mask")) refuse(args, {"nan-as"}, "is for --mask");
  const fs::path output = args.text_or("output", "");
  if (!output.empty()) check_output(output, common.force, {path});
  const fs::path picture = args.text_or("picture", "");
  if (!picture.empty()) check_output(picture, common.force, {path, output});
  if (kind_of(path, args) != InputKind::certified)
    throw InputError(fmt::format("{}: is not a certified volume; build it first", path.string()));

  ProgressLine progress(args.who(), common.quiet);
  const Progress callback = progress.callback();
  const VdvrFile file = open_certified(path, args);
  const Measurement measurement(file.volume, file.certificate, region_of(args));
  Report report(args, asked, file, measurement, callback);
  report.run();
  throw_if_stopped();
  if (!output.empty()) io::write_file(output, report.csv);
  if (report.picture) write_png(picture, *report.picture);
  progress.clear();

  Json json = {{"file", path.string()},
               {"content_sha256", file.certificate.content_sha256},
               {"unit", file.volume.grid.unit},
               {"epsilon_abs", file.certificate.epsilon_abs}};
  if (asked.range.least) json["at_least"] = *asked.range.least;
  if (asked.range.largest) json["at_most"] = *asked.range.largest;
  json.update(report.json);
  if (!output.empty()) json["output"] = output.string();
  if (!picture.empty()) json["picture"] = picture.string();
  json["seconds"] = seconds_json(progress.seconds());
  print_result(common, json, [&] {
    for (const std::string& line : report.lines) fmt::print("{}\n", line);
    for (const fs::path& written : {output, picture})
      if (!written.empty()) fmt::print("written        {}\n", written.string());
  });
  return 0;
}

}  // namespace vdvr::cli
