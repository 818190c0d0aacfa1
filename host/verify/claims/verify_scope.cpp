// What a certificate says that scan and file decide alone.
#include "host/verify/claims/verify_scope.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/base/system/casts.hpp"
#include "host/field/fdk/filter_cone.hpp"
#include "host/volume/covered_range.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/region_of_interest.hpp"

namespace vdvr {
namespace {

// A value is written with all its digits, and computed again by at most a few roundings more.
bool same(double a, double b) {
  return a == b || std::abs(a - b) <= 0x1p-48 * std::max(std::abs(a), std::abs(b));
}

class Compare {
 public:
  Differences found;
  void differs(std::string line) { found.push_back(std::move(line)); }
  template <class Stored, class Wanted>
  void equal(const char* member, const Stored& stored, const Wanted& wanted, bool is_equal) {
    if (!is_equal) differs(fmt::format("{} is {}, not {}", member, stored, wanted));
  }
  void number(const char* member, double stored, double wanted) {
    equal(member, stored, wanted, same(stored, wanted));
  }
  void integer(const char* member, std::int64_t stored, std::int64_t wanted) {
    equal(member, stored, wanted, stored == wanted);
  }
  void text(const char* member, const std::string& stored, const std::string& wanted) {
    equal(member, "'" + stored + "'", "'" + wanted + "'", stored == wanted);
  }
};

void compare_views(Compare& out, const nlohmann::json& g, const std::optional<ConeGeometry>& cone) {
  if (g.contains("cone") != cone.has_value())
    return out.differs(fmt::format("options.geometry is of {} beam, not of {} beam",
                                   cone ? "parallel" : "cone", cone ? "cone" : "parallel"));
  if (!cone) return;
  out.text("options.geometry.cone.redundancy", g.at("cone").at("redundancy").get<std::string>(),
           text_of(cone->redundancy));
  const auto numbers = g.at("cone").at("matrices").get<std::vector<double>>();
  out.integer("the number of matrices of options.geometry.cone", static_cast<std::int64_t>(numbers.size()),
              static_cast<std::int64_t>(12 * cone->views.size()));
  for (std::size_t i = 0; i < std::min(numbers.size(), 12 * cone->views.size()); ++i) {
    const std::array<double, 4>& row = cone->views[i / 12][i % 12 / 4];
    const double wanted = row[i % 4];
    // Products that cancel round like the largest of their row; the last column holds pixels.
    const double magnitude =
        i % 4 < 3 ? std::max({std::abs(row[0]), std::abs(row[1]), std::abs(row[2])}) : 1 + std::abs(row[3]);
    if (std::abs(numbers[i] - wanted) <= 0x1p-44 * magnitude) continue;
    return out.differs(
        fmt::format("options.geometry.cone.matrices[{}] (view {}, row {}, column {}) is {}, not {}", i,
                    i / 12, i % 12 / 4, i % 4, numbers[i], wanted));
  }
}

void compare_extension(Compare& out, const nlohmann::json& g, const RowExtension& used) {
  const bool longer = used.before > 0 || used.after > 0;
  if (g.contains("extension") != longer)
    return out.differs(
        fmt::format("options.geometry.extension is {}", longer ? "missing" : "not of these rows"));
  if (!longer) return;
  const auto& e = g.at("extension");
  out.integer("options.geometry.extension.half_acquisition", e.at("half_acquisition").get<bool>() ? 1 : 0,
              used.half_acquisition.value_or(false) ? 1 : 0);
  out.text("options.geometry.extension.pad", e.at("pad").get<std::string>(), text_of(used.padding));
  out.integer("options.geometry.extension.before", e.at("before").get<std::int64_t>(), used.before);
  out.integer("options.geometry.extension.after", e.at("after").get<std::int64_t>(), used.after);
  out.number("options.geometry.extension.center", e.at("center").get<double>(), used.center);
}

void compare_shifts(Compare& out, const nlohmann::json& g, const char* name,
                    const std::vector<double>& used) {
  const auto noted = g.contains(name) ? g.at(name).get<std::vector<double>>() : std::vector<double>{};
  const std::string member = std::string("options.geometry.") + name;
  out.integer(("the number of shifts of " + member).c_str(), std::ssize(noted), std::ssize(used));
  // Along a leaning axis they are sums that cancel, and round like the largest.
  double largest = 0;
  for (const double shift : used) largest = std::max(largest, std::abs(shift));
  for (std::size_t k = 0; k < std::min(noted.size(), used.size()); ++k)
    if (!(std::abs(noted[k] - used[k]) <= 0x1p-48 * largest))
      return out.differs(fmt::format("{}[{}] is {}, not {}", member, k, noted[k], used[k]));
}

void compare_series(Compare& out, const nlohmann::json& g, const HeightSeries& used) {
  if (g.contains("series") == used.none())
    return out.differs(
        fmt::format("options.geometry.series is {}", used.none() ? "not of these rows" : "missing"));
  if (used.none()) return;
  const auto& s = g.at("series");
  out.integer("options.geometry.series.rows", s.at("rows").get<std::int64_t>(), used.rows);
  out.integer("options.geometry.series.first", s.at("first").get<std::int64_t>(), used.first);
  out.integer("options.geometry.series.full_turn", s.at("full_turn").get<bool>() ? 1 : 0,
              used.full_turn ? 1 : 0);
  compare_shifts(out, s, "theta_rad", used.theta_rad);
  compare_shifts(out, s, "row_shift", used.row_shift);
  compare_shifts(out, s, "column_shift", used.column_shift);
}

void compare_geometry(Compare& out, const nlohmann::json& g, const ParallelGeometry& used) {
  out.integer("options.geometry.columns", g.at("columns").get<std::int64_t>(), used.columns);
  out.integer("options.geometry.rows", g.at("rows").get<std::int64_t>(), used.rows);
  out.number("options.geometry.pitch_u", g.at("pitch_u").get<double>(), used.pitch_u);
  out.number("options.geometry.pitch_v", g.at("pitch_v").get<double>(), used.pitch_v);
  out.number("options.geometry.center", g.at("center").get<double>(), used.center);
  compare_extension(out, g, used.extension);
  compare_shifts(out, g, "column_shift", used.column_shift);
  compare_shifts(out, g, "row_shift", used.row_shift);
  compare_series(out, g, used.series);
  out.number("options.geometry.axis_roll", g.value("axis_roll", 0.0), used.axis_roll_deg);
  out.integer("options.geometry.columns_cut", g.value("columns_cut", std::int64_t{0}), used.extension.cut);
  out.text("options.geometry.unit", g.at("unit").get<std::string>(), used.unit);
  const auto theta = g.at("theta_rad").get<std::vector<double>>();
  out.integer("the number of angles of options.geometry", static_cast<std::int64_t>(theta.size()),
              used.views());
  for (std::size_t k = 0; k < std::min(theta.size(), used.theta_rad.size()); ++k)
    if (!same(theta[k], used.theta_rad[k])) {
      out.differs(
          fmt::format("options.geometry.theta_rad[{}] is {}, not {}", k, theta[k], used.theta_rad[k]));
      break;
    }
}

// A program over the library may note no options at all; what is noted must be so.
void compare_options(Compare& out, const Certificate& c, const MixedVolume& v, const ParallelGeometry& used,
                     const std::optional<ConeGeometry>& cone) {
  const auto options = nlohmann::json::parse(c.options_json, nullptr, false);
  if (!options.is_object()) return out.differs("options are not a JSON object");
  const auto integer = [&](const char* name, const char* member, std::int64_t wanted) {
    if (options.contains(name)) out.integer(member, options.at(name).get<std::int64_t>(), wanted);
  };
  const auto text = [&](const char* name, const char* member, const std::string& wanted) {
    if (options.contains(name)) out.text(member, options.at(name).get<std::string>(), wanted);
  };
  try {
    integer("granularity", "options.granularity", v.granularity);
    integer("upsampling", "options.upsampling", c.rates.upsampling);
    integer("gold", "options.gold", c.rates.gold);
    text("u_filter", "options.u_filter", text_of(c.rates.interpolation));
    text("terms", "options.terms", "all");
    if (options.contains("closing") && options.at("closing") == "none")
      out.differs("options.closing is none, of which nothing is certified");
    if (options.contains("base")) {
      const std::vector<std::int64_t> wanted{1 << v.coarsening[2], 1 << v.coarsening[1],
                                             1 << v.coarsening[0]};
      const auto base = options.at("base").get<std::vector<std::int64_t>>();
      out.equal("options.base", base, wanted, base == wanted);
    }
    if (options.contains("geometry")) {
      compare_geometry(out, options.at("geometry"), used);
      compare_views(out, options.at("geometry"), cone);
    }
  } catch (const nlohmann::json::exception& e) {
    out.differs(fmt::format("options: {}", e.what()));
  }
}

void compare_input(Compare& out, const ProjectionSet& scan, const Certificate& c) {
  const std::vector<std::int64_t> shape{scan.geometry.views(), scan.geometry.rows,
                                        own_detector(scan.geometry).columns};
  out.equal("input.shape", c.input_shape, shape, c.input_shape == shape);
  out.integer("input.angles", c.input_angles, scan.geometry.views());
}

void compare_rates(Compare& out, const MixedVolume& v, const Certificate& c) {
  out.integer("rates.gold", c.rates.gold, v.rate);
  if (c.rates.interpolation == Interpolation::eight_taps) {
    out.integer("rates.upsampling_u", c.rates.upsampling, 6);
    return;
  }
  if (c.rates.upsampling < 2 || c.rates.upsampling > 64 ||
      !std::has_single_bit(static_cast<unsigned>(c.rates.upsampling)))
    out.differs(fmt::format("rates.upsampling_u is {}, not a power of two from 2 to 64", c.rates.upsampling));
}

void compare_coverage(Compare& out, const ProjectionSet& scan, const MixedVolume& v, const Certificate& c) {
  const Coverage coverage = certified_coverage(scan, c.field);
  if (c.covered) {  // a part of the region would do, but is not what was written
    out.number("covered.radius", c.covered->radius, coverage.inner_radius());
    out.number("covered.z[0]", c.covered->z.first, coverage.heights().first);
    out.number("covered.z[1]", c.covered->z.second, coverage.heights().second);
  }
  const std::int64_t count = count_not_covered(v.grid, coverage);
  out.integer("not_covered.count", c.not_covered_count, count);
  out.number("not_covered.fraction", c.not_covered_fraction,
             static_cast<double>(count) / static_cast<double>(v.grid.sample_count()));
  out.text("not_covered.rule", c.not_covered_rule, kNotCoveredRule);
}

void compare_region(Compare& out, const MixedVolume& v, const Certificate& c) {
  if (c.window && !(c.window->first <= c.window->second))
    out.differs(fmt::format("window is [{}, {}]", c.window->first, c.window->second));
  if (!c.roi) return;
  const std::vector<std::uint8_t> inside = bricks_of(c.roi, v.grid, v.granularity);
  for (std::size_t i = 0; i < std::min(inside.size(), c.brick_totals.size()); ++i)
    if (!inside[i] && c.brick_totals[i] >= 0)
      return out.differs(fmt::format("roi does not meet brick {}, which has a total", i));
  if (std::find(inside.begin(), inside.end(), 1) == inside.end())
    out.differs("roi meets no brick of the grid");
}

// The node of the largest total lies in every brick whose closed box holds it.
void compare_worst(Compare& out, const MixedVolume& v, const Certificate& c, float largest) {
  const Index3 n = v.bricks();
  Index3 low{}, high{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double cell = (c.worst_at[a] - v.grid.origin[a]) / v.grid.spacing[a];
    // Nodes are 1/64 of a cell apart at the least.
    if (!(cell >= -0x1p-10 && cell <= static_cast<double>(v.grid.cells[a]) + 0x1p-10))
      return out.differs(fmt::format("worst_at is ({}), outside the grid", fmt::join(c.worst_at, ", ")));
    // Gold of the plan's rate, or of the finer one that decides what it leaves.
    const double node = 2 * cell * v.rate;
    if (!(std::abs(node - std::round(node)) <= 0x1p-10))
      return out.differs(fmt::format("worst_at is ({}), at no gold node", fmt::join(c.worst_at, ", ")));
    const auto brick = [&](double at_cell) {
      return std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(at_cell / v.granularity)), 0,
                                      n[a] - 1);
    };
    low[a] = brick(cell - 0x1p-10);
    high[a] = brick(cell + 0x1p-10);
  }
  for (std::int64_t z = low[2]; z <= high[2]; ++z)
    for (std::int64_t y = low[1]; y <= high[1]; ++y)
      for (std::int64_t x = low[0]; x <= high[0]; ++x)
        if (c.brick_totals[at((z * n[1] + y) * n[0] + x)] >= largest) return;
  out.differs(fmt::format("worst_at is ({}), in no brick of the largest total", fmt::join(c.worst_at, ", ")));
}

void compare_totals(Compare& out, const MixedVolume& v, const Certificate& c) {
  if (!(c.measured_max <= c.measured_total))
    out.differs(fmt::format("measured_max {} is above measured_total {}", c.measured_max, c.measured_total));
  out.number("budget.grid", c.budget.grid.value, c.measured_max);
  for (const ErrorTerm* term : {&c.budget.grid, &c.budget.gold, &c.budget.projection, &c.budget.arithmetic})
    if (!(term->value >= 0)) out.differs(fmt::format("a term of the budget is {}", term->value));
  const bool image = c.total_image3d.has_value();
  if (c.holds_image3d.has_value() != image || c.budget.sampler.image3d.has_value() != image)
    out.differs("holds, total and budget do not agree on whether there is an image3d sampler");
  if (c.brick_totals.empty()) {
    // Files of earlier programs may lack them.
    if (c.sealed) out.differs("the totals by brick, /brick_total, are missing");
    return;
  }
  if (c.brick_totals.size() != v.level.size())
    return out.differs(fmt::format("{} totals for {} bricks", c.brick_totals.size(), v.level.size()));
  const float largest = *std::max_element(c.brick_totals.begin(), c.brick_totals.end());
  if (largest < 0) return out.differs("no brick has a total");
  // build rounds both up, by 2^-22 and by 2^-21.
  if (!(std::abs(static_cast<double>(largest) - c.measured_total) <= 0x1p-20 * c.measured_total))
    out.differs(
        fmt::format("measured_total is {}, not the largest total of a brick {}", c.measured_total, largest));
  compare_worst(out, v, c, largest);
}

}  // namespace

Differences compare_scope(const ProjectionSet& scan, const ParallelGeometry& used, const MixedVolume& volume,
                          const Certificate& stored) {
  Compare out;
  if (std::string what = contradiction(stored); !what.empty()) out.differs(std::move(what));
  compare_input(out, scan, stored);
  compare_options(out, stored, volume, used, scan.cone);
  compare_rates(out, volume, stored);
  compare_coverage(out, scan, volume, stored);
  compare_region(out, volume, stored);
  compare_totals(out, volume, stored);
  return std::move(out.found);
}

Differences compare_samplers(const SamplerTerms& found, const SamplerTerms& least, bool same_device,
                             const Certificate& stored) {
  Compare out;
  const SamplerTerms& c = stored.budget.sampler;
  // Made of fp32 differences of samples, which round below the normal numbers.
  const auto number = [&](const char* member, double value, double wanted) {
    if (!(std::abs(value - wanted) <= 0x1p-149)) out.number(member, value, wanted);
  };
  number("the sampler term of buffer", c.buffer.value, found.buffer.value);
  if (!c.image3d) return std::move(out.found);
  if (least.image3d && !(c.image3d->value >= least.image3d->value * (1 - 0x1p-40)))
    out.differs(fmt::format(
        "the sampler term of image3d is {}, below {}, which is that of a texture unit without error",
        c.image3d->value, least.image3d->value));
  // Earlier versions charged all bricks with the worst one's, which is more.
  if (same_device && found.image3d && !(c.image3d->value >= found.image3d->value))
    number("the sampler term of image3d", c.image3d->value, found.image3d->value);
  return std::move(out.found);
}

}  // namespace vdvr
