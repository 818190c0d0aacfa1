// The pictures of `vdvr plan --pictures`.
#include "vdvr/expert/plan_pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "host/picture/figure.hpp"
#include "vdvr/expert/cosine_spectrum.hpp"
#include "vdvr/expert/error_map.hpp"
#include "vdvr/expert/spectral_error.hpp"

namespace vdvr {
namespace {

using Json = nlohmann::ordered_json;

using figure::Raster;
using figure::Scale;

const std::vector<int> kRates{1, 2, 4, 8};
constexpr std::int64_t kSide = 481, kSmallSide = 401;  // odd: frequency 0 has a pixel of its own
constexpr double kDecades = 1e-6;                      // shown below the largest; fp32 leaves noise there
constexpr double kFewDecades = 1e-3;                   // enough for the amplitudes of one row
const std::string kUnit = "cycles per sample";

/// A spectrum with everything that is said about it.
struct Spectrum {
  Index3 size{1, 1, 1};
  std::vector<float> coefficients;  ///< [z][y][x]
  double reference = 0;             ///< what sums are given as a part of
  std::vector<AmplitudeSum> sums;   ///< by kRates
};

Spectrum make_spectrum(Device& device, std::vector<float> samples, const Index3& size, double reference,
                       const Progress& progress) {
  Spectrum s{size, std::move(samples), reference, {}};
  cosine_spectrum(device, s.coefficients, size, progress);
  for (const int rate : kRates) s.sums.push_back(amplitude_sum(device, s.coefficients, size, rate));
  return s;
}

/// A plane of frequencies through the origin: coefficient magnitudes, and those times the error at a rate.
struct Plane {
  std::size_t x, y;  ///< the axes that it shows
};
std::vector<double> plane_magnitudes(const Spectrum& s, const Plane& p) {
  const std::array<std::int64_t, 3> stride{1, s.size[0], s.size[0] * s.size[1]};
  std::vector<double> out;
  for (std::int64_t j = 0; j < s.size[p.y]; ++j)
    for (std::int64_t i = 0; i < s.size[p.x]; ++i)
      out.push_back(static_cast<double>(
          std::abs(s.coefficients[static_cast<std::size_t>(i * stride[p.x] + j * stride[p.y])])));
  return out;
}
std::vector<double> plane_products(Device& device, const Spectrum& s, const Plane& p, int rate) {
  const ErrorMap map = error_map(device, {cosine_axis(s.size[p.x]), cosine_axis(s.size[p.y]), {}}, rate);
  std::vector<double> out = plane_magnitudes(s, p);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] *= static_cast<double>(map.bound[i]);
  return out;
}

double largest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }
/// From the largest down to a power of ten; a scan of zeros gets a scale all the same.
Scale decades_below(double high, double decades = kDecades) {
  if (!(high > 0)) return {decades, 1, true};
  return {std::pow(10, std::floor(std::log10(high * decades))), high, true};
}

Raster raster_of(const Spectrum& s, const Plane& p, const std::vector<double>& values,
                 const std::string& title, const std::array<std::string, 3>& axes, const Scale& scale,
                 std::int64_t side) {
  return {title,
          axes[p.x] + ", " + kUnit,
          axes[p.y],
          side,
          figure::mirrored(values, s.size[p.x], s.size[p.y], side),
          scale};
}

/// The map of worst errors itself, from -Nyquist to Nyquist, at a fixed third frequency (cycles per sample).
Raster map_raster(Device& device, int rate, double third, const std::string& title,
                  const std::array<std::string, 2>& axes, std::int64_t side) {
  const std::int64_t half = side / 2;
  const FrequencyAxis across{-half, side, std::numbers::pi / static_cast<double>(half)};
  const ErrorMap map = error_map(device, {across, across, {1, 1, 2 * std::numbers::pi * third}}, rate);
  const std::vector<double> values(map.bound.begin(), map.bound.end());
  return {title,
          axes[0] + ", " + kUnit,
          axes[1],
          side,
          values,
          {0, largest(values), false},
          rate == 1 && third == 0 ? 0.125 : 0};
}

/// Of all waves up to Nyquist.
double worst_corner(int axes, int rate) {
  return wave_error_bound(std::vector<double>(static_cast<std::size_t>(axes), std::numbers::pi / rate));
}

std::string part(double value, double reference) {
  return reference > 0 ? fmt::format("{:.3g} ({:.3g} %)", value, 100 * value / reference)
                       : fmt::format("{:.3g}", value);
}
/// The amplitude bounds: under every picture, after what else it says.
std::vector<std::string> caption(const Spectrum& s, const std::string& of,
                                 std::vector<std::string> lines = {}) {
  std::string sums = "sum of amplitude x error over all frequencies:";
  for (const auto& a : s.sums)
    sums += fmt::format("{} {}x {}", a.rate == 1 ? "" : ",", a.rate, part(a.bound, s.reference));
  lines.push_back(sums);
  lines.push_back(
      fmt::format("(% of {} {:.4g}); an upper bound, loose; it decides nothing", of, s.reference));
  return lines;
}
const std::string kOfView = "the view's largest |q|,", kOfRange = "the range";
const std::string kExact = "exact at 8x and where it is below 0.797, a proved bound beyond";

Json spectrum_json(const Spectrum& s) {
  Json sums = Json::array();
  for (const auto& a : s.sums) {
    const auto relative = [&](double v) { return s.reference > 0 ? Json(v / s.reference) : Json(); };
    sums.push_back({{"rate", a.rate},
                    {"amplitude_bound", a.bound},
                    {"amplitude_bound_relative", relative(a.bound)},
                    {"with_closed_form", a.centre},
                    {"with_sum_over_axes", a.sum_over_axes},
                    {"largest_term", a.largest_term}});
  }
  float most = 0;
  for (const float c : s.coefficients) most = std::max(most, std::abs(c));
  return {{"coefficients", s.size}, {"largest_amplitude", most}, {"reference", s.reference}, {"sums", sums}};
}

/// Collects pictures as they come.
class Album {
 public:
  explicit Album(const Progress& progress) : progress_(progress) {}
  void add(const std::string& name, const std::string& shows, Image image) {
    report(progress_, "pictures", static_cast<double>(pictures.size()) / 8);
    pictures.push_back({name, shows, std::move(image)});
  }
  std::vector<PlanPicture> pictures;

 private:
  const Progress& progress_;
};

void draw_row(Device& device, Album& album, const Spectrum& s, const std::string& what) {
  const auto n = static_cast<std::size_t>(s.size[0]);
  std::vector<double> magnitude(n);
  for (std::size_t m = 0; m < n; ++m) magnitude[m] = static_cast<double>(std::abs(s.coefficients[m]));
  figure::Chart spectrum{"amplitude",
                         kUnit,
                         {{"row", figure::paired(magnitude)}},
                         decades_below(largest(magnitude), kFewDecades)},
      map{"largest error of a wave", kUnit, {}, {1e-4, 1, true}}, product{"amplitude x error", kUnit, {}, {}};
  double most = 0;
  for (const int rate : kRates) {
    const std::string label = fmt::format("{}x", rate);
    const ErrorMap fine = error_map(device, {cosine_axis(400), {}, {}}, rate);
    map.curves.push_back({label, {fine.bound.begin(), fine.bound.end()}});
    const ErrorMap own = error_map(device, {cosine_axis(s.size[0]), {}, {}}, rate);
    std::vector<double> p(magnitude);
    for (std::size_t m = 0; m < n; ++m) p[m] *= static_cast<double>(own.bound[m]);
    most = std::max(most, largest(p));
    product.curves.push_back({label, figure::paired(p)});
  }
  product.scale = decades_below(most);
  album.add("row.png", "1D: amplitudes of a filtered row, errors at 1x, 2x, 4x and 8x, their products",
            figure::draw("1D, linear: " + what, {spectrum, map, product}, caption(s, kOfView)));
}

void draw_projection(Device& device, Album& album, const Spectrum& s, const std::string& what) {
  const std::array<std::string, 3> axes{"u", "v", ""};
  const Plane plane{0, 1};
  const auto magnitude = plane_magnitudes(s, plane);
  album.add(
      "projection-spectrum.png", "2D: amplitudes of a filtered projection",
      figure::draw(
          "2D: " + what,
          {{raster_of(s, plane, magnitude, "amplitude", axes, decades_below(largest(magnitude)), kSide)}},
          caption(s, kOfView,
                  {fmt::format("{} x {} coefficients, mirror extension; a pixel shows the largest of its own",
                               s.size[0], s.size[1])})));
  const auto at1 = map_raster(device, 1, 0, "1x", {"u", "v"}, kSide),
             at8 = map_raster(device, 8, 0, "8x: the central eighth of 1x", {"u", "v"}, kSide);
  album.add(
      "projection-map.png", "2D: largest error of a wave at 1x and 8x",
      figure::draw(
          "2D, bilinear: largest error of a wave of amplitude 1, all phases and positions", {{at1, at8}},
          caption(s, kOfView,
                  {fmt::format("1x: up to {:.4g}; 8x: up to {:.4g}; the frame is the part that 8x shows",
                               at1.scale.high, at8.scale.high),
                   kExact})));
  const auto p1 = plane_products(device, s, plane, 1), p8 = plane_products(device, s, plane, 8);
  const Scale scale = decades_below(std::max(largest(p1), largest(p8)));
  album.add("projection-product.png", "2D: amplitude times error at 1x and 8x",
            figure::draw("2D: amplitude x error, " + what,
                         {{raster_of(s, plane, p1, "1x", axes, scale, kSide),
                           raster_of(s, plane, p8, "8x", axes, scale, kSide)}},
                         caption(s, kOfView)));
}

const std::array<std::string, 3> kAxes{"x", "y", "z"};
const std::array<Plane, 3> kPlanes{{{0, 1}, {0, 2}, {1, 2}}};
const std::string kCutOut = "spectrum of the cut-out 1x volume, mirrored, not of F";

std::string plane_title(std::size_t i, const std::string& before) {
  return fmt::format("{}frequency 0 in {}", before, kAxes[2 - i]);
}

void draw_volume(Device& device, Album& album, const Spectrum& s) {
  std::vector<std::vector<double>> magnitudes;
  double most = 0;
  for (const Plane& p : kPlanes) {
    magnitudes.push_back(plane_magnitudes(s, p));
    most = std::max(most, largest(magnitudes.back()));
  }
  std::vector<Raster> spectra;
  for (std::size_t i = 0; i < 3; ++i)
    spectra.push_back(
        raster_of(s, kPlanes[i], magnitudes[i], plane_title(i, ""), kAxes, decades_below(most), kSmallSide));
  album.add(
      "volume-spectrum.png", "3D: amplitudes of the 1x base volume, central slices",
      figure::draw("3D: amplitude, central slices: " + kCutOut, {spectra},
                   caption(s, kOfRange,
                           {fmt::format("{} x {} x {} coefficients; a pixel shows the largest of its own",
                                        s.size[0], s.size[1], s.size[2])})));

  std::vector<std::vector<Raster>> maps;
  for (const int rate : {1, 8}) {
    maps.push_back({});
    for (const double third : {0.0, 0.25})
      maps.back().push_back(map_raster(
          device, rate, third, fmt::format("{}x, frequency {} in z", rate, third), {"x", "y"}, kSmallSide));
  }
  album.add(
      "volume-map.png", "3D: largest error of a wave at 1x and 8x, slices at frequencies 0 and 0.25",
      figure::draw(
          "3D, trilinear: largest error of a wave of amplitude 1", maps,
          caption(s, kOfRange,
                  {fmt::format("largest in 3D: {:.4g} at 1x, {:.4g} at 8x; alike for slices across x and y",
                               worst_corner(3, 1), worst_corner(3, 8)),
                   kExact})));

  std::vector<std::vector<Raster>> products;
  std::vector<std::vector<double>> values;
  for (const int rate : {1, 8})
    for (const Plane& p : kPlanes) values.push_back(plane_products(device, s, p, rate));
  most = 0;
  for (const auto& v : values) most = std::max(most, largest(v));
  for (std::size_t r = 0; r < 2; ++r) {
    products.push_back({});
    for (std::size_t i = 0; i < 3; ++i)
      products.back().push_back(raster_of(s, kPlanes[i], values[3 * r + i],
                                          plane_title(i, r == 0 ? "1x, " : "8x, "), kAxes,
                                          decades_below(most), kSmallSide));
  }
  album.add(
      "volume-product.png", "3D: amplitude times error at 1x and 8x, central slices",
      figure::draw("3D: amplitude x error, central slices: " + kCutOut, products, caption(s, kOfRange)));
}

}  // namespace

PlanPictures plan_pictures(Device& device, const ProjectionSet& scan, const Plan& plan,
                           const Progress& progress) {
  const FilteredView view = strongest_view(device, scan, plan.field, progress);
  const std::int64_t middle = view.rows / 2;
  const auto row_begin = view.samples.begin() + middle * view.columns;
  const Spectrum row = make_spectrum(device, {row_begin, row_begin + view.columns}, {view.columns, 1, 1},
                                     view.largest, progress);
  const Spectrum projection =
      make_spectrum(device, view.samples, {view.columns, view.rows, 1}, view.largest, progress);
  const Spectrum volume =
      make_spectrum(device, plan.base.samples, plan.base.grid.samples(), plan.reference_range, progress);

  Album album(progress);
  draw_row(device, album, row, fmt::format("row {} of filtered view {}", middle, view.view));
  draw_projection(device, album, projection, fmt::format("filtered view {}", view.view));
  draw_volume(device, album, volume);
  const auto maxima = [](int axes) {
    Json list = Json::array();
    for (const int rate : kRates) list.push_back({{"rate", rate}, {"value", worst_corner(axes, rate)}});
    return list;
  };
  Json files = Json::object();
  for (const auto& p : album.pictures) files[p.file] = p.shows;
  Json json = {
      {"files", files},
      {"view",
       {{"index", view.view}, {"row", middle}, {"chosen", "the view with the most energy after filtering"}}},
      {"error_map",
       {{"maxima", {{"1d", maxima(1)}, {"2d", maxima(2)}, {"3d", maxima(3)}}},
        {"exact_where_product_of_cosines_is_at_least", kExactProduct},
        {"beyond", "proved upper bound"}}},
      {"row", spectrum_json(row)},
      {"projection", spectrum_json(projection)},
      {"volume", spectrum_json(volume)},
      {"volume_note",
       "the spectrum of the cut-out 1x volume under mirror extension, not of F: it decides nothing"}};
  return {std::move(album.pictures), json.dump()};
}

}  // namespace vdvr
