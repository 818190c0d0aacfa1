// A part adds its whole volume to the sure volumes of all edges up to its least value less e, which is one
// entry of a table of steps; only edges that its own range holds are looked at one by one.
#include "host/measure/measure_distribution.hpp"

#include <fmt/format.h>

#include <cmath>

#include "vdvr/error.hpp"

namespace vdvr::measured {
namespace {

// A part is halved so often at most: once a side.
constexpr int halvings = 3;
// What may stay open of the volume of a part that the region's edge cuts.
constexpr double fine = 0.1;

struct Steps {
  std::vector<double> whole, partial;

  explicit Steps(std::size_t edges) : whole(edges + 1, 0), partial(edges, 0) {}
  /// To all edges below number `end`.
  void add_below(std::size_t end, double volume) { whole[end] += volume; }
  [[nodiscard]] std::vector<double> sums() const {
    std::vector<double> out(partial);
    double above = 0;
    for (std::size_t k = out.size(); k-- > 0;) {
      above += whole[k + 1];
      out[k] += above;
    }
    return out;
  }
  Steps& operator+=(const Steps& o) {
    for (std::size_t i = 0; i < whole.size(); ++i) whole[i] += o.whole[i];
    for (std::size_t i = 0; i < partial.size(); ++i) partial[i] += o.partial[i];
    return *this;
  }
};

struct DistributionSums {
  Steps sure, possible;
  Interval region{0, 0};

  DistributionSums& operator+=(const DistributionSums& o) {
    sure += o.sure;
    possible += o.possible;
    region.lo += o.region.lo;
    region.hi += o.region.hi;
    return *this;
  }
};

class DistributionOfParts {
 public:
  DistributionOfParts(const MeasuredRegion& region, const std::vector<double>& edges, double bound)
      : region_(region), edges_(edges), bound_(bound) {}

  void add(const Part& part, bool whole, DistributionSums& sums, int left = halvings) const {
    const Interval share = whole ? Interval{1, 1} : region_.share(part.low, part.high);
    const AffineForm form = affine_of(part.value);
    // Edges below `sure_first` are passed everywhere, whatever F; those from `last` on nowhere.
    const std::size_t sure_first = passed(std::nextafter(form.least - bound_, -HUGE_VAL)),
                      sure_last = std::max(sure_first, passed(form.largest - bound_)),
                      first = passed(std::nextafter(form.least + bound_, -HUGE_VAL)),
                      last = passed(std::nextafter(form.largest + bound_, HUGE_VAL));
    // What the affine function leaves open counts where it is more than e.
    const bool cuts = sure_first < sure_last || first < last;
    if (left > 0 &&
        (share.width() > fine || (cuts && form.below + form.above > fine * (form.largest - form.least)))) {
      for (const Part& half : halves(part, axis_of(part, form, whole))) {
        const Place place = whole ? Place::inside : region_.place(half.low, half.high);
        if (place != Place::outside) add(half, place == Place::inside, sums, left - 1);
      }
      return;
    }
    const double v = part.volume();
    sums.region.lo += share.lo * v;
    sums.region.hi += share.hi * v;
    sums.sure.add_below(sure_first, share.lo * v);
    for (std::size_t k = sure_first; k < sure_last; ++k)
      sums.sure.partial[k] +=
          std::max(0.0, share.lo + share_above(form, std::nextafter(edges_[k] + bound_, HUGE_VAL)).lo - 1) *
          v;
    sums.possible.add_below(first, share.hi * v);
    for (std::size_t k = first; k < last; ++k)
      sums.possible.partial[k] +=
          std::min(share.hi, share_above(form, std::nextafter(edges_[k] - bound_, -HUGE_VAL)).hi) * v;
  }

 private:
  static std::size_t axis_of(const Part& part, const AffineForm& form, bool whole) {
    return whole ? most_bent(form) : longest_side(part);
  }
  /// The number of edges at most `value`.
  [[nodiscard]] std::size_t passed(double value) const {
    return static_cast<std::size_t>(std::upper_bound(edges_.begin(), edges_.end(), value) - edges_.begin());
  }

  const MeasuredRegion& region_;
  const std::vector<double>& edges_;
  double bound_;
};

void require_edges(const std::vector<double>& edges) {
  if (edges.size() < 2) throw InputError("a distribution needs two edges at least");
  for (std::size_t i = 0; i < edges.size(); ++i)
    if (!std::isfinite(edges[i]) || (i > 0 && !(edges[i] > edges[i - 1])))
      throw InputError(fmt::format("edge {} is {}; edges ascend and are finite", i, edges[i]));
}

}  // namespace

Distribution measure_distribution(const Field& field, const std::vector<double>& edges,
                                  const Progress& progress) {
  require_edges(edges);
  const DistributionSums zero{Steps(edges.size()), Steps(edges.size())};
  const DistributionSums s =
      field.sum_over_bricks(zero, progress, "measure", [&](const BrickCells& cells, DistributionSums& sums) {
        const DistributionOfParts parts(field.region(), edges, cells.bound);
        for_parts(field.region(), cells, [&](const Part& part, bool whole) { parts.add(part, whole, sums); });
      });
  Distribution out;
  out.edges = edges;
  out.region = outward(s.region);
  const std::vector<double> sure = s.sure.sums(), possible = s.possible.sums();
  for (std::size_t k = 0; k < edges.size(); ++k) out.at_least.push_back(outward({sure[k], possible[k]}));
  // The volume falls as the edge rises, and so do its ends.
  for (std::size_t k = 1; k < edges.size(); ++k) {
    const std::size_t last = edges.size() - k;
    out.at_least[k].hi = std::min(out.at_least[k].hi, out.at_least[k - 1].hi);
    out.at_least[last - 1].lo = std::max(out.at_least[last - 1].lo, out.at_least[last].lo);
  }
  for (std::size_t k = 0; k + 1 < edges.size(); ++k)
    out.within.push_back({std::max(0.0, out.at_least[k].lo - out.at_least[k + 1].hi),
                          out.at_least[k].hi - out.at_least[k + 1].lo});
  return out;
}

}  // namespace vdvr::measured
