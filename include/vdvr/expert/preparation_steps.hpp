// What may be done to projections before F is made of them: F is that of the prepared projections. Recorded
// in the certificate's `field`, done again by whoever reads the scan to verify it (docs/preparation.md).
#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace vdvr {

/// A pixel whose transmission lies above the median of its window x window neighbours by more than
/// `threshold`, a fraction of the open beam, becomes that median (zingers: X-rays that hit the camera).
struct Outliers {
  double threshold = 0.1;
  int window = 3;  ///< odd
  bool operator==(const Outliers&) const = default;
};

/// Paganin's single-distance phase retrieval (Journal of Microscopy 206, 2002, 33) of parallel beam: each
/// transmission is divided, in frequency, by 1 + (d lambda / 4 pi) (delta / beta) |k|^2.
struct PhaseRetrieval {
  double distance_mm = 0;  ///< d, object to detector
  double energy_kev = 0;
  double delta_beta = 0;  ///< the object's delta / beta
  bool operator==(const PhaseRetrieval&) const = default;
};

/// Stripes of a sinogram, rings in a slice (after Vo et al., Optics Express 26, 2018, 28396): dead and
/// fluctuating columns, columns off those around them for long, small differences of all others. A window of
/// 0 is set when the scan is read: a sixth and a fifteenth of the columns, at most 51 and 21.
struct Stripes {
  double ratio = 3;  ///< of a stripe to noise, above which a column is dead, fluctuating or off
  int large = 0;     ///< columns that a dead or fluctuating one is compared with; odd
  int small = 0;     ///< columns of the median of sorted columns, twice the widest stripe; odd
  bool operator==(const Stripes&) const = default;
};

/// What rows go on with beyond the detector, tapering to zero, where the object is wider than it: nothing,
/// the outermost sample, or the row's mirror image (docs/geometry.md, "Rows that go on").
enum class Padding { none, edge, mirror };
constexpr const char* text_of(Padding padding) {
  return padding == Padding::edge ? "edge" : padding == Padding::mirror ? "mirror" : "none";
}

constexpr std::optional<Padding> padding_of(std::string_view text) {
  for (const Padding p : {Padding::none, Padding::edge, Padding::mirror})
    if (text == text_of(p)) return p;
  return {};
}

/// Which heights rows are brought to, of views that saw the sample at other heights: none, those that all
/// views see, or all that are seen from every direction (docs/geometry.md, "Shifts by view").
enum class Heights { as_seen, common, all };
constexpr const char* text_of(Heights heights) {
  return heights == Heights::all ? "all" : heights == Heights::common ? "common" : "as-seen";
}

constexpr std::optional<Heights> heights_of(std::string_view text) {
  for (const Heights h : {Heights::as_seen, Heights::common, Heights::all})
    if (text == text_of(h)) return h;
  return {};
}

/// Steps in the order in which they are done. By default none.
struct Preparation {
  std::optional<Outliers> outliers;
  std::optional<PhaseRetrieval> phase;
  std::optional<Stripes> stripes;
  int median = 1;                        ///< side of a square window, odd; 1: none
  std::array<double, 2> gaussian{0, 0};  ///< standard deviations in columns and rows; 0: none
  int binning = 1;                       ///< columns and rows of a detector pixel that become one
  /// Whether opposite views about an axis off the middle make one row of a wider detector (docs/geometry.md,
  /// "Half acquisition"). Without a value, axis and arc decide when the scan is read.
  std::optional<bool> half_acquisition;
  Padding padding = Padding::none;
  /// Whether flats taken at several places among the projections are interpolated in the order of frames, and
  /// whether each frame is divided by the beam's current (docs/preparation.md, "Flats in time"). Without a
  /// value: where the files of the scan tell. Recorded as true where it was done, else without a value.
  std::optional<bool> flats_in_time, beam_current;
  /// Without a value common heights, or all where views share fewer than half of their rows and more are
  /// covered so; `as_seen` leaves it to whoever reads the scan. Recorded where rows were moved.
  std::optional<Heights> heights;

  [[nodiscard]] bool none() const { return *this == Preparation{}; }
  bool operator==(const Preparation&) const = default;
};

}  // namespace vdvr
