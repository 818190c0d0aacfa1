#include "apps/vdvr/options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>

#include "vdvr/error.hpp"
#include "vdvr/expert/preparation.hpp"

namespace vdvr::cli {
namespace {

std::vector<std::string> filter_names() {
  std::vector<std::string> names;
  names.reserve(ramp_windows.size());
  for (const auto& [window, name] : ramp_windows) names.emplace_back(name);
  return names;
}

const std::map<std::string, StorageChoice> kStorage{{"auto", StorageChoice::automatic},
                                                    {"f32", StorageChoice::f32},
                                                    {"u16", StorageChoice::u16},
                                                    {"u8", StorageChoice::u8}};

bool is_power_of_two(std::int64_t n) { return n > 0 && (n & (n - 1)) == 0; }

/// "auto" gives none; else a power of two up to `highest`.
std::optional<int> rate(const Arguments& args, const std::string& name, std::int64_t highest) {
  if (args.text_or(name, "auto") == "auto") return std::nullopt;
  const std::int64_t n = args.integer_or(name, 1, 1, highest);
  if (!is_power_of_two(n)) throw InputError(fmt::format("--{}: {} is not a power of two", name, n));
  return static_cast<int>(n);
}

}  // namespace

void add_field(Arguments& args) {
  args.group("Field (what is certified)")
      .value("center", "C", "column onto which the rotation axis projects")
      .value("filter", fmt::format("{}", fmt::join(filter_names(), "|")), "default ram-lak")
      .value("filter-cutoff", "F", "fraction of the detector's Nyquist frequency, in (0, 1] (default 1)");
  args.group("Preparation (F is that of the prepared projections)")
      .value(
          "flats-in-time", "auto|on|off",
          "projections are divided by what lies between the flats before and after them; off: by the mean of "
          "all flats (default auto: on where the order of frames is known)")
      .value("outliers", "T[,N]",
             "pixels brighter than the median of N x N by T of the open beam become it (N: 3)")
      .value("phase", "MM,KEV,RATIO",
             "Paganin's phase retrieval: object to detector, energy, delta / beta; parallel beam")
      .value("stripes", "RATIO[,LARGE,SMALL]|on",
             "take stripes off sinograms, rings off slices; on: 3, and windows by the detector")
      .value("median", "N", "side of a square median window in pixels, odd")
      .value("gaussian", "SU,SV", "standard deviations of a blur in columns and rows")
      .value("binning", "N", "columns and rows that become one pixel")
      .value("half-acquisition", "auto|on|off",
             "a full turn about an axis off the middle: opposite views are rows of a wider detector (default "
             "auto: as axis and arc say)")
      .value("heights", "auto|common|all",
             "of views that saw the sample at other heights: those that all see, or all that are seen "
             "from every direction (default auto: all where views share fewer than half of their rows)")
      .value("pad", "none|edge|mirror",
             "of objects wider than the detector: how rows go on beyond it, tapering to zero (default none)");
}

namespace {

const std::vector<std::string> preparation_names{"outliers",      "phase",   "stripes",          "median",
                                                 "gaussian",      "binning", "half-acquisition", "pad",
                                                 "flats-in-time", "heights"};

// `count` numbers, or the first alone where `fewest` is 1.
std::vector<double> list_of(const Arguments& args, const std::string& name, std::size_t fewest,
                            std::size_t most) {
  std::vector<double> values = args.numbers(name, 0).value();
  if (values.size() != fewest && values.size() != most)
    throw InputError(fmt::format("--{}: {} numbers, expected {}{}", name, values.size(),
                                 fewest == most ? "" : fmt::format("{} or ", fewest), most));
  return values;
}

int whole(const std::string& name, double value) {
  if (!(value >= 0 && value <= 1e6) || value != std::floor(value))
    throw InputError(fmt::format("--{}: {} is not a whole number of pixels", name, value));
  return static_cast<int>(value);
}

Preparation preparation_options(const Arguments& args) {
  Preparation p;
  if (args.has("outliers")) {
    const auto values = list_of(args, "outliers", 1, 2);
    p.outliers.emplace().threshold = values[0];
    if (values.size() > 1) p.outliers->window = whole("outliers", values[1]);
  }
  if (args.has("phase")) {
    const auto values = list_of(args, "phase", 3, 3);
    p.phase = PhaseRetrieval{values[0], values[1], values[2]};
  }
  if (args.has("stripes")) {
    p.stripes.emplace();
    if (args.text("stripes") != "on") {
      const auto values = list_of(args, "stripes", 1, 3);
      p.stripes->ratio = values[0];
      if (values.size() > 1) {
        p.stripes->large = whole("stripes", values[1]);
        p.stripes->small = whole("stripes", values[2]);
      }
    }
  }
  p.median = static_cast<int>(args.integer_or("median", 1, 1, 1000));
  if (args.has("gaussian")) {
    const auto values = list_of(args, "gaussian", 2, 2);
    p.gaussian = {values[0], values[1]};
  }
  p.binning = static_cast<int>(args.integer_or("binning", 1, 1, 1000));
  const std::string half = args.choice("half-acquisition", "auto");
  if (half != "auto") p.half_acquisition = half == "on";
  p.padding = padding_of(args.choice("pad", "none")).value();
  if (const std::string heights = args.choice("heights", "auto"); heights != "auto")
    p.heights = heights_of(heights).value();
  const std::string flats = args.choice("flats-in-time", "auto");
  if (flats != "auto") p.flats_in_time = flats == "on";
  check_preparation(p);
  return p;
}

}  // namespace

FieldOptions field_options(const Arguments& args) {
  FieldOptions field;
  field.filter = ramp_window_of(args.choice("filter", text_of(field.filter))).value();
  field.cutoff = args.positive_or("filter-cutoff", field.cutoff);
  if (field.cutoff > 1) throw InputError(fmt::format("--filter-cutoff: {} is above 1", field.cutoff));
  field.preparation = preparation_options(args);
  if (const auto center = args.number("center"))
    field.center = binned_center(*center, field.preparation.binning);
  return field;
}

bool has_preparation_options(const Arguments& args) {
  return std::any_of(preparation_names.begin(), preparation_names.end(),
                     [&](const std::string& name) { return args.has(name); });
}

bool has_field_options(const Arguments& args) {
  return args.has("center") || args.has("filter") || args.has("filter-cutoff") ||
         has_preparation_options(args);
}

void add_grid(Arguments& args) {
  args.group("Grid")
      .value("size", "NxNxN", "cells in x, y, z (default: the covered region)")
      .value("spacing", "S[,SZ]", "cell width, and height where it differs (default: the detector pitch)")
      .value("origin", "X,Y,Z", "first sample (default: centred)")
      .value(
          "roi", "X0,Y0,Z0,X1,Y1,Z1",
          "certify the points of this box only; without --size the grid is the box's bricks, and so is the "
          "range that --epsilon is a fraction of");
}

GridOptions grid_options(const Arguments& args, const std::string& size_option) {
  GridOptions grid;
  if (const auto size = args.sizes(size_option, 3)) grid.size = Index3{(*size)[0], (*size)[1], (*size)[2]};
  if (const auto spacing = args.one_or_two("spacing")) {
    grid.spacing = (*spacing)[0];
    grid.spacing_z = (*spacing)[1];
  }
  grid.origin = args.vec3("origin");
  return grid;
}

void add_rates(Arguments& args) {
  args.group("Rates")
      .value("upsampling", "auto|N", "of the filtered projections in u, a power of two")
      .value("u-filter", "auto|linear|cubic|six-taps", "interpolation of the upsampled projections")
      .value("gold", "auto|N", "oversampling of the gold standard, a power of two");
}

int upsampling_option(const Arguments& args) {
  const std::int64_t n = args.integer_or("upsampling", 1, 1, 64);
  if (!is_power_of_two(n)) throw InputError(fmt::format("--upsampling: {} is not a power of two", n));
  return static_cast<int>(n);
}

RateOptions rate_options(const Arguments& args) {
  RateOptions rates;
  rates.upsampling = rate(args, "upsampling", 64);
  rates.interpolation = interpolation_of(args.choice("u-filter", "auto"));
  rates.gold = rate(args, "gold", 64);
  if (args.has("paper")) {
    if (!args.has("upsampling")) rates.upsampling = 8;
    if (!args.has("u-filter")) rates.interpolation = Interpolation::linear;
    if (!args.has("gold")) rates.gold = 8;
  }
  return rates;
}

void add_compression(Arguments& args) {
  args.value("compression", "deflate|none",
             "of the .vdvr file; on the device samples lie as they are (default deflate)");
}

Compression compression(const Arguments& args) {
  return args.choice("compression", "deflate") == "none" ? Compression::none : Compression::deflate;
}

void add_tolerance(Arguments& args) {
  args.group("Tolerance")
      .value("epsilon", "3%|0.03|1sigma",
             "fraction of the reference range; or of the scan's own noise there, brick by brick")
      .value("epsilon-abs", "E", "in density units");
}

double fraction_option(const Arguments& args, const std::string& name) {
  std::string text = args.text(name);
  const bool percent = text.back() == '%';
  if (percent) text.pop_back();
  const double fraction = parse_number("--" + name, text) / (percent ? 100 : 1);
  if (!(fraction > 0)) throw InputError(fmt::format("--{}: {} is not above 0", name, args.text(name)));
  if (fraction > 1)
    throw InputError(
        fmt::format("--{}: {} is more than the whole range; write 3% or 0.03", name, args.text(name)));
  return fraction;
}

std::optional<double> sigmas_option(const Arguments& args) {
  constexpr std::string_view unit = "sigma";
  if (!args.has("epsilon")) return {};
  std::string text = args.text("epsilon");
  if (!text.ends_with(unit)) return {};
  text.resize(text.size() - unit.size());
  const double sigmas = parse_number("--epsilon", text);
  if (!(sigmas > 0)) throw InputError(fmt::format("--epsilon: {} is not above 0", args.text("epsilon")));
  return sigmas;
}

Tolerance tolerance(const Arguments& args) {
  if (args.has("epsilon") == args.has("epsilon-abs"))
    throw InputError("give a tolerance: --epsilon 3%, --epsilon 1sigma, or --epsilon-abs in density units");
  Tolerance result;
  if (args.has("epsilon-abs")) {
    result.absolute = args.positive_or("epsilon-abs", 0);
    return result;
  }
  result.relative = fraction_option(args, "epsilon");
  return result;
}

void refuse(const Arguments& args, const std::vector<std::string>& names, const std::string& reason) {
  for (const auto& name : names)
    if (args.has(name)) throw InputError(fmt::format("--{}: {}", name, reason));
}

void add_build(Arguments& args) {
  args.group("Build")
      .value("granularity", "1|2|4|8", "cells per brick and axis (default 4)")
      .value(
          "base", "auto|NxNxN",
          "cells of the grid per base sample in x, y, z: 1, 2, 4 or 8 each (default auto: what stores least)")
      .value("window", "LO,HI", "test only where the field meets these values")
      .value("storage", "auto|f32|u16|u8", "sample type of base and tiles (default auto)")
      .flag("paper", "the paper's settings, for comparison (docs/paper.md)")
      .flag("resume", "continue what an interrupted build or run left in its journal")
      // Of what `paper` stands for, one by one (docs/paper.md).
      .hidden("closing", "coarse|paper|none")
      .hidden("coefficients", "midrange|sampled")
      .hidden("levels", "isotropic|anisotropic")
      .hidden("terms", "all|grid")
      .hidden("epsilon-of", "range|max");
}

BuildOptions build_options(const Arguments& args) {
  const bool paper = args.has("paper");
  BuildOptions build;
  build.scratch = common_options(args).scratch;
  build.storage = kStorage.at(args.choice("storage", paper ? "f32" : "auto"));
  if (const auto w = args.numbers("window", 2)) {
    if (!((*w)[0] <= (*w)[1])) throw InputError(fmt::format("--window: {} lies above {}", (*w)[0], (*w)[1]));
    build.window = std::pair{(*w)[0], (*w)[1]};
  }
  if (const auto r = args.numbers("roi", 6)) {
    for (std::size_t a = 0; a < 3; ++a)
      if (!((*r)[a] < (*r)[a + 3]))
        throw InputError(fmt::format("--roi: {} is not below {} along {}: the lower corner comes first",
                                     (*r)[a], (*r)[a + 3], "xyz"[a]));
    build.roi.emplace();
    std::copy(r->begin(), r->end(), build.roi->begin());
  }
  return build;
}

namespace {

// Of --base, as log2, z, y, x; none: to be chosen.
std::optional<LevelTriple> coarsening(const Arguments& args) {
  if (!args.has("base") || args.text("base") == "auto") return std::nullopt;
  const auto cells = *args.sizes("base", 3);
  LevelTriple c{};
  for (std::size_t a = 0; a < 3; ++a) {
    if (cells[a] > 8 || !is_power_of_two(cells[a]))
      throw InputError(fmt::format("--base: {} is not one of 1, 2, 4, 8", cells[a]));
    c[2 - a] = static_cast<std::uint8_t>(std::countr_zero(static_cast<std::uint64_t>(cells[a])));
  }
  return c;
}

/// One of `values` by its name; `fallback` where the option is not given.
template <class T>
T choice_of(const Arguments& args, const std::string& name, std::initializer_list<T> values, T fallback) {
  const std::string given = args.choice(name, text_of(fallback));
  return *std::find_if(values.begin(), values.end(), [&](T value) { return given == text_of(value); });
}

Comparison comparison(const Arguments& args) {
  const bool paper = args.has("paper");
  Comparison c;
  c.coefficients = choice_of(args, "coefficients", {Coefficients::midrange, Coefficients::sampled},
                             paper ? Coefficients::sampled : Coefficients::midrange);
  c.terms = choice_of(args, "terms", {Terms::all, Terms::grid}, paper ? Terms::grid : Terms::all);
  c.closing = choice_of(args, "closing", {Closing::coarse, Closing::paper, Closing::none},
                        paper ? Closing::paper : Closing::coarse);
  c.epsilon_of_max = args.choice("epsilon-of", paper ? "max" : "range") == "max";
  return c;
}

}  // namespace

PlanSettings plan_settings(const Arguments& args) {
  PlanSettings settings;
  settings.comparison = comparison(args);
  const bool paper = args.has("paper"), paper_closing = settings.comparison.closing == Closing::paper;
  settings.levels = choice_of(args, "levels", {Levels::isotropic, Levels::anisotropic},
                              paper || paper_closing ? Levels::isotropic : Levels::anisotropic);
  settings.granularity = static_cast<int>(args.integer_or("granularity", settings.granularity, 1, 8));
  if (!is_power_of_two(settings.granularity))
    throw InputError(fmt::format("--granularity: {} is not one of 1, 2, 4, 8", settings.granularity));
  settings.coarsening = coarsening(args);
  if (settings.coarsening.value_or(LevelTriple{}) != LevelTriple{} && settings.levels == Levels::isotropic)
    throw InputError(
        "--base: isotropic levels have the grid itself as their base; take --levels anisotropic");
  if (settings.comparison.coefficients == Coefficients::midrange && paper_closing)
    throw InputError(
        "--closing paper feeds bricks with samples of F: take --coefficients sampled with it, or --closing "
        "coarse");
  if (settings.levels == Levels::anisotropic && paper_closing)
    throw InputError("--closing paper is defined for --levels isotropic only; or take --closing coarse");
  return settings;
}

}  // namespace vdvr::cli
