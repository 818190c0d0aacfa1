// Measures a stored certificate again (docs/error-bounds.md, "What verify does"). Shares with build only the
// sampler header and what describes the scan: view weights, ramp kernel, covered region.
#include "vdvr/expert/verify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "host/base/opencl/host_memory.hpp"
#include "host/base/system/casts.hpp"
#include "host/scan/units.hpp"
#include "host/verify/claims/verify_scope.hpp"
#include "host/verify/claims/verify_terms.hpp"
#include "host/verify/bricks_to_verify.hpp"
#include "host/verify/seams.hpp"
#include "host/verify/verify_attack.hpp"
#include "host/verify/verify_field.hpp"
#include "host/verify/verify_points.hpp"
#include "host/verify/worst_sample.hpp"
#include "host/volume/sampler/sampler_terms.hpp"
#include "vdvr/expert/certified_region.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/reconstruct.hpp"
#include "vdvr/expert/trust.hpp"

namespace vdvr {
namespace {

std::string place_text(const SamplePlace& p) {
  const std::string where = p.dataset == "/base" ? p.dataset : fmt::format("{} tile {}", p.dataset, p.tile);
  return fmt::format(
      "at ({:.6g}, {:.6g}, {:.6g}), where V is {:.6g} and F {:.6g}: brick {} of level ({}, {}, {}), {} "
      "sample ({}, {}, {}) (z, y, x)",
      p.world[0], p.world[1], p.world[2], p.value, p.field, p.brick, p.level[0], p.level[1], p.level[2],
      where, p.sample[2], p.sample[1], p.sample[0]);
}

bool is_builder(const Device& device, const Certificate& stored) {
  return device.info().name == stored.device && device.info().driver == stored.driver;
}

// What is promised of a texture unit is promised of the one on which the file was built: only there can it be
// wrong. Elsewhere pictures take the buffer where it does not hold (safe_sampler.hpp).
bool promises_image3d(const Device& device, const Certificate& stored) {
  return stored.holds_image3d.value_or(false) && is_builder(device, stored);
}

// Which samplers must hold: those that this device has and that are promised of it. `here`: the certificate
// with what samplers take on this device. Bounds of bricks were measured against what the file says of each:
// their promise in sigma is of those.
void judge(const Device& device, const Certificate& stored, const Certificate& here, VerifyResult& r) {
  r.total_buffer = r.measured_total + here.budget.sampler.buffer.value;
  r.total = r.total_buffer;
  if (stored.holds_buffer) r.holds_buffer = within_tolerance(here, r.total_buffer, false);
  r.image3d_promised = promises_image3d(device, stored);
  if (stored.holds_image3d.value_or(false) && r.total_image3d)
    r.holds_image3d = within_tolerance(here, *r.total_image3d, true);
  if (r.image3d_promised && r.total_image3d) r.total = std::max(r.total, *r.total_image3d);
  if (!r.holds_buffer && !(r.image3d_promised && r.holds_image3d))
    r.failure = "the certificate holds for no sampler of this device";
  else r.holds = r.holds_buffer.value_or(true) && (!r.image3d_promised || r.holds_image3d.value_or(true));
}

// The finest gold on which bricks are tested again: its T is a thousandth of that at 2x. Cell coordinates of
// its nodes are exact in fp32.
int finest_rate(const MixedVolume& v) {
  constexpr int wanted = 64;
  const std::int64_t cells = *std::max_element(v.grid.cells.begin(), v.grid.cells.end());
  int rate = v.rate;
  while (2 * rate <= std::max(wanted, 2 * v.rate) && cells * 2 * rate <= (1 << 24)) rate *= 2;
  return rate;
}

// Up to where |V - F| is to be bounded in each brick: what samplers leave of epsilon, and what the
// certificate says.
struct Limits {
  std::vector<double> promised;
  double stated = 0;
};

// What is known of bricks from all rates of gold at which they were tested: every rate bounds |V - F|, and a
// finer one by less (docs/error-bounds.md, "What verify does").
class TestedBricks {
 public:
  struct Brick {
    double total = -1;   // the smallest bound of all rates; negative: not tested
    double error = 0;    // the largest |V - F| at a node of any rate
    double least = 0;    // what |V - F| is at least: that, less what F was computed with
    double finer = 0;    // the same at rates beyond the volume's own
    Index3 cell{};       // where the bound is attained
    int rate = 0;        // and at which rate
    int tried = 0;       // the finest rate at which it was tested
    bool again = false;  // whether one rate did not decide
  };
  TestedBricks(VerifyField& field, const MixedVolume& volume, TotalAttack& attack, Limits limits,
               const Progress& progress)
      : field_(field),
        volume_(volume),
        attack_(attack),
        limits_(std::move(limits)),
        progress_(progress),
        bricks_(volume.level.size()),
        now_(volume.level.size()) {}

  /// Tests bricks at the first rate at which they can be, and those that it leaves undecided, or that are
  /// looked at there too (`looked_at` is 2), on finer gold.
  void sweep(const std::vector<std::uint8_t>& selected, const std::vector<std::uint8_t>& looked_at,
             VerifyResult& result) {
    const std::vector<Step> steps = steps_of_sweep();
    const int own = std::min(volume_.rate, field_.across()), last = steps.back().rates.back();
    const auto wants = [&](std::size_t i, int rate) {
      take(i);
      const Brick& b = bricks_[i];
      if (b.tried == 0) return rate >= field_.least_rate(i) || rate == last;
      return undecided(i) || (looked_at[i] > 1 && b.rate == b.tried && b.total >= 0 && 2 * b.tried == rate &&
                              rate <= 2 * std::max(own, field_.least_rate(i)));
    };
    int before = 0;
    // Nodes are made for all that a run is given.
    const auto wanted = [&](const std::vector<int>& rates) {
      std::vector<std::uint8_t> rest(selected.size());
      for (std::size_t i = 0; i < rest.size(); ++i)
        rest[i] = selected[i] && (bricks_[i].tried > 0 || field_.least_rate(i) > before) &&
                  std::any_of(rates.begin(), rates.end(), [&](int rate) { return wants(i, rate); });
      return rest;
    };
    for (const Step& step : steps) {
      if (!step.by_sparse.empty() && step.rates.back() <= before) continue;
      const bool sparse = serves(step, wanted(step.by_sparse));
      const std::vector<int>& rates = sparse ? step.by_sparse : step.rates;
      const std::vector<std::uint8_t> rest = wanted(rates);
      if (std::find(rest.begin(), rest.end(), 1) != rest.end())
        run(rest, rates, wants, result, sparse ? VerifyField::Made::sparse : VerifyField::Made::dense);
      before = rates.back();
    }
  }

  /// Tests bricks again on finer gold, the worst first, until none may err by more than the limits. Ends
  /// early where one does so at a node, or still may at the finest rate.
  void settle(VerifyResult& result) {
    const int finest = finest_rate(volume_);
    for (const bool promised : {true, false})
      for (std::size_t most = 8;; most *= 2) {
        const auto limit = [&](std::size_t i) { return promised ? limits_.promised[i] : limits_.stated; };
        std::vector<std::size_t> over;
        for (std::size_t i = 0; i < bricks_.size(); ++i)
          if (bricks_[i].total > limit(i)) over.push_back(i);
        const bool hopeless = std::any_of(over.begin(), over.end(), [&](std::size_t i) {
          return !(bricks_[i].least <= limit(i)) || bricks_[i].tried >= finest;
        });
        if (over.empty() || hopeless) break;
        most = std::min(most, over.size());
        std::partial_sort(over.begin(), over.begin() + static_cast<std::ptrdiff_t>(most), over.end(),
                          [&](std::size_t a, std::size_t b) { return bricks_[a].total > bricks_[b].total; });
        over.resize(most);
        int rate = finest;
        for (const std::size_t i : over) rate = std::min(rate, 2 * bricks_[i].tried);
        std::vector<std::uint8_t> selected(bricks_.size(), 0);
        for (const std::size_t i : over) selected[i] = bricks_[i].tried < rate;
        run(
            selected, {rate}, [](std::size_t, int) { return true; }, result);
      }
  }

  [[nodiscard]] const std::vector<Brick>& bricks() const { return bricks_; }

 private:
  // Rates whose gold is made of the same nodes. Where sparse nodes serve, they do for `by_sparse`.
  struct Step {
    std::vector<int> rates, by_sparse;
    double worth = 1;  // how many times the dense nodes of this step they may be
  };

  // Gold coarser than the nodes that determine F is its own, and with cone beam an eighth of the nodes. Few
  // bricks need what finer gold needs around them.
  [[nodiscard]] std::vector<Step> steps_of_sweep() const {
    const int own = std::min(volume_.rate, field_.across());
    std::vector<int> finer;
    if (own == field_.across())
      for (int rate = 2 * own; rate <= std::min(finest_rate(volume_), std::max(2 * volume_.rate, 4 * own));
           rate *= 2)
        finer.push_back(rate);
    if (!field_.nodes_are_dear()) {
      finer.insert(finer.begin(), own);
      return {{finer, {}}};
    }
    // What sparse nodes leave undecided goes by dense ones of finer gold.
    if (finer.empty())
      return own > 1 ? std::vector<Step>{{{own / 2}, {}}, {{own}, {}}} : std::vector<Step>{{{own}, {}}};
    std::vector<Step> steps{{{own}, {own, finer.front()}}, {finer, {}}};
    // What the first step leaves undecided takes dense nodes of the next one, up to eight times as many.
    if (own > 1) steps.insert(steps.begin(), {{own / 2}, {own / 2, own, finer.front()}, 2});
    return steps;
  }

  [[nodiscard]] bool serves(const Step& step, const std::vector<std::uint8_t>& wanted) const {
    // As far as F errs, a brick is not told from one that keeps its promise.
    constexpr double most = 0.06;
    return !step.by_sparse.empty() && std::find(wanted.begin(), wanted.end(), 1) != wanted.end() &&
           field_.sparse_nodes_serve(
               wanted, step.by_sparse, step.worth,
               most * *std::min_element(limits_.promised.begin(), limits_.promised.end()));
  }

  // A brick that errs by more at a node is wrong at every rate, and all is then.
  [[nodiscard]] bool undecided(std::size_t brick) const {
    const Brick& b = bricks_[brick];
    const double promised = limits_.promised[brick];
    if (hopeless_ || b.total <= std::min(promised, limits_.stated)) return false;
    return b.total > promised || b.least <= limits_.stated;
  }

  void run(const std::vector<std::uint8_t>& selected, const std::vector<int>& rates,
           const std::function<bool(std::size_t, int)>& wants, VerifyResult& result,
           VerifyField::Made made = VerifyField::Made::dense) {
    field_.run(
        selected, rates, wants,
        [&](const VerifyField::Piece& p) {
          Brick& b = now_[at(p.brick)];
          b.tried = p.rate;
          if (p.total < 0) return;
          if (bricks_[at(p.brick)].tried == 0) {
            result.cells_tested += p.cells;
            result.nodes_tested += p.nodes;
          }
          attack_.consider(p);
          b.error = std::max(b.error, p.error);
          b.least = std::max(b.least, b.error - p.arithmetic);
          if (p.total <= b.total) return;
          b.total = p.total;
          b.cell = p.worst_cell;
        },
        progress_, made);
    for (std::size_t i = 0; i < now_.size(); ++i) take(i);
    result.arithmetic = std::max(result.arithmetic, field_.arithmetic());
  }

  // What all pieces of a brick gave at one rate.
  void take(std::size_t i) {
    Brick& known = bricks_[i];
    Brick now = std::exchange(now_[i], {});
    if (now.tried == 0) return;
    // Cells that only the coarser gold tested hold no point of which the certificate speaks.
    if (known.total >= 0) now.total = std::max(0.0, now.total);
    known.again = known.again || (known.tried > 0 && undecided(i));
    known.tried = now.tried;
    known.error = std::max(known.error, now.error);
    double& least = now.tried > volume_.rate ? known.finer : known.least;
    least = std::max(least, now.least);
    hopeless_ = hopeless_ || !(now.least <= limits_.promised[i]);
    if (now.total < 0 || (known.total >= 0 && known.total <= now.total)) return;
    known.total = now.total;
    known.cell = now.cell;
    known.rate = now.tried;
  }

  VerifyField& field_;
  const MixedVolume& volume_;
  TotalAttack& attack_;
  Limits limits_;
  const Progress& progress_;
  std::vector<Brick> bricks_, now_;
  bool hopeless_ = false;
};

// What the samplers that this device has and that are promised of it leave of epsilon for |V - F| itself, of
// each brick.
std::vector<double> left_by_samplers(const Device& device, const Certificate& stored,
                                     const SamplerTerms& sampler, std::size_t bricks) {
  const double taken = stored.holds_buffer ? sampler.buffer.value : 0;
  std::vector<double> left(bricks, stored.epsilon_abs - taken);
  if (promises_image3d(device, stored) && sampler.image3d)
    for (std::size_t i = 0; i < bricks; ++i)
      left[i] = stored.epsilon_abs - std::max(taken, static_cast<double>(sampler.image3d_by_brick[i]));
  return left;
}

Certificate with_samplers(Certificate c, SamplerTerms samplers) {
  charge_samplers(c, std::move(samplers));
  return c;
}

// The sampler terms again, and the least that an image sampler can have.
Differences check_samplers(Device& device, const MixedVolume& volume, const Certificate& stored,
                           const FieldSlopes& slopes, const SamplerTerms& found) {
  SamplerProbe ideal;
  ideal.image3d = ideal.u16.image3d = ideal.u8.image3d = true;
  const SamplerTerms least = sampler_terms(slopes, volume.grid, ideal, 1, stored.epsilon_abs, volume.rate);
  return compare_samplers(found, with_samplers(stored, least).budget.sampler, is_builder(device, stored),
                          stored);
}

// Adds what differs to the verdict.
void add_differences(VerifyResult& r) {
  if (r.differences.empty()) return;
  r.holds = false;
  for (std::size_t i = 0; i < r.differences.size(); ++i)
    r.failure +=
        fmt::format("{}{}", r.failure.empty() ? "the certificate is not that of these projections: " : "; ",
                    r.differences[i]);
}

// The brick with the largest total, and one that errs by more than the certificate says of it; -1: none. What
// |V - F| is at least, somewhere.
struct WorstBricks {
  std::int64_t worst = -1, broken = -1;
  double least = 0;
};

WorstBricks sum_up(const std::vector<TestedBricks::Brick>& bricks, const Certificate& stored,
                   const SamplerTerms& sampler, VerifyResult& result) {
  WorstBricks out;
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    const TestedBricks::Brick& b = bricks[i];
    if (b.total < 0) continue;
    ++result.bricks_tested;
    result.measured_max = std::max(result.measured_max, b.error);
    out.least = std::max({out.least, b.least, b.finer});
    if (b.again) ++result.bricks_finer;
    result.finest_rate = std::max(result.finest_rate, b.tried);
    // At the rim, and at the ends of a window, cells are tested here that hold nothing promised. A node that
    // is covered, and whose value lies in the window, is in a brick that build tested.
    if (!stored.brick_totals.empty()) {
      const auto total = static_cast<double>(stored.brick_totals[i]);
      const double bound = total + stored.budget.arithmetic.value;
      // Between gold nodes the certificate's bound holds with the sampler's rounding.
      if (total < 0 ? b.error > 0 : !(b.least <= bound) || !(b.finer <= bound + sampler.buffer.value))
        out.broken = static_cast<std::int64_t>(i);
    }
    if (sampler.image3d)
      result.total_image3d = std::max(result.total_image3d.value_or(0),
                                      b.total + static_cast<double>(sampler.image3d_by_brick[i]));
    if (b.total <= result.measured_total && out.worst >= 0) continue;
    result.measured_total = b.total;
    out.worst = static_cast<std::int64_t>(i);
  }
  return out;
}

// What F at points says of a certificate whose bricks hold.
void look_at_points(TotalAttack& attack, const ExactField& exact, const VerifyField& field,
                    const Progress& progress, VerifyResult& result) {
  const TotalAttack::Outcome points = attack.run(exact, progress);
  result.points_evaluated = points.points;
  result.worst_share = points.worst_share;
  if (result.holds && !points.failure.empty()) {
    result.holds = false;
    result.failure = points.failure;
  }
  const FieldPoints::Outcome seen = FieldPoints::compare(exact, field.seen(), progress);
  result.field_points = seen.points;
  result.field_share = seen.worst_share;
  if (!seen.failure.empty()) {
    result.holds = false;
    result.failure = seen.failure;
  }
}

void look_at_seams(const MixedVolume& volume, VerifyResult& result) {
  const Seams seams = compare_seams(volume);
  result.seams = seams.different;
  if (seams.different == 0) return;
  result.holds = false;
  result.failure += fmt::format(
      "{}{} samples that two bricks share differ, first at ({:.6g}, {:.6g}, {:.6g}) between bricks {} "
      "and {}",
      result.failure.empty() ? "" : "; ", seams.different, seams.at[0], seams.at[1], seams.at[2],
      seams.bricks[0], seams.bricks[1]);
}

}  // namespace

VerifyResult verify(Device& device, const ProjectionSet& scan, const MixedVolume& volume,
                    const Certificate& stored, const VerifyOptions& options, const Progress& progress) {
  opencl::State& state = device.state();
  require_trusted(device, "verifying a certificate");
  ParallelGeometry used = scan.geometry;
  used.center = center_of(stored.field, used);
  if (scan.cone) check_scan(scan);
  else check_scan(used);
  // Weights at most double the columns of a displaced detector.
  const std::uint64_t padded = scan.cone && scan.cone->redundancy == Redundancy::displaced ? 2 : 1;
  const std::uint64_t all = padded * static_cast<std::uint64_t>(scan.size()) * sizeof(double);
  const std::uint64_t bytes =
      scan.data.scratch() ? std::min(all, scan.data.scratch()->resident_bytes()) : all;
  const HostMemory host(state, bytes, "cosine coefficients of the filtered projections");
  const ExactField exact(scan, stored.field, progress);
  const FieldSlopes slopes = field_slopes(volume);
  const Certificate here = with_samplers(
      stored, sampler_terms(slopes, volume.grid, probe_filters(device), atlas_length(device.info(), volume),
                            stored.epsilon_abs, volume.rate, sampler_underflow(device.info())));
  const SamplerTerms& sampler = here.budget.sampler;

  VerifyResult result;
  result.differences = compare_scope(scan, used, volume, stored);
  const auto also = [&](Differences more) {
    result.differences.insert(result.differences.end(), std::make_move_iterator(more.begin()),
                              std::make_move_iterator(more.end()));
  };
  also(check_samplers(device, volume, stored, slopes, sampler));
  const CertifiedRegion region(scan, stored.field);
  TotalAttack attack(volume, stored, region);
  result.epsilon_abs = stored.epsilon_abs;
  result.bricks = static_cast<std::int64_t>(volume.level.size());
  VerifyField field(state, exact, volume, stored.window, progress, units_of(scan).density());
  const SampleOf shape = field.nodes_are_dear()               ? SampleOf::blocks
                         : field.rows_serve(layers_of_sample) ? SampleOf::columns
                                                              : SampleOf::layers;
  std::vector<std::uint8_t> selected = all_bricks(volume, stored);
  // A block in a corner of the grid, where nothing is covered, would be none.
  if (shape == SampleOf::blocks) selected = field.near_coverage(std::move(selected));
  if (!options.exhaustive) selected = sample_of_bricks(volume, stored, options, shape, std::move(selected));
  const FieldPoints points_of_field(exact, region, volume, selected, options.seed);
  field.look_at(points_of_field.bricks(), points_of_field.nodes_each(), options.seed);
  TestedBricks tested(field, volume, attack,
                      {left_by_samplers(device, stored, sampler, volume.level.size()),
                       stored.measured_total + stored.budget.arithmetic.value},
                      progress);
  tested.sweep(selected, points_of_field.flags(), result);
  tested.settle(result);

  const std::vector<TestedBricks::Brick>& bricks = tested.bricks();
  const auto [worst, broken, least] = sum_up(bricks, stored, sampler, result);
  if (worst < 0) {
    result.failure = "no tested brick holds a covered gold cell";
    add_differences(result);
    return result;
  }
  const auto place = [&](std::int64_t brick) {
    return worst_sample(volume, exact, brick, bricks[at(brick)].cell, bricks[at(brick)].rate);
  };
  result.worst = place(worst);
  result.worst_at = result.worst.world;
  judge(device, stored, here, result);
  if (!result.holds && result.failure.empty())
    result.failure = fmt::format("|V - F| may reach {:.6g} > epsilon {:.6g} {}", result.total,
                                 stored.epsilon_abs, place_text(result.worst));
  // Nodes are where V is certified without T: no total can lie below what is measured there.
  const double promised = std::max(stored.total_buffer, stored.total_image3d.value_or(stored.total_buffer));
  if (result.holds && !(least <= promised)) {
    result.holds = false;
    result.failure = fmt::format("|V - F| reaches {:.6g}, above the total {:.6g} of the certificate, {}",
                                 result.measured_max, promised, place_text(result.worst));
  }
  if (result.holds && broken >= 0) {
    result.holds = false;
    result.failure = fmt::format("|V - F| exceeds the certificate's bound {:.6g} of one brick, {}",
                                 stored.brick_totals[at(broken)], place_text(place(broken)));
  }
  look_at_points(attack, exact, field, progress, result);
  // Rates that name no gold have been found already.
  if (result.differences.empty())
    also(compare_terms(device, scan, exact, volume, stored, selected, options.exhaustive, progress));
  add_differences(result);
  if (options.exhaustive) look_at_seams(volume, result);
  return result;
}

}  // namespace vdvr
