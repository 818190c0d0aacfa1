// Attacks on the bounds of cone beam from seeds: each an orbit, a field at its worst at a target and rates of
// gold (tests/support/cone_attacks.hpp), whose gold, slack, covered region and sups are held to F in double
// precision. CTest runs a short form; scripts/cone-attacks runs thousands in many processes.
//   cone_attacks COUNT [FIRST_SEED] [--json] [--verbose]

#include <chrono>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/support/cone_attacks.hpp"
#include "tests/support/scan_chain.hpp"
#include "tests/support/seed_arguments.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certified_region.hpp"

using namespace vdvr;
using namespace vdvr::attacks;

namespace {

// The worst point of one bound.
struct Worst {
  double ratio = 0, error = 0, bound = 0;
  Vec3 at{0, 0, 0};
  void see(double e, double b, const Vec3& p) {
    // A bound of 0 on an error of 0 holds.
    const double r = e == 0 ? 0.0 : e / b;
    if (!(r <= ratio)) *this = {std::isnan(r) ? double{INFINITY} : r, e, b, p};
  }
};

struct Report {
  std::string outcome = "held", message;
  std::map<std::string, Worst> checks;
  std::int64_t cells = 0, points = 0;
  double lambda = 1;  // the least, on the grid
  double seconds = 0;
  [[nodiscard]] std::vector<std::string> violated() const {
    std::vector<std::string> out;
    for (const auto& [name, worst] : checks)
      if (!(worst.ratio <= 1)) out.push_back(name);
    return out;
  }
};

std::string text_of(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", x);
  return text;
}

std::string text_of(const Vec3& p) {
  return "(" + text_of(p[0]) + ", " + text_of(p[1]) + ", " + text_of(p[2]) + ")";
}

// What a reader needs to know of a case; the seed alone makes it again.
std::string text_of(const ConeCase& c) {
  return text_of(c.half_angle_deg) + " degrees, " + c.orbit + "; " + c.field + "; target: " + c.place + ", " +
         text_of(c.target) + "; gold " + std::to_string(c.rates.gold) + ", differences " +
         std::to_string(c.rates.differences) + ", cells of " + text_of(c.cells) + " pixels";
}

// F at the half lattice of all gold cells, x fastest.
struct HalfLattice {
  HalfLattice(const ScanChain& chain, const GoldNodes& gold) : nodes(gold) {
    for (std::size_t a = 0; a < 3; ++a) count[a] = 2 * gold.nodes[a] - 1;
    for (std::int64_t z = 0; z < count[2]; ++z)
      for (std::int64_t y = 0; y < count[1]; ++y)
        for (std::int64_t x = 0; x < count[0]; ++x) points.push_back(position({x, y, z}));
    F = chain.exact.at(points);
  }
  [[nodiscard]] Vec3 position(const Index3& half) const {
    Vec3 out{};
    for (std::size_t a = 0; a < 3; ++a)
      out[a] = nodes.grid.origin[a] + static_cast<double>(half[a]) / (2 * nodes.rate) * nodes.grid.spacing[a];
    return out;
  }
  [[nodiscard]] std::size_t at(const Index3& half) const {
    return static_cast<std::size_t>((half[2] * count[1] + half[1]) * count[0] + half[0]);
  }
  const GoldNodes& nodes;
  Index3 count{};
  std::vector<Vec3> points;
  std::vector<double> F;
};

// A gold cell: what its corners hold and allow.
struct Cell {
  Cell(const GoldNodes& l, const HalfLattice& half, const Index3& at) : low(at) {
    for (std::size_t i = 0; i < 8; ++i) {
      const Index3 n{at[0] + static_cast<std::int64_t>(i & 1), at[1] + static_cast<std::int64_t>(i >> 1 & 1),
                     at[2] + static_cast<std::int64_t>(i >> 2)};
      const std::size_t corner = l.at(n[0], n[1], n[2]);
      gold[i] = l.gold[corner];
      exact[i] = half.F[half.at({2 * n[0], 2 * n[1], 2 * n[2]})];
      above = std::min(above, l.above[corner]);
      below = std::min(below, l.below[corner]);
    }
  }
  [[nodiscard]] bool tested() const { return above >= 0 && below >= 0; }
  Index3 low;
  std::array<double, 8> gold{}, exact{};
  double above = INFINITY, below = INFINITY;
};

class Attack {
 public:
  Attack(Device& device, const ConeCase& c, std::uint64_t seed)
      : case_(c),
        draw_(~seed),
        chain_(device, c.scan),
        gold_(stream_nodes(chain_, c.grid, c.rates)),
        half_(chain_, gold_),
        region_(certified_coverage(c.scan, {})),
        certified_(c.scan) {
    // What ExactField says of its rounding is of the sums over coefficients; lambda^-2 multiplies them.
    for_tested_nodes([&](std::size_t, std::size_t half) {
      for (const ViewMatrix& m : chain_.exact.views())
        report_.lambda = std::min(report_.lambda, projected(m, half_.points[half])[2]);
    });
    rounding_ = chain_.exact.rounding() / (report_.lambda * report_.lambda);
  }
  Report run() {
    check_nodes();
    Index3 low{};
    for (low[2] = 0; low[2] + 1 < gold_.nodes[2]; ++low[2])
      for (low[1] = 0; low[1] + 1 < gold_.nodes[1]; ++low[1])
        for (low[0] = 0; low[0] + 1 < gold_.nodes[0]; ++low[0]) check_cell(Cell(gold_, half_, low));
    check_inside();
    check_sups();
    // Where moving the detectors left the target outside, nothing is claimed of gold.
    if (report_.cells == 0) report_.outcome = "nothing covered";
    for (auto& [name, worst] : report_.checks)
      if (!(worst.ratio <= 1)) report_.outcome = "violated";
    return report_;
  }

 private:
  Worst& worst(const char* name) { return report_.checks[name]; }

  template <class Look>
  void for_tested_nodes(const Look& look) {
    for (std::int64_t z = 0; z < gold_.nodes[2]; ++z)
      for (std::int64_t y = 0; y < gold_.nodes[1]; ++y)
        for (std::int64_t x = 0; x < gold_.nodes[0]; ++x)
          if (const std::size_t n = gold_.at(x, y, z); gold_.above[n] >= 0)
            look(n, half_.at({2 * x, 2 * y, 2 * z}));
  }

  void check_nodes() {
    const double bound = gold_.projection + gold_.arithmetic + rounding_;
    for_tested_nodes([&](std::size_t n, std::size_t half) {
      worst("P + A at nodes").see(std::abs(gold_.gold[n] - half_.F[half]), bound, half_.points[half]);
    });
  }

  // The interpolant of computed and of exact gold against F.
  void see(const Cell& cell, const Vec3& fraction, const Vec3& point, double truth) {
    ++report_.points;
    const auto one = [&](const char* name, const std::array<double, 8>& corners, double spare) {
      const double difference = truth - trilinear(corners, fraction);
      worst(name).see(std::max(difference, 0.0), cell.above + spare + rounding_, point);
      worst(name).see(std::max(-difference, 0.0), cell.below + spare + rounding_, point);
    };
    one("T + P + A between computed nodes", cell.gold, gold_.arithmetic);
    worst("sup of F").see(std::abs(truth), gold_.sup + rounding_, point);
    // What is left of the slack without P bounds gold's own interpolation.
    one("T between exact nodes", cell.exact, -gold_.projection);
  }

  void check_cell(const Cell& cell) {
    if (is_covered(cell))
      worst("covered cells that are tested").see(cell.tested() ? 0.0 : 1.0, 0.5, corner_of(cell));
    if (!cell.tested()) return;
    ++report_.cells;
    for (std::int64_t i = 0; i < 27; ++i) {
      const Index3 part{i % 3, i / 3 % 3, i / 9};
      if (part[0] != 1 && part[1] != 1 && part[2] != 1) continue;  // a corner
      const Index3 h{2 * cell.low[0] + part[0], 2 * cell.low[1] + part[1], 2 * cell.low[2] + part[2]};
      const std::size_t n = half_.at(h);
      see(cell,
          {0.5 * static_cast<double>(part[0]), 0.5 * static_cast<double>(part[1]),
           0.5 * static_cast<double>(part[2])},
          half_.points[n], half_.F[n]);
    }
  }

  [[nodiscard]] Vec3 corner_of(const Cell& cell) const {
    return gold_.position(cell.low[0], cell.low[1], cell.low[2]);
  }

  // Its point nearest to the middle of the region, and some by chance.
  [[nodiscard]] bool is_covered(const Cell& cell) {
    const Vec3 low = corner_of(cell),
               high = gold_.position(cell.low[0] + 1, cell.low[1] + 1, cell.low[2] + 1);
    const auto [bottom, top] = region_.heights();
    const Vec3 middle{0, 0, 0.5 * (bottom + top)};
    for (int i = 0; i < 4; ++i) {
      Vec3 p{};
      for (std::size_t a = 0; a < 3; ++a)
        p[a] = i == 0 ? std::clamp(middle[a], low[a], high[a]) : draw_.between(low[a], high[a]);
      if (!certified_.contains(p)) continue;
      // All views see what is certified: by planes of the definition, which the region is not made from.
      worst("certified points that are seen").see(chain_.exact.covered(p) ? 0.0 : 1.0, 0.5, p);
      return true;
    }
    return false;
  }

  void check_inside() {
    std::vector<Cell> cells;
    std::vector<Vec3> fractions, points;
    constexpr int tries = 400;
    for (int i = 0; i < tries; ++i) {
      Index3 low{};
      for (std::size_t a = 0; a < 3; ++a)
        low[a] = static_cast<std::int64_t>(draw_.below(static_cast<std::size_t>(gold_.nodes[a] - 1)));
      const Cell cell(gold_, half_, low);
      if (!cell.tested()) continue;
      cells.push_back(cell);
      fractions.push_back({draw_.between(0, 1), draw_.between(0, 1), draw_.between(0, 1)});
      Vec3 p = corner_of(cell);
      for (std::size_t a = 0; a < 3; ++a) p[a] += fractions.back()[a] * gold_.grid.spacing[a] / gold_.rate;
      points.push_back(p);
    }
    const auto truth = chain_.exact.at(points);
    for (std::size_t i = 0; i < points.size(); ++i) see(cells[i], fractions[i], points[i], truth[i]);
  }

  // The series of view k, or its second derivative along u or v, at a place of the detector; by pixels.
  [[nodiscard]] double series(std::size_t k, double u, double v, int order_u, int order_v) const {
    const ParallelGeometry& g = chain_.exact.geometry();
    const auto columns = static_cast<std::size_t>(g.columns), rows = static_cast<std::size_t>(g.rows);
    double sum = 0;
    for (std::size_t m = 0; m < columns; ++m) {
      const auto row = chain_.exact.coefficients().subspan((k * columns + m) * rows, rows);
      const double omega = reference::frequency(m, columns);
      sum += reference::cosine_series({row.begin(), row.end()}, v, order_v) * std::pow(omega, order_u) *
             std::cos(omega * (u + 0.5)) * (order_u == 2 ? -1.0 : 1.0);
    }
    return sum;
  }

  // Of some views, where they see the target, on the dense lattice's cells around it, and by chance.
  void check_sups() {
    const ParallelGeometry& g = chain_.exact.geometry();
    const auto views = chain_.exact.views().size();
    for (int i = 0; i < 3; ++i) {
      const std::size_t k = draw_.below(views);
      const Vec3 seen = projected(chain_.exact.views()[k], case_.target);
      const DetectorSups& sups = chain_.sups.by_view[k];
      for (int j = 0; j < 40; ++j) {
        const double u = j == 0   ? seen[0]
                         : j < 10 ? seen[0] + draw_.between(-0.5, 0.5)
                                  : draw_.between(-0.5, static_cast<double>(g.columns) - 0.5),
                     v = j == 0   ? seen[1]
                         : j < 10 ? seen[1] + draw_.between(-0.5, 0.5)
                                  : draw_.between(-0.5, static_cast<double>(g.rows) - 0.5);
        const Vec3 place{u, v, static_cast<double>(k)};
        const double own = chain_.exact.rounding();
        worst("sup of values").see(std::abs(series(k, u, v, 0, 0)), sups.value + own, place);
        constexpr double square = std::numbers::pi * std::numbers::pi;
        worst("sup of second derivatives, u")
            .see(std::abs(series(k, u, v, 2, 0)), sups.second_u + square * own, place);
        worst("sup of second derivatives, v")
            .see(std::abs(series(k, u, v, 0, 2)), sups.second_v + square * own, place);
      }
    }
  }

  const ConeCase& case_;
  Draw draw_;
  ScanChain chain_;
  GoldNodes gold_;
  HalfLattice half_;
  Coverage region_;
  CertifiedRegion certified_;
  double rounding_ = 0;
  Report report_;
};

// A case and what came of it. What the library refuses is no violation, but is counted.
Report attack(Device& device, std::uint64_t seed, std::string& text, double& half_angle, bool verbose) {
  const auto start = std::chrono::steady_clock::now();
  Report report;
  try {
    const ConeCase c = draw_cone_case(seed);
    text = text_of(c);
    half_angle = c.half_angle_deg;
    if (verbose) std::fprintf(stderr, "seed %llu: %s\n", static_cast<unsigned long long>(seed), text.c_str());
    report = Attack(device, c, seed).run();
  } catch (const InputError& error) {
    report.outcome = "refused";
    report.message = error.what();
  }
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return report;
}

std::string text_of(const std::string& check, const Worst& w) {
  return check + ": error " + text_of(w.error) + ", bound " + text_of(w.bound) + " (" + text_of(w.ratio) +
         ") at " + text_of(w.at);
}

nlohmann::ordered_json json_of(std::uint64_t seed, double half_angle, const std::string& text,
                               const Report& r) {
  nlohmann::ordered_json failures = nlohmann::ordered_json::array(), checks;
  for (const auto& [name, w] : r.checks) checks[name] = w.ratio;
  for (const std::string& name : r.violated())
    failures.push_back({{"kind", name}, {"text", text_of(name, r.checks.at(name))}});
  return {{"seed", seed},       {"outcome", r.outcome}, {"message", r.message}, {"half_angle", half_angle},
          {"lambda", r.lambda}, {"cells", r.cells},     {"points", r.points},   {"seconds", r.seconds},
          {"checks", checks},   {"failures", failures}, {"case", text}};
}

// For one process: the script makes the tables of many.
struct Table {
  std::map<std::string, int> outcomes;
  std::map<std::string, std::map<double, std::pair<double, std::uint64_t>>> closest;  // by half angle

  void add(std::uint64_t seed, double half_angle, const Report& r) {
    ++outcomes[r.outcome];
    for (const auto& [name, w] : r.checks)
      if (auto& known = closest[name][half_angle]; w.ratio >= known.first) known = {w.ratio, seed};
  }
  void print() const {
    for (const auto& [kind, count] : outcomes) std::printf("%s: %d\n", kind.c_str(), count);
    std::printf("largest error / bound by half angle (seed):\n");
    for (const auto& [name, by_angle] : closest) {
      std::printf("  %s:", name.c_str());
      for (const auto& [angle, at] : by_angle)
        std::printf("  %g: %.3f (%llu)", angle, at.first, static_cast<unsigned long long>(at.second));
      std::printf("\n");
    }
  }
};

}  // namespace

int main(int argc, char** argv) {
  const auto arguments = support::seed_arguments(argc, argv, "cone_attacks");
  if (!arguments) return 2;
  const auto [first, end, json, verbose, cone] = *arguments;

  Device device;
  Table table;
  for (std::uint64_t seed = first; seed < end; ++seed) {
    std::string text;
    double half_angle = 0;
    const Report r = attack(device, seed, text, half_angle, verbose);
    table.add(seed, half_angle, r);
    if (json) {
      std::printf("%s\n", json_of(seed, half_angle, text, r).dump().c_str());
    } else {
      for (const std::string& name : r.violated())
        std::printf("seed %llu: %s; %s\n", static_cast<unsigned long long>(seed),
                    text_of(name, r.checks.at(name)).c_str(), text.c_str());
    }
    if (verbose)
      std::fprintf(stderr, "  %s %s, least lambda %.3f, %.2f s\n", r.outcome.c_str(), r.message.c_str(),
                   r.lambda, r.seconds);
    std::fflush(stdout);  // a later crash must not take it along
  }
  if (!json) table.print();
  return table.outcomes["violated"] == 0 ? 0 : 1;
}
