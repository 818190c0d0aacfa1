// Turns and mirrors by brute force on a thinned grid, then windows, centres and shifts by F itself: F can be
// made anywhere, so that W is never interpolated.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "host/base/system/casts.hpp"
#include "host/field/fdk/filter_cone.hpp"
#include "host/verify/audit/best_orientation.hpp"
#include "host/verify/audit/fit.hpp"
#include "host/verify/audit/registration_words.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/audit.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr {
namespace {

constexpr double kCenterStep = 0.25;  // columns

/// Fits of one oriented volume.
class Fitter {
 public:
  Fitter(Device& device, const ProjectionSet& scan, const Volume& w, const AuditOptions& options,
         const Progress& progress)
      : device_(device),
        scan_(scan),
        options_(options),
        progress_(progress),
        thin_(w.grid, certified_coverage(scan, options.field), options, kReach + 1) {
    const Index3 n = w.grid.samples();
    for (const Index3& s : thin_.samples())
      w_.push_back(static_cast<double>(w.samples[at((s[2] * n[1] + s[1]) * n[0] + s[0])]));
    const auto& extension = scan.geometry.extension;
    // Rows that were weighted about a centre have no other.
    moves_center_ = !extension.half_acquisition.value_or(false);
  }

  [[nodiscard]] LinearFit fit(const FitSettings& s) { return linear_fit(w_, field(s)); }
  [[nodiscard]] bool is_constant() const {
    return *std::min_element(w_.begin(), w_.end()) == *std::max_element(w_.begin(), w_.end());
  }

  /// Gauss and Newton's steps in the shift and, where asked, the centre, from where they are; a step that
  /// explains less is halved. F is linear in neither, so differences over a tenth of a sample take the place
  /// of derivatives.
  FitSettings refined(FitSettings s, bool shift, bool center) {
    std::vector<int> free;
    if (shift) free = {0, 1, 2};
    if (center && moves_center_) free.push_back(3);
    if (free.empty()) return s;
    double least = fit(s).unexplained;
    for (int round = 0; round < 5 && least > kNegligible / 10; ++round) {
      const std::vector<double> step = step_of(s, free);
      double part = 1;
      FitSettings next = s;
      double found = least;
      for (; part > 0.1; part /= 2) {
        next = s;
        for (std::size_t i = 0; i < free.size(); ++i) parameter(next, free[i]) += part * step[i];
        for (const int p : free)
          parameter(next, p) = std::clamp(parameter(next, p), -kReach - 0.5, kReach + 0.5);
        found = fit(next).unexplained;
        if (found < least) break;
      }
      if (!(found < least)) break;
      const bool settled = found > 0.999 * least;
      s = next;
      least = found;
      if (settled) break;
    }
    return s;
  }

  /// The window that explains most, else the same.
  FitSettings with_best_window(const FitSettings& s) {
    FitSettings best = s;
    double least = fit(s).unexplained;
    for (const auto& [window, name] : ramp_windows) {
      FitSettings other = s;
      other.window = window;
      const double found = fit(other).unexplained;
      if (found < least) {
        best = other;
        least = found;
      }
    }
    return best;
  }

  FitSettings with_best_center(const FitSettings& s) {
    FitSettings best = s;
    if (!moves_center_) return best;
    double least = fit(s).unexplained;
    for (int i = -static_cast<int>(kReach / kCenterStep); i * kCenterStep <= kReach; ++i) {
      FitSettings other = s;
      other.center = i * kCenterStep;
      const double found = fit(other).unexplained;
      if (found < least) {
        best = other;
        least = found;
      }
    }
    return best;
  }

 private:
  static double& parameter(FitSettings& s, int p) { return p < 3 ? s.shift[at(p)] : s.center; }

  std::vector<double> field(const FitSettings& s) {
    throw_if_stopped();
    report(progress_, "register", std::min(0.99, 0.06 + 0.01 * fits_++));
    try {
      return thin_.field(device_, scan_, options_.field, s);
    } catch (const InputError&) {
      if (s.center == 0) throw;
      return std::vector<double>(w_.size(), 0.0);  // that axis leaves nothing covered: it explains nothing
    }
  }

  /// The normal equations of W - (scale * F + offset) in the free parameters, scale and offset.
  std::vector<double> step_of(const FitSettings& s, const std::vector<int>& free) {
    constexpr double h = 0.05;
    const std::vector<double> f = field(s);
    const LinearFit linear = linear_fit(w_, f);
    std::vector<std::vector<double>> columns;
    for (const int p : free) {
      FitSettings above = s, below = s;
      parameter(above, p) += h;
      parameter(below, p) -= h;
      std::vector<double> column = field(above);
      const std::vector<double> low = field(below);
      for (std::size_t i = 0; i < column.size(); ++i)
        column[i] = linear.scale * (column[i] - low[i]) / (2 * h);
      columns.push_back(std::move(column));
    }
    columns.push_back(f);
    columns.emplace_back(f.size(), 1.0);
    std::vector<double> residual(f.size());
    for (std::size_t i = 0; i < f.size(); ++i) residual[i] = w_[i] - linear.scale * f[i] - linear.offset;
    std::vector<double> step = least_squares(columns, residual);
    step.resize(free.size());
    // A parameter that F hardly depends on would be sent anywhere.
    for (double& d : step) d = std::clamp(d, -1.0, 1.0);
    return step;
  }

  /// Cholesky's factors of the normal equations, a little damped so that columns that are alike do no harm.
  static std::vector<double> least_squares(const std::vector<std::vector<double>>& columns,
                                           const std::vector<double>& right) {
    const std::size_t n = columns.size();
    std::vector<std::vector<double>> a(n, std::vector<double>(n, 0));
    std::vector<double> b(n, 0);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = 0; k < right.size(); ++k) b[i] += columns[i][k] * right[k];
      for (std::size_t j = 0; j <= i; ++j)
        for (std::size_t k = 0; k < right.size(); ++k) a[i][j] += columns[i][k] * columns[j][k];
    }
    for (std::size_t i = 0; i < n; ++i) {
      a[i][i] = a[i][i] * (1 + 1e-6) + std::numeric_limits<double>::min();
      for (std::size_t j = 0; j <= i; ++j) {
        for (std::size_t k = 0; k < j; ++k) a[i][j] -= a[i][k] * a[j][k];
        a[i][j] =
            i == j ? std::sqrt(std::max(a[i][i], std::numeric_limits<double>::min())) : a[i][j] / a[j][j];
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = 0; k < i; ++k) b[i] -= a[i][k] * b[k];
      b[i] /= a[i][i];
    }
    for (std::size_t i = n; i-- > 0;) {
      for (std::size_t k = i + 1; k < n; ++k) b[i] -= a[k][i] * b[k];
      b[i] /= a[i][i];
    }
    return b;
  }

  Device& device_;
  const ProjectionSet& scan_;
  const AuditOptions& options_;
  const Progress& progress_;
  ThinnedGrid thin_;
  std::vector<double> w_;
  bool moves_center_ = true;
  int fits_ = 0;
};

/// What explains most, from several beginnings: shifts, centres and windows can stand for one another in
/// part.
FitSettings best_settings(Fitter& fitter, const FitSettings& plain, const Vec3& shift) {
  FitSettings shifted = plain;
  shifted.shift = shift;
  std::vector<FitSettings> starts{plain, fitter.refined(shifted, true, false), fitter.with_best_window(plain),
                                  fitter.with_best_center(plain)};
  FitSettings best = plain;
  double least = std::numeric_limits<double>::infinity();
  for (const FitSettings& s : starts)
    if (const double found = fitter.fit(s).unexplained; found < least) {
      best = s;
      least = found;
    }
  for (int round = 0; round < 2; ++round) {
    const FitSettings before = best;
    best = fitter.with_best_window(fitter.refined(best, true, true));
    if (best.window == before.window && round > 0) break;
  }
  return best;
}

/// Only what halves the unexplained variance is left: each thing that was found is taken back by itself, the
/// others being fitted again.
FitSettings what_counts(Fitter& fitter, const FitSettings& plain, FitSettings s) {
  const auto shift_matters = [](const FitSettings& x) {
    return std::any_of(x.shift.begin(), x.shift.end(), [](double d) { return std::abs(d) >= kLeastShift; });
  };
  // The window first: a broader one looks like a wrong centre, not the other way round.
  if (s.window != plain.window) {
    FitSettings without = s;
    without.window = plain.window;
    without = fitter.refined(without, true, true);
    if (!earns_its_keep(fitter.fit(without).unexplained, fitter.fit(s).unexplained)) s = without;
  }
  FitSettings without = s;
  without.center = 0;
  without = fitter.refined(without, true, false);
  if (std::abs(s.center) < kLeastShift ||
      !earns_its_keep(fitter.fit(without).unexplained, fitter.fit(s).unexplained))
    s = without;
  without = s;
  without.shift = {0, 0, 0};
  if (s.center != 0) without = fitter.refined(without, false, true);
  if (!shift_matters(s) || !earns_its_keep(fitter.fit(without).unexplained, fitter.fit(s).unexplained))
    s = without;
  for (double& d : s.shift)
    if (std::abs(d) < kLeastShift) d = 0;
  return s;
}

}  // namespace

Registration register_volume(Device& device, const ProjectionSet& scan, const Volume& volume,
                             const AuditOptions& options, const Progress& progress) {
  FitSettings plain;
  plain.window = options.field.filter;
  Registration r;
  {
    Fitter as_it_is(device, scan, volume, options, progress);
    r.unexplained = as_it_is.fit(plain).unexplained;
    if (as_it_is.is_constant()) throw InputError("all samples of the volume that are covered are equal");
  }
  Orientation orientation;
  FitSettings found = plain;
  // What else is off hides a mirror of an object that is nearly its own, and is seen the better without it.
  for (int round = 0; round < 2; ++round) {
    const Placed placed = best_orientation(device, scan, volume, options, found, orientation, progress);
    if (round > 0 && placed.orientation == orientation) break;
    orientation = placed.orientation;
    const Volume copy = orientation.is_plain() ? Volume{} : oriented(volume, orientation);
    Fitter fitter(device, scan, orientation.is_plain() ? volume : copy, options, progress);
    Vec3 shift = found.shift;
    for (std::size_t a = 0; a < 3; ++a) shift[a] += static_cast<double>(placed.shift[a]);
    found = what_counts(fitter, plain, best_settings(fitter, plain, shift));
    const LinearFit linear = fitter.fit(found);
    r.axes = orientation.axes;
    r.mirrored = orientation.mirrored;
    r.shift = found.shift;
    r.center = found.center;
    r.window = found.window;
    r.unexplained_registered = linear.unexplained;
    r.scale = 1;
    r.offset = 0;
    r.words.clear();
    r.doubt.clear();
    name_faults(r, linear, scan, options.field);
  }
  return r;
}

Volume registered_volume(const Volume& volume, const Registration& r) {
  Volume right = oriented(volume, {r.axes, r.mirrored});
  for (std::size_t a = 0; a < 3; ++a) right.grid.origin[a] -= r.shift[a] * right.grid.spacing[a];
  if (r.scale != 1 || r.offset != 0)
    for (float& s : right.samples) s = static_cast<float>((static_cast<double>(s) - r.offset) / r.scale);
  return right;
}

}  // namespace vdvr
