// What F is, of all the fields that a scan could stand for (docs/geometry.md).
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <utility>

#include "vdvr/expert/preparation_steps.hpp"

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
  std::optional<double> center;  ///< overrides the scan's; in columns of the prepared projections
  /// What was done to the projections. It is done where they are read (ScanOptions), and recorded here.
  Preparation preparation{};
  bool operator==(const FieldOptions&) const = default;
};

}  // namespace vdvr
