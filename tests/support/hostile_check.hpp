// Builds a hostile case through the public library and holds the result to what a certificate promises: the
// true |V - F| in double at many points, verify, finite numbers, the file, and the same case at scale 1. Each
// failure is a kind and a line. Called by hostile_builds.cpp and attack_scales_test.cpp.
#pragma once

#include <chrono>
#include <cstdio>
#include <set>

#include "host/scan/geometry/vectors.hpp"
#include "host/volume/bricks.hpp"
#include "tests/support/hostile_case.hpp"
#include "tests/support/temporary_folder.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certified_region.hpp"
#include "vdvr/expert/noise_forecast.hpp"
#include "vdvr/expert/reconstruct.hpp"
#include "vdvr/expert/region_of_interest.hpp"
#include "vdvr/expert/verify.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr::hostile {

struct Failure {
  std::string kind, text;
};

/// What came of make_plan and build. `built` is empty where they threw.
struct Outcome {
  std::string kind;  ///< built, tolerance, input, or other: which none of them should be
  std::string message;
  std::optional<BuildResult> built;
  double seconds = 0;
};

struct Report {
  Outcome outcome;
  std::vector<Failure> failures;
  std::string excuse;        ///< why float32 cannot hold this scale; empty where it can
  double epsilon = 0;        ///< of the ladder's step that was taken
  double closest = 0;        ///< largest |V - F| / the certified total
  double closest_brick = 0;  ///< the same against the brick's own bound
  std::int64_t points = 0;   ///< where V was compared with F
  double check_seconds = 0;
  bool verified = false, compared = false;

  void fail(std::string kind, std::string text) { failures.push_back({std::move(kind), std::move(text)}); }
};

namespace detail {

using Clock = std::chrono::steady_clock;
inline double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

inline std::string text_of(double x) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.6g", x);
  return text.data();
}
inline std::string text_of(const Vec3& p) {
  return "(" + text_of(p[0]) + ", " + text_of(p[1]) + ", " + text_of(p[2]) + ")";
}

/// Sigma of each brick, whatever the scan: 1 to 8 epsilon.
inline BrickSigma drawn_sigma(const Plan& plan, std::uint64_t seed) {
  Random random(seed);
  BrickSigma sigma;
  // What is asked of a brick lies a little below what is promised of it.
  const double least = plan.epsilon_abs * (1 + 0x1p-16);
  sigma.range = {least, 4 * least, 8 * least};
  const Index3 n = Bricks(plan.grid, plan.layout.granularity).along();
  for (std::int64_t b = 0; b < n[0] * n[1] * n[2]; ++b)
    sigma.of_brick.push_back(static_cast<float>(least * (1 + 7 * unit(random))));
  return sigma;
}

inline BuildResult built_of(Device& device, const Inputs& in, const Plan& plan) {
  if (!in.sigma_seed) return build(device, in.scan, plan, in.options);
  const BrickSigma sigma = drawn_sigma(plan, *in.sigma_seed);
  BuildOptions options = in.options;
  options.refinement = refinement_in_sigma(sigma, 1);
  BuildResult result = build(device, in.scan, plan, options);
  ScanNoise noise;
  noise.model.source = "stated";
  if (result.certificate.holds_buffer) note_noise(result.certificate, noise, sigma, 1.0);
  return result;
}

inline Outcome attempt(Device& device, const Inputs& in) {
  Outcome out;
  const auto start = Clock::now();
  try {
    const Plan plan = make_plan(device, in.scan, in.grid, in.field, in.rates, in.tolerance, in.settings);
    out.built = built_of(device, in, plan);
    out.kind = "built";
  } catch (const ToleranceError& e) {
    out.kind = "tolerance";
    out.message = e.what();
  } catch (const InputError& e) {
    out.kind = "input";
    out.message = e.what();
  } catch (const std::exception& e) {
    out.kind = "other";
    out.message = e.what();
  }
  out.seconds = since(start);
  return out;
}

/// Every number of a certificate is finite, it promises what was asked, and its JSON reads back.
inline void check_certificate(const BuildResult& result, Report& r) {
  const Certificate& c = result.certificate;
  std::vector<std::pair<std::string, double>> numbers{
      {"epsilon", c.epsilon},
      {"epsilon_abs", c.epsilon_abs},
      {"reference_range", c.reference_range},
      {"total_buffer", c.total_buffer},
      {"total_image3d", c.total_image3d.value_or(0)},
      {"measured_max", c.measured_max},
      {"measured_total", c.measured_total},
      {"budget.grid", c.budget.grid.value},
      {"budget.gold", c.budget.gold.value},
      {"budget.projection", c.budget.projection.value},
      {"budget.arithmetic", c.budget.arithmetic.value},
      {"budget.sampler.buffer", c.budget.sampler.buffer.value},
      {"budget.sampler.image3d", c.budget.sampler.image3d ? c.budget.sampler.image3d->value : 0}};
  for (const Bound& b : c.bounds)
    numbers.emplace_back("bound " + b.stage + ", " + b.method + ", " + std::to_string(b.rate), b.value);
  for (const float total : c.brick_totals)
    numbers.emplace_back("a brick's total", static_cast<double>(total));
  for (const double x : c.worst_at) numbers.emplace_back("worst_at", x);
  for (const auto& [name, value] : numbers)
    if (!std::isfinite(value)) {
      r.fail("not finite", name + " is " + text_of(value));
      break;
    }
  for (const auto& [name, value] : numbers)
    if (value < 0 && name != "worst_at" && name != "a brick's total")
      r.fail("not finite", name + " is negative: " + text_of(value));
  const bool tested =
      std::any_of(c.brick_totals.begin(), c.brick_totals.end(), [](float t) { return t >= 0; });
  if (tested && !(c.holds_buffer && c.holds_image3d.value_or(true)))
    r.fail("does not hold", "build gave a certificate that does not hold: total " + text_of(c.total_buffer) +
                                ", epsilon " + text_of(c.epsilon_abs));
  if (c.holds_buffer && !(c.total_buffer <= c.epsilon_abs))
    r.fail("does not hold", "total " + text_of(c.total_buffer) + " above epsilon " + text_of(c.epsilon_abs));
  if (c.noise && !(worst_in_sigma(c, false) <= c.noise->tolerance_sigmas.value_or(0)))
    r.fail("does not hold", "a brick's bound is above what is promised in sigma");
  try {
    const std::string json = to_json(c);
    Certificate read = certificate_from_json(json);
    read.brick_totals = c.brick_totals;  // datasets of the file
    read.brick_sigma = c.brick_sigma;
    if (to_json(read) != json) r.fail("json", "the certificate reads back otherwise");
  } catch (const std::exception& e) {
    r.fail("not finite", e.what());
  }
}

/// Places where V is most likely to be farthest from F.
inline std::vector<Vec3> hostile_points(const Case& c, const Inputs& in, const BuildResult& result,
                                        Random& random) {
  const Grid& g = in.grid;
  const MixedVolume& v = result.volume;
  const std::array<double, 3> length{c.scale.pitch_u, c.scale.pitch_u, c.scale.pitch_v};
  std::vector<Vec3> points;
  const auto add = [&](const Vec3& cell) {
    Vec3 p{};
    for (std::size_t a = 0; a < 3; ++a)
      p[a] = g.origin[a] + std::clamp(cell[a], 0.0, static_cast<double>(g.cells[a])) * g.spacing[a];
    points.push_back(p);
  };
  // Stored base samples and brick corners are grid samples; cell centres, middles of faces and edges.
  for (std::int64_t z = 0; z <= 2 * g.cells[2]; ++z)
    for (std::int64_t y = 0; y <= 2 * g.cells[1]; ++y)
      for (std::int64_t x = 0; x <= 2 * g.cells[0]; ++x)
        add({0.5 * static_cast<double>(x), 0.5 * static_cast<double>(y), 0.5 * static_cast<double>(z)});
  const auto anywhere = [&](std::size_t a) { return unit(random) * static_cast<double>(g.cells[a]); };
  for (int i = 0; i < 200; ++i) add({anywhere(0), anywhere(1), anywhere(2)});
  // One rounding beside a brick's face, in double and in the sampler's fp32.
  const Index3 bricks = v.bricks();
  for (int i = 0; i < 200; ++i) {
    Vec3 cell{anywhere(0), anywhere(1), anywhere(2)};
    const std::size_t a = random() % 3;
    for (std::size_t b = 0; b < 3; ++b) {
      if (b != a && !chance(random, 0.3)) continue;
      const double face =
          static_cast<double>((random() % static_cast<std::uint64_t>(bricks[b] + 1))) * v.granularity;
      const double up = chance(random, 0.5) ? INFINITY : -INFINITY;
      cell[b] = chance(random, 0.5)
                    ? std::nextafter(face, up)
                    : static_cast<double>(std::nextafter(static_cast<float>(face), static_cast<float>(up)));
    }
    add(cell);
  }
  // Middles of gold cells: of the bricks with the largest totals, around the worst node, and around the
  // scan's own worst place.
  const auto& totals = result.certificate.brick_totals;
  std::vector<std::size_t> order(totals.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return totals[a] > totals[b]; });
  order.resize(std::min<std::size_t>(order.size(), 4));
  for (const std::size_t brick : order)
    for (int i = 0; i < 150; ++i) {
      const auto at = static_cast<std::int64_t>(brick);
      const Index3 b{at % bricks[0], at / bricks[0] % bricks[1], at / bricks[0] / bricks[1]};
      Vec3 cell{};
      for (std::size_t a = 0; a < 3; ++a)
        cell[a] = static_cast<double>(b[a] * v.granularity) +
                  (static_cast<double>(random() % static_cast<std::uint64_t>(v.granularity * v.rate)) + 0.5) /
                      v.rate;
      add(cell);
    }
  for (const bool target : {false, true})
    for (int i = 0; i < 125; ++i) {
      Vec3 cell{};
      std::int64_t rest = i;
      for (std::size_t a = 0; a < 3; ++a, rest /= 5) {
        const double at = target ? c.target[a] * length[a] : result.certificate.worst_at[a];
        cell[a] = (at - g.origin[a]) / g.spacing[a] + 0.5 * static_cast<double>(rest % 5 - 2) / v.rate;
      }
      add(cell);
    }
  // A scan of one row covers a plane only, and rows end on one.
  const auto [bottom, top] = CertifiedRegion(in.scan, in.field).cylinder().z;
  const double last = g.origin[2] + static_cast<double>(g.cells[2]) * g.spacing[2];
  for (Vec3& p : points) {
    if (in.scan.geometry.rows > 1 && !chance(random, 0.05)) continue;
    const double z = chance(random, 0.5) ? top : bottom;
    if (z >= g.origin[2] && z <= last) p[2] = z;
  }
  return points;
}

/// Which brick a point lies in, by double precision: on a face, the lower of the two by `low`.
inline std::int64_t brick_of(const MixedVolume& v, const Vec3& p, bool low) {
  const Index3 n = v.bricks();
  Index3 b{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double cell = (p[a] - v.grid.origin[a]) / v.grid.spacing[a] / v.granularity;
    const double whole = low ? std::ceil(cell) - 1 : std::floor(cell);
    b[a] = std::clamp<std::int64_t>(static_cast<std::int64_t>(whole), 0, n[a] - 1);
  }
  return (b[2] * n[1] + b[1]) * n[0] + b[0];
}

/// |V - F| at the points where the certificate speaks, against the brick's own bound and the total.
class Truth {
 public:
  Truth(const Inputs& in, const BuildResult& result, Report& report)
      : in_(in),
        result_(result),
        report_(report),
        exact_(in.scan, in.field),
        region_(in.scan, in.field),
        total_(result.certificate.total_buffer) {
    if (!result.certificate.brick_totals.empty()) bounds_ = brick_bounds(result.certificate, false);
  }

  /// error / bound by point; negative where nothing is claimed.
  std::vector<double> compare(const std::vector<Vec3>& points) {
    const auto F = exact_.at(points);
    std::vector<double> ratios(points.size(), -1);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!region_.contains(points[i])) continue;
      if (in_.options.window && !(F[i] >= in_.options.window->first && F[i] <= in_.options.window->second))
        continue;
      if (!is_inside(in_.options.roi, points[i])) continue;
      ratios[i] = compare(points[i], F[i]);
    }
    return ratios;
  }

 private:
  [[nodiscard]] double rounding_at(const Vec3& p) const {
    double lambda = 1;
    for (const ViewMatrix& m : exact_.views()) lambda = std::min(lambda, projected(m, p)[2]);
    return exact_.rounding() / (lambda * lambda);
  }

  double compare(const Vec3& p, double F) {
    const MixedVolume& v = result_.volume;
    const Index3 b = brick_at(v, p), n = v.bricks();
    const auto bound_of = [&](std::int64_t brick) {
      return static_cast<double>(bounds_[static_cast<std::size_t>(brick)]);
    };
    // One rounding beside a face the sampler may read the neighbour, whose own bound is promised there too.
    double bound = -1;
    for (const std::int64_t brick :
         {(b[2] * n[1] + b[1]) * n[0] + b[0], brick_of(v, p, true), brick_of(v, p, false)})
      if (std::isfinite(bound_of(brick))) bound = std::max(bound, bound_of(brick));
    const double V = static_cast<double>(sample_at(v, p)), error = std::abs(V - F) - rounding_at(p);
    ++report_.points;
    const auto errs = [&] {
      return "|V - F| " + text_of(error) + ", total " + text_of(total_) + " (" + text_of(error / total_) +
             "), epsilon " + text_of(result_.certificate.epsilon_abs);
    };
    const auto where = [&] {
      return " at " + text_of(p) + ", V " + text_of(V) + ", F " + text_of(F) + ", brick (" +
             std::to_string(b[0]) + ", " + std::to_string(b[1]) + ", " + std::to_string(b[2]) + ")";
    };
    if (bound < 0) {
      once("not tested", "a covered point lies in no tested brick: " + errs() + where());
      return 0;
    }
    if (error > 0) {
      report_.closest = std::max(report_.closest, error / total_);
      report_.closest_brick = std::max(report_.closest_brick, error / bound);
    }
    if (!(error <= total_)) once("violation", errs() + where());
    else if (!(error <= bound))
      once("brick bound", errs() + ", the brick's own bound " + text_of(bound) + where());
    return error / bound;
  }

  // The first of a kind stands for all of a case.
  void once(const std::string& kind, const std::string& text) {
    if (seen_.insert(kind).second) report_.fail(kind, text);
  }

  const Inputs& in_;
  const BuildResult& result_;
  Report& report_;
  ExactField exact_;
  CertifiedRegion region_;
  std::vector<float> bounds_;
  double total_;
  std::set<std::string> seen_;
};

/// Where it comes closest, it is searched more closely.
inline void check_points(const Case& c, const Inputs& in, const BuildResult& result, Random& random,
                         Report& r) {
  std::vector<Vec3> points = hostile_points(c, in, result, random);
  if (!result.certificate.holds_buffer) {
    // With a region or a window nothing may be left to test, and nothing is promised then.
    const CertifiedRegion region(in.scan, in.field);
    if (!in.options.roi && !in.options.window &&
        std::any_of(points.begin(), points.end(), [&](const Vec3& p) { return region.contains(p); }))
      r.fail("does not hold", "nothing is certified of a grid with covered points");
    return;
  }
  Truth truth(in, result, r);
  for (int round = 0; round < 3; ++round) {
    const auto ratios = truth.compare(points);
    std::vector<std::size_t> order(points.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return ratios[a] > ratios[b]; });
    std::vector<Vec3> next;
    for (std::size_t i = 0; i < std::min<std::size_t>(order.size(), 6); ++i)
      for (int k = 0; k < 25; ++k) {
        Vec3 p = points[order[i]];
        for (std::size_t a = 0; a < 3; ++a) {
          const double h = in.grid.spacing[a] / result.volume.rate * std::pow(0.3, round);
          const double top = in.grid.origin[a] + static_cast<double>(in.grid.cells[a]) * in.grid.spacing[a];
          if (a < 2 || in.scan.geometry.rows > 1)
            p[a] = std::clamp(p[a] + (2 * unit(random) - 1) * h, in.grid.origin[a], top);
        }
        next.push_back(p);
      }
    points = std::move(next);
  }
}

inline void check_verify(Device& device, const Inputs& in, const BuildResult& result, bool sample,
                         Report& r) {
  try {
    VerifyOptions options;
    options.exhaustive = !sample;
    const VerifyResult verified = verify(device, in.scan, result.volume, result.certificate, options);
    r.verified = true;
    // Nodes around the covered region are tested; where none of it is left, verify says that it tests
    // nothing.
    const bool nothing_covered = verified.cells_tested == 0 && r.points == 0;
    if (result.certificate.holds_buffer && !verified.holds && !nothing_covered)
      r.fail(verified.cells_tested > 0 ? "verify refuses" : "verify tests nothing",
             verified.failure + "; verify's total " + text_of(verified.total) + ", the certificate's " +
                 text_of(result.certificate.total_buffer));
    for (const double x :
         {verified.measured_max, verified.measured_total, verified.total, verified.arithmetic})
      if (!std::isfinite(x)) {
        r.fail("not finite", "verify measures " + text_of(x));
        break;
      }
  } catch (const std::exception& e) {
    r.fail("verify throws", e.what());
  }
}

inline void check_file(const BuildResult& result, Report& r) {
  try {
    const support::TemporaryFolder folder;
    write_vdvr(folder / "o.vdvr", result.volume, result.certificate);
    const VdvrFile file = read_vdvr(folder / "o.vdvr");
    if (content_sha256(file.volume) != content_sha256(result.volume))
      r.fail("file", "the volume reads back otherwise");
    Certificate expected = result.certificate;
    expected.content_sha256 = file.certificate.content_sha256;
    expected.sealed = true;
    if (to_json(file.certificate) != to_json(expected))
      r.fail("file", "the certificate reads back otherwise");
    if (file.certificate.brick_totals != result.certificate.brick_totals)
      r.fail("file", "the bricks' totals read back otherwise");
  } catch (const std::exception& e) {
    r.fail("file", e.what());
  }
}

/// The same numbers up to a factor, but for what float32 loses below its smallest normal number.
inline bool same_samples(const SampleBlock& a, double step_a, const SampleBlock& b, double step_b,
                         double factor) {
  if (a.type != b.type) return false;
  const auto x = decoded(a, step_a), y = decoded(b, step_b);
  if (x.size() != y.size()) return false;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!(std::abs(static_cast<double>(x[i]) * factor - static_cast<double>(y[i])) <= 0x1p-149)) return false;
  return true;
}

/// At powers of two: the same rates, levels, samples and shares.
inline std::string difference(const BuildResult& one, const BuildResult& scaled, double density) {
  const MixedVolume &a = one.volume, &b = scaled.volume;
  const Certificate &p = one.certificate, &q = scaled.certificate;
  if (p.rates != q.rates) return "other rates";
  if (a.coarsening != b.coarsening) return "another base";
  // A file's step is a normal number: integers of smaller densities are coarser.
  if (b.step == 0x1p-126 && a.step * density < b.step) return {};
  std::int64_t bricks = 0;
  for (std::size_t i = 0; i < a.level.size(); ++i) bricks += a.level[i] != b.level[i];
  if (bricks > 0) return std::to_string(bricks) + " of " + std::to_string(a.level.size()) + " levels differ";
  if (!same_samples(a.base, a.step, b.base, b.step, density)) return "other base samples";
  if (a.tiles.size() != b.tiles.size()) return "other kinds of tiles";
  for (const auto& [kind, tiles] : a.tiles) {
    const auto other = b.tiles.find(kind);
    if (other == b.tiles.end() || !same_samples(tiles, a.step, other->second, b.step, density))
      return "other tiles";
  }
  const auto share = [&](const char* name, double x, double y) {
    // fp32 in between: 1e-6 of the value, and what is lost below its smallest normal number.
    return std::abs(x * density - y) <= 1e-6 * std::abs(x * density) + 0x1p-145
               ? std::string()
               : std::string(name) + " " + text_of(x * density) + " changes by " +
                     text_of(std::abs(x * density - y) / std::abs(x * density)) + " of itself";
  };
  for (const auto& text :
       {share("measured total", p.measured_total, q.measured_total),
        share("largest measured", p.measured_max, q.measured_max),
        share("T", p.budget.gold.value, q.budget.gold.value),
        share("P", p.budget.projection.value, q.budget.projection.value),
        share("arithmetic", p.budget.arithmetic.value, q.budget.arithmetic.value),
        share("sampler", p.budget.sampler.buffer.value, q.budget.sampler.buffer.value),
        share("total", p.total_buffer, q.total_buffer), share("epsilon", p.epsilon_abs, q.epsilon_abs)})
    if (!text.empty()) return text;
  for (std::size_t i = 0; i < p.brick_totals.size(); ++i)
    if (const auto text = share("a brick's total", std::max(0.0, static_cast<double>(p.brick_totals[i])),
                                std::max(0.0, static_cast<double>(q.brick_totals[i])));
        !text.empty())
      return text;
  return {};
}

/// At other factors line integrals round to other floats, by 6e-8 of themselves. Integers are left out: their
/// steps are powers of two, so that what rounding takes of epsilon changes with the factor.
inline std::string rough_difference(const BuildResult& one, const BuildResult& scaled) {
  if (one.volume.step > 0 || scaled.volume.step > 0) return {};
  // Rates that are near a tie fall on either side of it, and leave bricks other shares of the tolerance.
  if (one.certificate.rates != scaled.certificate.rates) return {};
  const double a = storage_of(one.volume, false).samples_ratio,
               b = storage_of(scaled.volume, false).samples_ratio;
  if (!(std::abs(a - b) <= 0.05 * a)) return text_of(a) + " samples per base sample, and " + text_of(b);
  const double p = one.certificate.total_buffer / one.certificate.epsilon_abs,
               q = scaled.certificate.total_buffer / scaled.certificate.epsilon_abs;
  // No theorem: a brick at the tolerance may fall on either side of it, and then the next one is the worst.
  // What is certain is compared at powers of two, to the bit; this is to see what goes wrong by orders.
  if (!(std::abs(p - q) <= 0.05 * p)) return "total / epsilon " + text_of(p) + ", and " + text_of(q);
  return {};
}

inline void compare_scales(const Case& c, const Inputs& in, const Outcome& one, const Outcome& scaled,
                           Report& r) {
  if (one.kind == "built" && scaled.kind == "built") {
    r.compared = true;
    if (!one.built->certificate.holds_buffer && !scaled.built->certificate.holds_buffer) return;
    const bool same_data = in.data_exact && c.scale.is_exact();
    const std::string text = same_data ? difference(*one.built, *scaled.built, c.scale.density)
                                       : rough_difference(*one.built, *scaled.built);
    // Where float32 holds the line integrals in part only, it is another scan.
    if (!text.empty() && r.excuse.empty()) r.fail(same_data ? "other build" : "another build", text);
    return;
  }
  if (scaled.kind == "built") return;
  // A file's step is a normal number: integers of smaller densities may be too coarse, and it says so.
  if (scaled.kind == "tolerance" && scaled.message.find("`storage`") != std::string::npos &&
      c.scale.density < 0x1p-90)
    return;
  const bool is_zero = std::all_of(in.scan.data.begin(), in.scan.data.end(), [](float p) { return p == 0; });
  if (!r.excuse.empty()) {
    if (is_zero && scaled.kind == "tolerance") return;  // an absolute one, below what float32 loses
    if (one.kind != "built" && scaled.kind != "other") return;
    const auto names = [&](const char* type) { return scaled.message.find(type) != std::string::npos; };
    if (scaled.kind != "input" || !(names("float32") || names("fp32")))
      r.fail("unclear refusal", r.excuse + ", but: " + scaled.message);
  } else if (one.kind == "built") {
    r.fail("refused", "builds at scale 1, but: " + scaled.message);
  } else if (one.kind != scaled.kind) {
    r.fail("refused", "at scale 1: " + one.message + "; here: " + scaled.message);
  }
}

}  // namespace detail

/// A build that succeeded, held to its certificate.
inline void check_built(Device& device, const Case& c, const Inputs& in, const BuildResult& result,
                        std::uint64_t seed, Report& r) {
  const auto start = detail::Clock::now();
  detail::Random random(seed);
  detail::check_certificate(result, r);
  detail::check_points(c, in, result, random, r);
  detail::check_verify(device, in, result, false, r);
  if (seed % 4 == 0) detail::check_verify(device, in, result, true, r);
  if (seed % 3 == 0) detail::check_file(result, r);
  r.check_seconds += detail::since(start);
}

/// Builds a case at scale 1, at the first of epsilon, 3 epsilon, ... that is within reach and at most `most`
/// (large ones so that coarse rates are tried too), and at its own scale; checks the latter, and compares the
/// two.
inline Report run_case(Device& device, Case c, std::uint64_t seed, double most = 3) {
  Report r;
  Outcome one;
  for (;; c.epsilon *= 3) {
    one = detail::attempt(device, inputs_at(c, Scale{}));
    if (one.kind != "tolerance" || 3 * c.epsilon > most) break;
  }
  r.epsilon = c.epsilon;
  r.excuse = misfit(c, c.scale);
  const Inputs in = inputs_at(c, c.scale);
  if (c.scale.is_one()) {
    r.outcome = std::move(one);
  } else {
    r.outcome = detail::attempt(device, in);
    detail::compare_scales(c, in, one, r.outcome, r);
    r.check_seconds += one.seconds;
  }
  if (r.outcome.kind == "other") r.fail("exception", r.outcome.message);
  if (r.outcome.built) check_built(device, c, in, *r.outcome.built, seed, r);
  return r;
}

}  // namespace vdvr::hostile
