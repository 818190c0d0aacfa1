// What F is, of all the fields that a scan could stand for (docs/geometry.md).
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <utility>

#include "vdvr/error.hpp"
#include "vdvr/expert/preparation_steps.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// What the ramp is multiplied by towards high frequencies.
enum class RampWindow { ram_lak, shepp_logan, cosine, hamming, hann };
inline constexpr std::array<std::pair<RampWindow, const char*>, 5> ramp_windows{
    {{RampWindow::ram_lak, "ram-lak"},
     {RampWindow::shepp_logan, "shepp-logan"},
     {RampWindow::cosine, "cosine"},
     {RampWindow::hamming, "hamming"},
     {RampWindow::hann, "hann"}}};
/// As files and options write them.
constexpr const char* text_of(RampWindow window) {
  for (const auto& [one, text] : ramp_windows)
    if (one == window) return text;
  return "";
}
constexpr std::optional<RampWindow> ramp_window_of(std::string_view text) {
  for (const auto& [window, name] : ramp_windows)
    if (text == name) return window;
  return {};
}

/// The field options that define F (docs/geometry.md); stored in the certificate, taken from it by `verify`.
struct FieldOptions {
  RampWindow filter = RampWindow::ram_lak;
  double cutoff = 1.0;           ///< fraction of the detector's Nyquist frequency
  std::optional<double> center;  ///< overrides the scan's; in columns of the prepared projections,
                                 ///< without those that rows were given beyond the detector
  /// What was done to the projections. It is done where they are read (ScanOptions), and recorded here.
  Preparation preparation{};
  bool operator==(const FieldOptions&) const = default;
};

/// The centre that defines F, the field's, else the scan's: a column of the detector's own.
inline double stated_center(const FieldOptions& field, const ParallelGeometry& g) {
  const bool longer = g.extension.before > 0 || g.extension.after > 0;
  return field.center.value_or((longer ? g.extension.center : g.center) +
                               static_cast<double>(g.extension.cut));
}

/// The same as a column of the scan's rows, which may have been made longer, or cut where they were brought
/// upright. Throws InputError where rows of
/// half acquisition were weighted about another centre.
inline double center_of(const FieldOptions& field, const ParallelGeometry& g) {
  if (!field.center) return g.center;
  const double center = *field.center + static_cast<double>(g.extension.before - g.extension.cut);
  if (g.extension.half_acquisition.value_or(false) && center != g.center)
    throw InputError(
        "half acquisition: the rows were weighted about another centre; read the scan with this one");
  return center;
}

}  // namespace vdvr
