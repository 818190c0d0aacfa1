// Fig. 5: what interpolation does to the frequencies of a scan, from the spectra of its strongest filtered
// view and of its 1x volume. Called by projections.cpp.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <nlohmann/json.hpp>

#include "apps/paper/report.hpp"
#include "apps/paper/upsample_volume.hpp"
#include "vdvr/expert/error_map.hpp"

namespace vdvr::paper {
namespace {

constexpr std::array kRates{1, 2, 4, 8};
constexpr std::int64_t kMapSide = 241;      // odd: frequency 0 has a pixel of its own
constexpr std::int64_t kCurvePoints = 400;  // of an error over frequency

/// A spectrum with everything that is said about it.
struct Spectrum {
  Index3 size{1, 1, 1};
  std::vector<float> coefficients;  ///< [z][y][x]
  double reference = 0;             ///< what sums are given as a part of
  std::vector<double> sums{};       ///< by kRates
};

Spectrum make_spectrum(Report& run, std::vector<float> samples, const Index3& size, double reference) {
  Spectrum s{size, cosine_spectrum(std::move(samples), size, run.progress), reference};
  for (const int rate : kRates) s.sums.push_back(amplitude_sum(run.device, s.coefficients, size, rate));
  return s;
}

std::string sums_text(const Spectrum& s, const std::string& of) {
  std::string text = "Sum of amplitude times error over all frequencies, % of " + of + ":";
  for (std::size_t r = 0; r < kRates.size(); ++r)
    text += fmt::format("{} {}x {:.3g}", r == 0 ? "" : ",", kRates[r],
                        s.reference > 0 ? 100 * s.sums[r] / s.reference : 0);
  return text + "; an upper bound, loose, which decides nothing.";
}

/// A plane of frequencies through the origin, by the axes that it shows.
struct Plane {
  std::size_t x, y;
  std::string name;
};

std::vector<float> magnitudes(const Spectrum& s, const Plane& p) {
  const std::array<std::int64_t, 3> stride{1, s.size[0], s.size[0] * s.size[1]};
  std::vector<float> out;
  for (std::int64_t j = 0; j < s.size[p.y]; ++j)
    for (std::int64_t i = 0; i < s.size[p.x]; ++i)
      out.push_back(std::abs(s.coefficients[static_cast<std::size_t>(i * stride[p.x] + j * stride[p.y])]));
  return out;
}

/// Magnitudes times the error at each rate, [y][x][rate].
FloatImage products(Report& run, const Spectrum& s, const Plane& p, const std::vector<int>& rates) {
  const std::vector<float> amplitude = magnitudes(s, p);
  FloatImage out{s.size[p.x], s.size[p.y], std::vector<float>(amplitude.size() * rates.size()),
                 static_cast<std::int64_t>(rates.size())};
  for (std::size_t r = 0; r < rates.size(); ++r) {
    const ErrorMap map =
        error_map(run.device, {cosine_axis(s.size[p.x]), cosine_axis(s.size[p.y]), {}}, rates[r]);
    for (std::size_t i = 0; i < amplitude.size(); ++i)
      out.values[i * rates.size() + r] = amplitude[i] * map.bound[i];
  }
  return out;
}

/// The largest error of a wave from -Nyquist to Nyquist in two axes, one channel per rate and frequency in
/// the third axis (cycles per sample).
FloatImage maps(Report& run, const std::vector<std::pair<int, double>>& channels) {
  const std::int64_t half = kMapSide / 2;
  const FrequencyAxis across{-half, kMapSide, std::numbers::pi / static_cast<double>(half)};
  FloatImage out{kMapSide, kMapSide,
                 std::vector<float>(static_cast<std::size_t>(kMapSide * kMapSide) * channels.size()),
                 static_cast<std::int64_t>(channels.size())};
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const auto& [rate, third] = channels[c];
    const ErrorMap map = error_map(run.device, {across, across, {1, 1, 2 * std::numbers::pi * third}}, rate);
    for (std::size_t i = 0; i < map.bound.size(); ++i) out.values[i * channels.size() + c] = map.bound[i];
  }
  return out;
}

/// Keeps a field and says where a panel finds it: channel c of the file.
std::string kept(Report& run, const std::string& name, FloatImage field) {
  run.fields.emplace_back(name, std::move(field));
  return name + ".npy";
}

Json panel(const std::string& title, const std::string& file, std::size_t channel, const std::string& x,
           const std::string& y) {
  return {{"title", title}, {"field", file}, {"channel", channel}, {"x", x}, {"y", y}};
}

/// `mirrored`: fields are coefficients from frequency 0 on, not maps from -Nyquist to Nyquist.
Json frequency_figure(const std::string& name, const std::string& caption, const std::string& title,
                      bool mirrored, const Json& rows) {
  return {{"kind", "frequencies"}, {"name", name},         {"caption", caption},
          {"title", title},        {"mirrored", mirrored}, {"logarithmic", mirrored},
          {"rows", rows}};
}

const std::string kExact = " Exact at 8x and where it is below 0.797, a proved bound beyond.";

Json row_figure(Report& run, const Spectrum& s, const std::string& what) {
  const auto n = static_cast<std::size_t>(s.size[0]);
  const std::vector<int> rates(kRates.begin(), kRates.end());
  FloatImage amplitude{s.size[0], 1, magnitudes(s, {0, 1, ""})},
      map{kCurvePoints, 1, std::vector<float>(kCurvePoints * rates.size()), 4};
  amplitude.values.resize(n);
  for (std::size_t r = 0; r < rates.size(); ++r) {
    const ErrorMap fine = error_map(run.device, {cosine_axis(kCurvePoints), {}, {}}, rates[r]);
    for (std::size_t i = 0; i < fine.bound.size(); ++i) map.values[i * rates.size() + r] = fine.bound[i];
  }
  FloatImage product = products(run, s, {0, 1, ""}, rates);
  const std::vector<std::string> labels{"1x", "2x", "4x", "8x"};
  Json panels = Json::array();
  panels.push_back({{"title", "amplitude"},
                    {"field", kept(run, "figure-5-row", std::move(amplitude))},
                    {"labels", {"row"}},
                    {"decades", 3}});
  panels.push_back({{"title", "largest error of a wave"},
                    {"field", kept(run, "figure-5-row-map", std::move(map))},
                    {"labels", labels},
                    {"decades", 4}});
  panels.push_back({{"title", "amplitude x error"},
                    {"field", kept(run, "figure-5-row-product", std::move(product))},
                    {"labels", labels},
                    {"decades", 6}});
  return {
      {"kind", "spectrum"},
      {"name", "figure-5-row"},
      {"caption", "Fig. 5. 1D: amplitudes of a filtered row, errors at 1x, 2x, 4x and 8x, their products. " +
                      sums_text(s, "the view's largest |q|")},
      {"title", "1D, linear: " + what},
      {"panels", panels}};
}

void projection_figures(Report& run, Section& section, const Spectrum& s, const std::string& what) {
  const Plane plane{0, 1, ""};
  const std::string said = " " + sums_text(s, "the view's largest |q|");
  const std::string spectrum =
      kept(run, "figure-5-projection-spectrum", {s.size[0], s.size[1], magnitudes(s, plane)});
  section.figures.push_back(frequency_figure(
      "figure-5-projection-spectrum",
      fmt::format("Fig. 5. 2D: amplitudes of a filtered projection, {} x {} coefficients, mirror extension.",
                  s.size[0], s.size[1]),
      "2D: amplitude, " + what, true,
      Json::array({Json::array({panel("amplitude", spectrum, 0, "u", "v")})})));
  const std::string map = kept(run, "figure-5-projection-map", maps(run, {{1, 0}, {8, 0}}));
  Json first = panel("1x", map, 0, "u", "v");
  first["box"] = 0.0625;  // up to this frequency: what 8x shows
  section.figures.push_back(frequency_figure(
      "figure-5-projection-map",
      "Fig. 5. 2D, bilinear: largest error of a wave of amplitude 1, all phases and positions, at 1x and 8x; "
      "the frame is the part that 8x shows." +
          kExact,
      "2D: largest error of a wave", false,
      Json::array({Json::array({first, panel("8x: the central eighth of 1x", map, 1, "u", "v")})})));
  const std::string product = kept(run, "figure-5-projection-product", products(run, s, plane, {1, 8}));
  section.figures.push_back(frequency_figure(
      "figure-5-projection-product", "Fig. 5. 2D: amplitude times error at 1x and 8x." + said,
      "2D: amplitude x error, " + what, true,
      Json::array({Json::array({panel("1x", product, 0, "u", "v"), panel("8x", product, 1, "u", "v")})})));
}

void volume_figures(Report& run, Section& section, const Spectrum& s) {
  const std::array<Plane, 3> planes{{{0, 1, "xy"}, {0, 2, "xz"}, {1, 2, "yz"}}};
  const std::string cut = "the 1x volume, cut out and mirrored, not of F";
  Json spectra = Json::array(), at1 = Json::array(), at8 = Json::array();
  for (const Plane& p : planes) {
    const std::string x(1, p.name[0]), y(1, p.name[1]), third(1, "xyz"[3 - p.x - p.y]),
        title = "frequency 0 in " + third;
    spectra.push_back(panel(
        title, kept(run, "figure-5-volume-spectrum-" + p.name, {s.size[p.x], s.size[p.y], magnitudes(s, p)}),
        0, x, y));
    const std::string product = kept(run, "figure-5-volume-product-" + p.name, products(run, s, p, {1, 8}));
    at1.push_back(panel("1x, " + title, product, 0, x, y));
    at8.push_back(panel("8x, " + title, product, 1, x, y));
  }
  section.figures.push_back(frequency_figure(
      "figure-5-volume-spectrum",
      fmt::format("Fig. 5. 3D: amplitudes of the 1x base volume, {} x {} x {} coefficients, central slices.",
                  s.size[0], s.size[1], s.size[2]),
      "3D: amplitude of " + cut, true, Json::array({spectra})));
  const std::string map = kept(run, "figure-5-volume-map", maps(run, {{1, 0}, {1, 0.25}, {8, 0}, {8, 0.25}}));
  Json rows = Json::array();
  for (std::size_t r = 0; r < 2; ++r) {
    rows.push_back(Json::array());
    for (std::size_t t = 0; t < 2; ++t)
      rows.back().push_back(
          panel(fmt::format("{}x, frequency {} in z", r == 0 ? 1 : 8, t == 0 ? "0" : "0.25"), map, 2 * r + t,
                "x", "y"));
  }
  rows[0][0]["box"] = 0.0625;
  section.figures.push_back(frequency_figure("figure-5-volume-map",
                                             "Fig. 5. 3D, trilinear: largest error of a wave of amplitude 1 "
                                             "at 1x and 8x, slices at frequencies 0 and "
                                             "0.25 in z; alike for slices across x and y." +
                                                 kExact,
                                             "3D: largest error of a wave", false, rows));
  section.figures.push_back(frequency_figure(
      "figure-5-volume-product",
      "Fig. 5. 3D: amplitude times error at 1x and 8x, central slices. " + sums_text(s, "the range"),
      "3D: amplitude x error of " + cut, true, Json::array({at1, at8})));
}

}  // namespace

void add_spectrum_figures(Report& run, Section& section, const FilteredView& view, const Volume& base,
                          double range) {
  const std::int64_t middle = view.rows / 2;
  const auto begin = view.samples.begin() + middle * view.columns;
  const Spectrum row = make_spectrum(run, {begin, begin + view.columns}, {view.columns, 1, 1}, view.largest),
                 projection = make_spectrum(run, view.samples, {view.columns, view.rows, 1}, view.largest),
                 volume = make_spectrum(run, base.samples, base.grid.samples(), range);
  section.figures.push_back(
      row_figure(run, row, fmt::format("row {} of filtered view {}", middle, view.view)));
  projection_figures(run, section, projection, fmt::format("filtered view {}", view.view));
  volume_figures(run, section, volume);
}

}  // namespace vdvr::paper
