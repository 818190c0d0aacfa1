#include "host/measure/measure_components.hpp"

#include <fmt/format.h>

#include <cmath>

#include "host/base/system/casts.hpp"
#include "host/measure/join_bricks.hpp"
#include "vdvr/error.hpp"

namespace vdvr::measured {
namespace {

/// A label of a point: of a part that may still grow, or a number of the table.
struct Followed {
  std::uint32_t part = no_part;
  std::optional<std::int64_t> number;

  /// `root`: what it belongs to; `live`: its new number there, or none, and then the table's.
  void follow(const std::vector<std::uint32_t>& live, const std::vector<std::int64_t>& ended,
              UnionFind& all) {
    if (part == no_part) return;
    const std::uint32_t root = all.root(part);
    part = live[root];
    if (part == no_part) number = ended[root];
  }
};
struct FollowedPoint {
  Followed possible, sure;
  bool surely = false;
};

class Components {
 public:
  Components(const Field& field, const ValueRange& range, const ComponentsOptions& options)
      : field_(field), range_(range), options_(options), points_(options.points.size()) {}

  ComponentTable run(const Progress& progress) {
    const Index3 n = field_.bricks().along();
    for (std::int64_t z = 0; z < n[2]; ++z) {
      label_layer(z);
      take_numbers();
      find_points(z);
      join_layer();
      end_parts();
      require_room();
      report(progress, "components", static_cast<double>(z + 1) / static_cast<double>(n[2]));
    }
    layer_.clear();
    end_parts();
    return table();
  }

 private:
  void label_layer(std::int64_t z) {
    before_ = std::move(layer_);
    const Index3 n = field_.bricks().along();
    layer_.assign(at(n[0] * n[1]), {});
    parallel_for(n[1], {}, "components", [&](std::int64_t y) {
      BrickCells cells;
      for (std::int64_t x = 0; x < n[0]; ++x)
        if (field_.read({x, y, z}, cells)) layer_[at(y * n[0] + x)] = label_brick(field_, cells, range_);
    });
  }

  // Parts of the layer get numbers behind those that are live.
  void take_numbers() {
    for (LabelledBrick& brick : layer_) {
      for (const PossibleRecord& part : brick.possible_parts) {
        if (possible_.size() == no_part - 1)
          throw ResourceError("more than 2^32 parts at once; measure a smaller region");
        brick.possible_ids.push_back(possible_.add());
        records_.push_back(part);
      }
      for (SureRecord part : brick.sure_parts) {
        part.possible = brick.possible_ids[part.possible];
        brick.sure_ids.push_back(sure_.add());
        sure_records_.push_back(part);
      }
      brick.possible_parts = {};
      brick.sure_parts = {};
    }
  }

  void find_points(std::int64_t z) {
    const MixedVolume& v = field_.volume();
    const Index3 n = field_.bricks().along();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Vec3& p = options_.points[i];
      const Index3 b = brick_at(v, p);
      if (b[2] != z || !field_.region().holds_point(p, p)) continue;
      const LabelledBrick& brick = layer_[at(b[1] * n[0] + b[0])];
      if (brick.possible.none()) continue;
      Index3 cell{};
      for (std::size_t a = 0; a < 3; ++a) {
        const double place =
            (p[a] - v.grid.origin[a]) / v.grid.spacing[a] - static_cast<double>(b[a] * v.granularity);
        cell[a] = std::clamp<std::int64_t>(
            static_cast<std::int64_t>(std::floor(std::ldexp(place, brick.per_cell[a]))), 0,
            brick.count[a] - 1);
      }
      const std::size_t number = brick.cell(cell[0], cell[1], cell[2]);
      if (const std::uint32_t label = brick.possible(number); label != no_part)
        points_[i].possible.part = brick.possible_ids[label];
      if (const std::uint32_t label = brick.sure(number); label != no_part) {
        points_[i].sure.part = brick.sure_ids[label];
        points_[i].surely = true;
      }
    }
  }

  void join_layer() {
    const Index3 n = field_.bricks().along();
    const auto join = [&](const std::vector<LabelledBrick>& other, std::int64_t x, std::int64_t y,
                          const LabelledBrick& brick) {
      if (x < 0 || y < 0 || x >= n[0] || y >= n[1]) return;
      join_bricks(field_, other[at(y * n[0] + x)], brick, possible_, sure_);
    };
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x) {
        const LabelledBrick& brick = layer_[at(y * n[0] + x)];
        if (brick.possible.none()) continue;
        join(layer_, x - 1, y, brick);
        for (std::int64_t dx = -1; dx <= 1; ++dx) join(layer_, x + dx, y - 1, brick);
        if (before_.empty()) continue;
        for (std::int64_t dy = -1; dy <= 1; ++dy)
          for (std::int64_t dx = -1; dx <= 1; ++dx) join(before_, x + dx, y + dy, brick);
      }
    before_.clear();
  }

  // Parts that do not reach into the layer are whole: they go into the table. The others are numbered anew.
  void end_parts() {
    std::vector<std::uint32_t> live(possible_.size(), no_part), sure_live(sure_.size(), no_part);
    UnionFind next, next_sure;
    for (LabelledBrick& brick : layer_) {
      renumber(brick.possible_ids, possible_, live, next);
      renumber(brick.sure_ids, sure_, sure_live, next_sure);
    }
    merge(records_, possible_);
    merge(sure_records_, sure_);
    const std::vector<std::int64_t> sure_ended = end_sure(sure_live, live, next_sure);
    const std::vector<std::int64_t> ended = end_possible(live, next);
    for (FollowedPoint& p : points_) {
      p.possible.follow(live, ended, possible_);
      p.sure.follow(sure_live, sure_ended, sure_);
    }
    possible_ = std::move(next);
    sure_ = std::move(next_sure);
  }
  static void renumber(std::vector<std::uint32_t>& ids, UnionFind& all, std::vector<std::uint32_t>& live,
                       UnionFind& next) {
    for (std::uint32_t& id : ids) {
      std::uint32_t& number = live[all.root(id)];
      if (number == no_part) number = next.add();
      id = number;
    }
  }
  template <class Record>
  static void merge(std::vector<Record>& records, UnionFind& all) {
    for (std::uint32_t i = 0; i < records.size(); ++i)
      if (const std::uint32_t root = all.root(i); root != i) records[root] += records[i];
  }
  // Sure parts that end are counted where they lie.
  std::vector<std::int64_t> end_sure(const std::vector<std::uint32_t>& sure_live,
                                     const std::vector<std::uint32_t>& live, const UnionFind& next) {
    std::vector<std::int64_t> ended(sure_.size(), -1);
    std::vector<SureRecord> kept(next.size());
    for (std::uint32_t i = 0; i < sure_records_.size(); ++i) {
      if (sure_.root(i) != i) continue;
      SureRecord part = sure_records_[i];
      const std::uint32_t owner = possible_.root(part.possible);
      if (sure_live[i] != no_part) {
        part.possible = live[owner];
        kept[sure_live[i]] = part;
        continue;
      }
      ended[i] = sure_parts_++;
      PossibleRecord& of = records_[owner];
      ++of.sure_parts;
      for (unsigned a = 0; a < 3; ++a)
        if ((part.touches >> (2 * a) & 3u) == 3u)
          of.sure_spans = static_cast<std::uint8_t>(of.sure_spans | 1u << a);
    }
    sure_records_ = std::move(kept);
    return ended;
  }
  std::vector<std::int64_t> end_possible(const std::vector<std::uint32_t>& live, const UnionFind& next) {
    std::vector<std::int64_t> ended(possible_.size(), -1);
    std::vector<PossibleRecord> kept(next.size());
    for (std::uint32_t i = 0; i < records_.size(); ++i) {
      if (possible_.root(i) != i) continue;
      if (live[i] != no_part) kept[live[i]] = records_[i];
      else {
        ended[i] = table_.possible;
        finish(records_[i]);
      }
    }
    records_ = std::move(kept);
    return ended;
  }

  void finish(const PossibleRecord& r) {
    MeasuredComponent row;
    row.volume = outward(r.volume);
    for (std::size_t a = 0; a < 3; ++a) {
      row.box[a] = r.low[a];
      row.box[a + 3] = r.high[a];
      const bool may = (r.touches >> (2 * a) & 3u) == 3u, does = (r.sure_spans >> a & 1u) != 0;
      row.spans[a] = does ? Answer::yes : may ? Answer::maybe : Answer::no;
    }
    row.sure_parts = r.sure_parts;
    ++table_.possible;
    certain_.push_back(row.certain());
    table_.volume.lo += row.volume.lo;
    table_.volume.hi += row.volume.hi;
    if (row.certain()) ++table_.certain;
    else {
      table_.uncertain_volume += row.volume.hi;
      table_.largest_uncertain = std::max(table_.largest_uncertain, row.volume.hi);
    }
    if (row.volume.hi >= options_.least_volume) table_.rows.push_back(row);
  }

  void require_room() const {
    if (options_.max_memory_bytes == 0) return;
    std::uint64_t bytes =
        table_.rows.capacity() * sizeof(MeasuredComponent) +
        2 * (records_.capacity() * sizeof(PossibleRecord) + sure_records_.capacity() * sizeof(SureRecord));
    for (const LabelledBrick& brick : layer_) bytes += 2 * brick.bytes();
    if (bytes > options_.max_memory_bytes)
      throw ResourceError(fmt::format(
          "components: {} rows so far, and two layers of bricks, take {} MiB of `max_memory`, of which "
          "{} MiB are left; leave out small ones by `least_volume`, or measure a smaller region",
          table_.rows.size(), bytes >> 20, options_.max_memory_bytes >> 20));
  }

  ComponentTable table() {
    table_.volume = outward(table_.volume);
    table_.sure_parts = sure_parts_;
    for (const FollowedPoint& p : points_) {
      ComponentOfPoint out;
      out.possible = p.possible.number;
      out.certain = out.possible && certain_[at(*out.possible)];
      out.sure = p.sure.number;
      out.within = p.surely ? Answer::yes : out.possible ? Answer::maybe : Answer::no;
      table_.points.push_back(out);
    }
    std::stable_sort(
        table_.rows.begin(), table_.rows.end(),
        [](const MeasuredComponent& a, const MeasuredComponent& b) { return a.volume.hi > b.volume.hi; });
    return std::move(table_);
  }

  const Field& field_;
  const ValueRange& range_;
  const ComponentsOptions& options_;
  std::vector<LabelledBrick> before_, layer_;
  UnionFind possible_, sure_;
  std::vector<PossibleRecord> records_;
  std::vector<SureRecord> sure_records_;
  std::vector<FollowedPoint> points_;
  std::int64_t sure_parts_ = 0;
  std::vector<bool> certain_;  // by the number of a possible component
  ComponentTable table_;
};

}  // namespace

ComponentTable measure_components(const Field& field, const ValueRange& range,
                                  const ComponentsOptions& options, const Progress& progress) {
  require_range(range);
  if (!(options.least_volume >= 0) || !std::isfinite(options.least_volume))
    throw InputError(fmt::format("least_volume: {} is negative or not finite", options.least_volume));
  return Components(field, range, options).run(progress);
}

}  // namespace vdvr::measured
