#include "host/verify/audit/registration_words.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "host/verify/audit/orientation.hpp"

namespace vdvr {
namespace {

// Of 1: programs that are right agree to less.
constexpr double kLeastFactor = 0.01;

std::string samples_off(double d) {
  const double size = std::abs(d), halves = std::round(2 * size) / 2;
  const char* side = d < 0 ? "towards smaller" : "towards larger";
  if (std::abs(size - halves) > 0.05 || halves == 0) return fmt::format("{:.2f} samples off {} ", size, side);
  if (halves == 0.5) return fmt::format("half a sample off {} ", side);
  return fmt::format("{:g} sample{} off {} ", halves, halves == 1 ? "" : "s", side);
}

std::string factor_words(double scale, double pitch) {
  if (scale < 0) return fmt::format("densities are negative: {:.4g} times those of F", scale);
  const std::string times = scale >= 1 ? fmt::format("densities {:.3g} times too large", scale)
                                       : fmt::format("densities {:.3g} times too small", 1 / scale);
  if (std::abs(pitch - 1) > 0.05 && std::abs(scale / pitch - 1) < kLeastFactor)
    return times + ": they are per pixel and not per unit of length";
  if (std::abs(pitch - 1) > 0.05 && std::abs(scale * pitch - 1) < kLeastFactor)
    return times + ": one over the pixel's width";
  return times;
}

}  // namespace

bool earns_its_keep(double without, double with) {
  return without > 2 * with && without - with > kNegligible;
}

void name_faults(Registration& r, const LinearFit& linear, const ProjectionSet& scan,
                 const FieldOptions& field) {
  // Where F explains little however W is turned, no turn and no factor says anything.
  if (linear.unexplained > 0.5) {
    Registration plain;
    plain.window = field.filter;
    plain.unexplained = plain.unexplained_registered = r.unexplained;
    plain.doubt = fmt::format(
        "F explains {:.0f} % of the volume's variance at most, however it is turned and moved: is it of this "
        "scan, on "
        "this grid?",
        100 * (1 - linear.unexplained));
    r = plain;
    return;
  }
  if (const std::string turned = words_of({r.axes, r.mirrored}); !turned.empty()) r.words.push_back(turned);
  // What is blurred fits best with less than F, and is not off by a factor for it: either must explain as
  // much as other faults.
  if (std::abs(linear.scale - 1) > kLeastFactor && earns_its_keep(linear.without_scale, linear.unexplained)) {
    r.scale = linear.scale;
    r.words.push_back(factor_words(linear.scale, scan.geometry.pitch_u));
  }
  if ((r.scale != 1 ? earns_its_keep(linear.without_offset, linear.unexplained)
                    : earns_its_keep(linear.without_both, linear.without_scale))) {
    r.offset = r.scale != 1 ? linear.offset : linear.offset_alone;
    r.words.push_back(fmt::format("an offset: {:+.4g} on all densities", linear.offset));
  }
  constexpr std::array<const char*, 3> names{"x", "y", "z"};
  for (std::size_t a = 0; a < 3; ++a)
    if (r.shift[a] != 0) r.words.push_back(samples_off(r.shift[a]) + names[a]);
  if (r.center != 0) {
    const double used = stated_center(field, scan.geometry);
    r.words.push_back(
        fmt::format("F with its axis at {:.4g} fits better (you used {:.4g})", used + r.center, used));
  }
  if (r.window != field.filter)
    r.words.push_back(
        fmt::format("another window: {} fits better than {}", text_of(r.window), text_of(field.filter)));
}

}  // namespace vdvr
