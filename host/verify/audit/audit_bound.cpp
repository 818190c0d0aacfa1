// Bricks of W on gold of rising rates, until the largest bound is sharp.
#include "host/verify/audit/audit_bound.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/base/system/casts.hpp"
#include "host/verify/verify_field.hpp"
#include "host/volume/bricks.hpp"
#include "host/volume/sampler/sampler_terms.hpp"

namespace vdvr {
namespace {

constexpr std::size_t kMostBoxes = 32;

// What `verify` charges for rounding on the device takes V to be of F's size. W may be anything: its
// differences from F, and what is added to them, are rounded four times at most, 2^-24 each.
constexpr double kRounding = 1e-6;

// T of gold is a thousandth there of what it is at 2x; cell coordinates of its nodes are exact in fp32.
int finest_rate(const Grid& grid, int first) {
  constexpr int wanted = 64;
  const std::int64_t cells = *std::max_element(grid.cells.begin(), grid.cells.end());
  int rate = first;
  while (2 * rate <= std::max(wanted, first) && cells * 2 * rate <= (1 << 24)) rate *= 2;
  return rate;
}

class BoundedBricks {
 public:
  BoundedBricks(VerifyField& field, const AuditedVolume& w, std::vector<double> beside, double sharp,
                std::optional<double> within, const Progress& progress)
      : field_(field),
        w_(w),
        bricks_of_(w.grid(), w.field().granularity),
        beside_(std::move(beside)),
        largest_beside_(*std::max_element(beside_.begin(), beside_.end())),
        sharp_(sharp),
        within_(within),
        progress_(progress),
        known_(beside_.size()),
        now_(beside_.size()),
        first_(field.across()),
        finest_(finest_rate(w.grid(), first_)) {}

  /// All bricks on gold of the nodes' own rate, and those that are not sharp at once on finer gold of the
  /// same nodes.
  void sweep(const std::vector<std::uint8_t>& selected) {
    std::vector<int> rates{first_};
    if (!field_.nodes_are_dear())
      while (rates.size() < 3 && rates.back() < finest_) rates.push_back(2 * rates.back());
    run(selected, rates);
  }

  /// The worst bricks by themselves on finer gold.
  void settle() {
    for (std::size_t most = 8;; most *= 2) {
      std::vector<std::size_t> over;
      for (std::size_t i = 0; i < known_.size(); ++i)
        if (unsettled(i)) over.push_back(i);
      if (over.empty()) return;
      most = std::min(most, over.size());
      std::partial_sort(over.begin(), over.begin() + static_cast<std::ptrdiff_t>(most), over.end(),
                        [&](std::size_t a, std::size_t b) { return total(a) > total(b); });
      // What cannot be made sharper decides.
      if (known_[over.front()].tried >= finest_) return;
      over.resize(most);
      int rate = finest_;
      for (const std::size_t i : over) rate = std::min(rate, 2 * known_[i].tried);
      std::vector<std::uint8_t> selected(known_.size(), 0);
      for (const std::size_t i : over) selected[i] = known_[i].tried < rate;
      run(selected, {rate});
    }
  }

  [[nodiscard]] AuditBound result(double sampler) const {
    AuditBound out;
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < known_.size(); ++i) {
      if (known_[i].total < 0) continue;
      out.upper = std::max(out.upper, total(i) + sampler);
      out.finest_rate = std::max(out.finest_rate, known_[i].tried);
      order.push_back(i);
    }
    const std::size_t kept = std::min(order.size(), kMostBoxes);
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(kept), order.end(),
                      [&](std::size_t a, std::size_t b) { return total(a) > total(b); });
    order.resize(kept);
    for (const std::size_t i : order) out.worst.push_back(box(i));
    return out;
  }

 private:
  struct Brick {
    double total = -1;  // the smallest bound of all rates; negative: not tested
    double error = 0;   // what |V - F| is at least at some node
    Index3 cell{};      // of gold, where the bound is attained
    int rate = 0, tried = 0;
  };

  [[nodiscard]] double total(std::size_t i) const { return known_[i].total + beside_[i]; }
  [[nodiscard]] bool unsettled(std::size_t i) const {
    if (known_[i].total < 0) return false;
    // What lies beside the trilinear field is nearly attained; a bound of it is as sharp as it can be.
    double limit = sharp_ * std::max(lower_, largest_beside_);
    if (within_) limit = lower_ > *within_ ? limit : std::min(limit, *within_);
    return total(i) > limit && known_[i].total > (sharp_ - 1) * total(i);
  }

  [[nodiscard]] WorstBox box(std::size_t i) const {
    const Index3 b = bricks_of_.position(static_cast<std::int64_t>(i));
    WorstBox out;
    out.bound = total(i);
    for (std::size_t a = 0; a < 3; ++a) {
      const double rate = known_[i].rate, first = static_cast<double>(b[a] * w_.field().granularity) +
                                                  static_cast<double>(known_[i].cell[a]) / rate;
      // Beside a trilinear field the worst point may lie anywhere in W's cell.
      const bool whole = w_.between() != Between::linear;
      out.low[a] = whole ? std::floor(first) : first;
      out.high[a] = whole ? std::floor(first) + 1 : first + 1 / rate;
    }
    return out;
  }

  void run(const std::vector<std::uint8_t>& selected, const std::vector<int>& rates) {
    field_.run(
        selected, rates,
        [&](std::size_t i, int) {
          take(i);
          return known_[i].tried == 0 || rates.size() == 1 || unsettled(i);
        },
        [&](const VerifyField::Piece& p) { consider(p); }, progress_);
    for (std::size_t i = 0; i < now_.size(); ++i) take(i);
  }

  // Columns of gold cells in cells that count; others have samples that F is not known at.
  void consider(const VerifyField::Piece& p) {
    Brick& b = now_[at(p.brick)];
    b.tried = p.rate;
    const Index3 brick = bricks_of_.position(p.brick);
    const auto side =
        static_cast<std::int64_t>(std::llround(std::sqrt(static_cast<double>(p.columns.size()))));
    for (std::int64_t j = 0; j < side * side; ++j) {
      const VerifyField::Column& c = p.columns[at(j)];
      const Index3 in{p.first_cell[0] + j % side, p.first_cell[1] + j / side, p.first_cell[2] + c.worst_z};
      const std::int64_t x = brick[0] * w_.field().granularity + in[0] / p.rate,
                         y = brick[1] * w_.field().granularity + in[1] / p.rate;
      if (!(c.total >= 0) || x >= w_.grid().cells[0] || y >= w_.grid().cells[1] || !w_.cell_counts(x, y))
        continue;
      b.error = std::max(b.error, p.unit * static_cast<double>(c.error) * (1 - kRounding) - p.arithmetic);
      const double bound = p.unit * static_cast<double>(c.total) * (1 + kRounding) + p.constant;
      if (bound <= b.total) continue;
      b.total = bound;
      b.cell = in;
    }
  }

  // What all pieces of a brick gave at one rate.
  void take(std::size_t i) {
    const Brick now = std::exchange(now_[i], {});
    if (now.tried == 0) return;
    Brick& known = known_[i];
    known.tried = now.tried;
    if (w_.between() == Between::linear) lower_ = std::max(lower_, now.error);
    if (now.total < 0 || (known.total >= 0 && known.total <= now.total)) return;
    known.total = now.total;
    known.cell = now.cell;
    known.rate = now.tried;
  }

  VerifyField& field_;
  const AuditedVolume& w_;
  Bricks bricks_of_;
  std::vector<double> beside_;
  double largest_beside_, sharp_;
  std::optional<double> within_;
  const Progress& progress_;
  std::vector<Brick> known_, now_;
  int first_, finest_;
  double lower_ = 0;
};

}  // namespace

AuditBound bound_between(opencl::State& state, const ExactField& exact, const AuditedVolume& w, double sharp,
                         std::optional<double> within, int density, const Progress& progress) {
  VerifyField field(state, exact, w.field(), {}, progress, density);
  BoundedBricks bricks(field, w, w.distance_from_linear(progress), sharp, within, progress);
  bricks.sweep(w.bricks_that_count());
  bricks.settle();
  const SamplerTerms sampler = sampler_terms(field_slopes(w.field()), w.grid(), {}, 0, 0, field.across(),
                                             sampler_underflow(state.info));
  return bricks.result(sampler.buffer.value);
}

}  // namespace vdvr
