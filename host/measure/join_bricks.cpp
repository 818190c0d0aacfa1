// Along an axis that both bricks share their cells are intervals in units of 1/64 of a cell of the grid,
// which every level is a multiple of. Along any other, the last cells of one meet the first of the other.
#include "host/measure/join_bricks.hpp"

#include <cmath>

#include "host/base/system/casts.hpp"

namespace vdvr::measured {
namespace {

constexpr int finest = 6;  // log2 of the finest cells per cell of the grid

struct Range {
  std::int64_t first = 0, last = -1;
};
/// Of each cell of one brick along an axis, the cells of the other that it touches, and those that it shares
/// more than a point with.
struct AxisTouch {
  std::int64_t begin = 0, end = 0;  ///< cells of the first brick that touch any
  std::vector<Range> touched, shared;
};

AxisTouch side_by_side(const LabelledBrick& a, const LabelledBrick& b, std::size_t axis) {
  const std::int64_t p = std::int64_t{1} << (finest - a.per_cell[axis]),
                     q = std::int64_t{1} << (finest - b.per_cell[axis]), last = b.count[axis] - 1;
  AxisTouch out{0, a.count[axis], {}, {}};
  for (std::int64_t i = 0; i < a.count[axis]; ++i) {
    const std::int64_t low = i * p, high = low + p;
    out.touched.push_back({std::max<std::int64_t>(0, (low - 1 + q) / q - 1), std::min(last, high / q)});
    out.shared.push_back({low / q, std::min(last, (high - 1) / q)});
  }
  return out;
}

AxisTouch end_to_end(const LabelledBrick& a, const LabelledBrick& b, std::size_t axis, bool up) {
  const std::int64_t own = up ? a.count[axis] - 1 : 0, other = up ? 0 : b.count[axis] - 1;
  AxisTouch out{own, own + 1, {}, {}};
  out.touched.assign(at(a.count[axis]), {other, other});
  out.shared = out.touched;
  return out;
}

class Joiner {
 public:
  Joiner(const Field& field, const LabelledBrick& a, const LabelledBrick& b, UnionFind& possible,
         UnionFind& sure)
      : field_(field), a_(a), b_(b), possible_(possible), sure_(sure) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t step = b.brick[axis] - a.brick[axis];
      touch_[axis] = step == 0 ? side_by_side(a, b, axis) : end_to_end(a, b, axis, step > 0);
      if (step == 0) continue;
      ++steps_;
      across_ = axis;
    }
  }

  void run() {
    if (a_.possible.none() || b_.possible.none()) return;
    if (a_.possible.uniform() && b_.possible.uniform())
      possible_.join(a_.possible_ids[a_.possible.of_all], b_.possible_ids[b_.possible.of_all]);
    else join_possible();
    if (steps_ != 1 || a_.sure.none() || b_.sure.none()) return;
    if (a_.sure.uniform() && b_.sure.uniform())
      sure_.join(a_.sure_ids[a_.sure.of_all], b_.sure_ids[b_.sure.of_all]);
    else join_sure();
  }

 private:
  // visit(cell of a, cell of b) over cells that `ranges` pairs along each axis.
  template <class Visit>
  void for_pairs(std::vector<Range> AxisTouch::*ranges, const Labels& own, const Labels& other,
                 const Visit& visit) const {
    Index3 i{};
    for (i[2] = touch_[2].begin; i[2] < touch_[2].end; ++i[2])
      for (i[1] = touch_[1].begin; i[1] < touch_[1].end; ++i[1])
        for (i[0] = touch_[0].begin; i[0] < touch_[0].end; ++i[0]) {
          const std::uint32_t label = own(a_.cell(i[0], i[1], i[2]));
          if (label == no_part) continue;
          const Range x = (touch_[0].*ranges)[at(i[0])], y = (touch_[1].*ranges)[at(i[1])],
                      z = (touch_[2].*ranges)[at(i[2])];
          Index3 j{};
          for (j[2] = z.first; j[2] <= z.last; ++j[2])
            for (j[1] = y.first; j[1] <= y.last; ++j[1])
              for (j[0] = x.first; j[0] <= x.last; ++j[0])
                if (const std::uint32_t l = other(b_.cell(j[0], j[1], j[2])); l != no_part)
                  visit(i, j, label, l);
        }
  }
  void join_possible() {
    for_pairs(&AxisTouch::touched, a_.possible, b_.possible,
              [&](const Index3&, const Index3&, std::uint32_t p, std::uint32_t q) {
                possible_.join(a_.possible_ids[p], b_.possible_ids[q]);
              });
  }
  void join_sure() {
    for_pairs(&AxisTouch::shared, a_.sure, b_.sure,
              [&](const Index3& i, const Index3& j, std::uint32_t p, std::uint32_t q) {
                if ((a_.whole || b_.whole) || holds_point(i, j)) sure_.join(a_.sure_ids[p], b_.sure_ids[q]);
              });
  }
  // Whether what both cells share holds a point of the region.
  [[nodiscard]] bool holds_point(const Index3& i, const Index3& j) const {
    const Grid& g = field_.volume().grid;
    Vec3 low{}, high{};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto place = [&](const LabelledBrick& brick, std::int64_t cell) {
        return g.origin[a] + (static_cast<double>(brick.brick[a] * field_.volume().granularity) +
                              std::ldexp(static_cast<double>(cell), -brick.per_cell[a])) *
                                 g.spacing[a];
      };
      low[a] = std::max(place(a_, i[a]), place(b_, j[a]));
      high[a] = std::min(place(a_, i[a] + 1), place(b_, j[a] + 1));
      if (a == across_) high[a] = low[a];
    }
    return field_.region().holds_point(low, high);
  }

  const Field& field_;
  const LabelledBrick &a_, &b_;
  UnionFind &possible_, &sure_;
  std::array<AxisTouch, 3> touch_;
  int steps_ = 0;
  std::size_t across_ = 0;
};

}  // namespace

void join_bricks(const Field& field, const LabelledBrick& a, const LabelledBrick& b, UnionFind& possible,
                 UnionFind& sure) {
  if (a.possible.none() || b.possible.none()) return;
  Joiner(field, a, b, possible, sure).run();
}

}  // namespace vdvr::measured
