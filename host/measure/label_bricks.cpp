#include "host/measure/label_bricks.hpp"

#include "host/base/system/casts.hpp"
#include "host/volume/brick_layout.hpp"

namespace vdvr::measured {

PossibleRecord& PossibleRecord::operator+=(const PossibleRecord& o) {
  volume.lo += o.volume.lo;
  volume.hi += o.volume.hi;
  for (std::size_t a = 0; a < 3; ++a) {
    low[a] = std::min(low[a], o.low[a]);
    high[a] = std::max(high[a], o.high[a]);
  }
  touches |= o.touches;
  sure_spans |= o.sure_spans;
  sure_parts += o.sure_parts;
  return *this;
}

std::uint64_t LabelledBrick::bytes() const {
  return sizeof(*this) + 4 * (possible.of_cell.capacity() + sure.of_cell.capacity() +
                              possible_ids.capacity() + sure_ids.capacity());
}

namespace {

enum class In : std::uint8_t { no, possibly, surely };

/// Which sides of the region's box a closed box reaches. `surely`: in a point of the region.
std::uint8_t sides_of(const MeasuredRegion& region, const Vec3& low, const Vec3& high, bool surely) {
  std::uint8_t sides = 0;
  for (std::size_t a = 0; a < 3; ++a)
    for (const bool upper : {false, true}) {
      const double side = upper ? region.high()[a] : region.low()[a];
      if (!(low[a] <= side && high[a] >= side)) continue;
      Vec3 from = low, to = high;
      from[a] = to[a] = side;
      const bool reached = surely ? region.holds_point(from, to) : region.place(from, to) != Place::outside;
      if (reached) sides = static_cast<std::uint8_t>(sides | 1u << (2 * a + (upper ? 1 : 0)));
    }
  return sides;
}

/// What a cell is.
struct CellState {
  In in = In::no;
  PossibleRecord record;
  std::uint8_t sure_touches = 0;
};

class Labeller {
 public:
  Labeller(const Field& field, const BrickCells& cells, const ValueRange& range)
      : region_(field.region()),
        cells_(cells),
        thresholds_(thresholds_of(range, cells.bound)),
        at_side_(sides_of(region_, cells.low(), cells.high(), false) != 0) {
    out_.brick = cells.brick;
    out_.count = cells.count;
    out_.per_cell = BrickSamples(field.volume(), cells.brick).per_cell();
    out_.whole = cells.place == Place::inside;
  }

  LabelledBrick run() {
    if (!uniform()) label_cells();
    return std::move(out_);
  }

 private:
  // A brick that is whole, and of one kind.
  bool uniform() {
    const auto least = static_cast<double>(cells_.least), largest = static_cast<double>(cells_.largest);
    if (largest < thresholds_.outer_least || least > thresholds_.outer_largest) return true;
    if (!out_.whole || at_side_) return false;
    if (!(least >= thresholds_.inner_least && largest <= thresholds_.inner_largest)) return false;
    PossibleRecord record;
    record.low = cells_.low();
    record.high = cells_.high();
    const double v = Part{record.low, record.high, {}}.volume();
    record.volume = {v, v};
    out_.possible.of_all = out_.sure.of_all = 0;
    out_.possible_parts = {record};
    out_.sure_parts = {SureRecord{}};
    return true;
  }

  [[nodiscard]] CellState state_of(const Part& cell) const {
    CellState state;
    const auto [least, largest] = std::minmax_element(cell.value.begin(), cell.value.end());
    if (*largest < thresholds_.outer_least || *least > thresholds_.outer_largest) return state;
    const Place place = out_.whole ? Place::inside : region_.place(cell.low, cell.high);
    if (place == Place::outside) return state;
    // Of a cell that has only a face in the region's box, the cell beside it holds all points.
    const Part part = out_.whole ? cell : clipped_to(cell, region_.low(), region_.high());
    if (!(part.volume() > 0)) return state;
    state.in = In::possibly;
    state.record.low = part.low;
    state.record.high = part.high;
    state.record.volume = volume_in(part, place == Place::inside);
    if (at_side_) state.record.touches = sides_of(region_, part.low, part.high, false);
    if (!(*least >= thresholds_.inner_least && *largest <= thresholds_.inner_largest)) return state;
    // Of a cell that the mask cuts, the part within may be in pieces.
    if (place == Place::inside ||
        (region_.holds_point(cell.low, cell.high) && !region_.mask_plane(cell.low, cell.high)))
      state.in = In::surely;
    if (at_side_ && state.in == In::surely) state.sure_touches = sides_of(region_, part.low, part.high, true);
    return state;
  }
  [[nodiscard]] Interval volume_in(const Part& part, bool whole) const {
    if (!whole)
      if (const auto plane = region_.mask_plane(part.low, part.high)) {
        Interval sum{0, 0};
        for (const Part& half : split(part, plane->axis, plane->at)) {
          const Place place = region_.place(half.low, half.high);
          if (place == Place::outside) continue;
          const Interval v = volume_in(half, place == Place::inside);
          sum = {sum.lo + v.lo, sum.hi + v.hi};
        }
        return sum;
      }
    return volume_of_part(region_, part, whole, thresholds_);
  }

  void label_cells() {
    const std::size_t n = at(out_.count[0] * out_.count[1] * out_.count[2]);
    std::vector<std::uint32_t> possible(n, no_part), sure(n, no_part);
    std::vector<PossibleRecord> records;
    std::vector<std::uint8_t> touches;
    for (std::int64_t z = 0; z < out_.count[2]; ++z)
      for (std::int64_t y = 0; y < out_.count[1]; ++y)
        for (std::int64_t x = 0; x < out_.count[0]; ++x) {
          const CellState state = state_of(cells_.cell(x, y, z));
          if (state.in == In::no) continue;
          const std::size_t i = out_.cell(x, y, z);
          possible[i] = possible_.add();
          records.push_back(state.record);
          join_earlier(possible, x, y, z);
          if (state.in != In::surely) continue;
          sure[i] = sure_.add();
          touches.push_back(state.sure_touches);
          join_faces(sure, x, y, z);
        }
    if (records.empty()) return;
    finish(possible, sure, records, touches);
  }
  void join_earlier(const std::vector<std::uint32_t>& labels, std::int64_t x, std::int64_t y,
                    std::int64_t z) {
    const std::uint32_t own = labels[out_.cell(x, y, z)];
    for (std::int64_t dz = -1; dz <= 0; ++dz)
      for (std::int64_t dy = -1; dy <= (dz < 0 ? 1 : 0); ++dy)
        for (std::int64_t dx = -1; dx <= (dz < 0 || dy < 0 ? 1 : -1); ++dx) {
          const std::int64_t p = x + dx, q = y + dy, r = z + dz;
          if (p < 0 || q < 0 || r < 0 || p >= out_.count[0] || q >= out_.count[1]) continue;
          if (const std::uint32_t other = labels[out_.cell(p, q, r)]; other != no_part)
            possible_.join(own, other);
        }
  }
  void join_faces(const std::vector<std::uint32_t>& labels, std::int64_t x, std::int64_t y, std::int64_t z) {
    const Index3 here{x, y, z};
    for (std::size_t a = 0; a < 3; ++a) {
      if (here[a] == 0) continue;
      Index3 before = here;
      --before[a];
      const std::uint32_t other = labels[out_.cell(before[0], before[1], before[2])];
      if (other == no_part) continue;
      Part face = cells_.cell(x, y, z);
      face.high[a] = face.low[a];
      if (out_.whole || region_.holds_point(face.low, face.high))
        sure_.join(labels[out_.cell(x, y, z)], other);
    }
  }

  // Roots get numbers from 0 on, in the order of cells.
  void finish(const std::vector<std::uint32_t>& possible, const std::vector<std::uint32_t>& sure,
              const std::vector<PossibleRecord>& records, const std::vector<std::uint8_t>& touches) {
    std::vector<std::uint32_t> number(possible_.size(), no_part), sure_number(sure_.size(), no_part);
    const auto numbered = [](std::vector<std::uint32_t>& numbers, std::uint32_t root, auto& parts) {
      if (numbers[root] == no_part) {
        numbers[root] = static_cast<std::uint32_t>(parts.size());
        parts.emplace_back();
      }
      return numbers[root];
    };
    out_.possible.of_cell.assign(possible.size(), no_part);
    if (sure_.size() > 0) out_.sure.of_cell.assign(sure.size(), no_part);
    for (std::size_t i = 0; i < possible.size(); ++i) {
      if (possible[i] == no_part) continue;
      const std::uint32_t p = numbered(number, possible_.root(possible[i]), out_.possible_parts);
      out_.possible.of_cell[i] = p;
      out_.possible_parts[p] += records[possible[i]];
      if (sure[i] == no_part) continue;
      const std::uint32_t s = numbered(sure_number, sure_.root(sure[i]), out_.sure_parts);
      out_.sure.of_cell[i] = s;
      out_.sure_parts[s].touches |= touches[sure[i]];
      out_.sure_parts[s].possible = p;
    }
  }

  const MeasuredRegion& region_;
  const BrickCells& cells_;
  Thresholds thresholds_;
  bool at_side_;
  LabelledBrick out_;
  UnionFind possible_, sure_;
};

}  // namespace

LabelledBrick label_brick(const Field& field, const BrickCells& cells, const ValueRange& range) {
  return Labeller(field, cells, range).run();
}

}  // namespace vdvr::measured
