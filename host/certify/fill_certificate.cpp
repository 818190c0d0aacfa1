#include "host/certify/fill_certificate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "host/base/system/casts.hpp"
#include "host/certify/gold/worst_node.hpp"
#include "host/volume/bricks.hpp"
#include "host/volume/covered_range.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/certified_region.hpp"
#include "vdvr/expert/trust.hpp"

namespace vdvr {
namespace {

// Of devices that differ, each by its name.
void name_kinds(const Crew& crew, Certificate& c) {
  const auto& kinds = crew.kinds();
  for (std::size_t i = 1; i < kinds.size(); ++i) {
    c.device += " + " + kinds[i].info.name;
    c.driver += " + " + kinds[i].info.driver;
  }
}

// The node at which the largest measure lies, on the gold that decided its brick. A brick's border can be
// tested for its neighbours' sake alone, which computed by itself it does not show: then the brick's first
// node.
Vec3 position_of(const Inputs& in, const MixedVolume& volume, const BrickMeasure& worst) {
  std::vector<std::uint8_t> one(in.selected.size(), 0);
  one[at(worst.brick)] = 1;
  std::optional<Vec3> where;
  in.rates.of(worst.rate)
      .run(
          one, [&](GoldStream::Batch& batch) { where = worst_node(batch, volume, worst.brick, worst.rate); },
          {}, "worst");
  if (where) return *where;
  const Bricks bricks(volume.grid, volume.granularity);
  return volume.grid.position(bricks.first_cell(bricks.position(worst.brick)));
}

}  // namespace

Certificate fill_certificate(const Inputs& in, Device& device, const ProjectionSet& scan,
                             const FilteredScan& filtered, const BuildOptions& options,
                             const Measured& measured, const SamplerTerms& sampler, double epsilon_abs) {
  const Plan& plan = in.plan;
  Certificate c;
  c.epsilon =
      epsilon_abs == plan.epsilon_abs ? plan.epsilon : plan.epsilon * (epsilon_abs / plan.epsilon_abs);
  c.epsilon_abs = epsilon_abs;
  c.reference_range = plan.reference_range;
  c.range_at = plan.range_at;
  const BrickMeasure* worst = nullptr;
  c.brick_totals.reserve(measured.bricks.size());
  for (const BrickMeasure& m : measured.bricks) {
    // Two sums in fp32, and this product.
    c.brick_totals.push_back(m.total < 0 ? -1.0f : m.total * (1 + 0x1p-21f));
    if (m.total < 0) continue;
    // Finer gold lowers a total where nodes of the coarser lie beyond what is covered: those do not count.
    c.measured_max = std::max(c.measured_max, static_cast<double>(std::min(m.error, m.total)));
    if (!worst || m.total > worst->total) worst = &m;
  }
  if (worst) {
    c.measured_total = static_cast<double>(worst->total) * (1 + 0x1p-22);  // two sums in fp32
    c.worst_at = position_of(in, measured.volume, *worst);
  }
  c.budget.grid = {c.measured_max, "measured at every tested gold node on the stored field"};
  c.budget.gold = {measured.slack.gold, "curvature: signed second differences of gold, with remainder"};
  c.budget.projection = {measured.slack.projection,
                         scan.cone ? "sups of |q|: eight taps in u and v, 20 to 28 taps from kept gold"
                         : plan.rates.interpolation == Interpolation::six_taps
                             ? "sups of |q|: six taps in u, 16 taps from kept gold"
                             : "sups of |q_uu| and of |q|: interpolation in u, 16 taps from kept gold"};
  c.budget.arithmetic = {in.arithmetic, "rounding in fp32 from the ramp filter to back-projection"};
  charge_samplers(c, sampler);
  c.comparison = plan.settings.comparison.is_never_certified();
  // Of a volume without a tested node nothing is certified.
  const bool certified = !c.comparison && worst;
  c.holds_buffer = certified && c.total_buffer <= c.epsilon_abs;
  if (c.total_image3d) c.holds_image3d = certified && *c.total_image3d <= c.epsilon_abs;
  c.rates = plan.rates;
  c.bounds = plan.bounds;
  c.field = plan.field;
  c.field.center = stated_center(plan.field, scan.geometry);
  c.field.preparation = scan.report.preparation;
  c.padding = filtered.fft_length;
  c.window = options.window;
  c.roi = options.roi;
  if (const CoveredCylinder covered = CertifiedRegion(scan, plan.field).cylinder();
      covered.radius > 0 && covered.z.first < covered.z.second)
    c.covered = covered;
  c.not_covered_count = plan.not_covered_count;
  c.not_covered_fraction = plan.not_covered_fraction;
  c.not_covered_rule = kNotCoveredRule;
  c.input_name = scan.report.name;
  c.input_sha256 = scan.report.sha256;
  c.input_shape = {scan.geometry.views(), scan.geometry.rows, own_detector(scan.geometry).columns};
  c.input_angles = scan.geometry.views();
  c.device = device.info().name;
  c.driver = device.info().driver;
  if (in.crew) name_kinds(*in.crew, c);
  c.version = VDVR_VERSION;
  c.notes = plan.notes;
  c.notes.push_back("the device was tested when it was opened, and passed: " + test_of(device).names());
  for (const std::string& note : scan.report.notes)
    if (std::find(c.notes.begin(), c.notes.end(), note) == c.notes.end()) c.notes.push_back(note);
  if (c.comparison)
    c.notes.push_back(fmt::format("built for comparison with {}: nothing is certified",
                                  plan.settings.comparison.terms == Terms::grid
                                      ? "terms grid, which test |V - gold| alone"
                                      : "closing none, whose field is not continuous"));
  c.notes.push_back(
      "covers interpolation, not physics: noise, too few views, the filter window and truncation shape F "
      "itself");
  if (measured.repaired > 0)
    c.notes.push_back(fmt::format("closing raised {} bricks by one level", measured.repaired));
  return c;
}

}  // namespace vdvr
