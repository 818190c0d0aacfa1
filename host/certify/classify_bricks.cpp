// The node test at several rates of gold.
#include "host/certify/classify_bricks.hpp"

#include <algorithm>

#include "host/base/system/casts.hpp"
#include "host/volume/bricks.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// Of the tolerance: a brick whose coarse slack takes more is not measured on coarse gold once it is refined,
// since levels pay for what that takes. The smaller projection term of cone beam makes more bricks easy.
constexpr double easy_share = 0.48, easy_share_of_cone = 0.4;
// Of the bricks: how many at most the search for the largest error measures again at once.
constexpr std::size_t sharpened_share = 32;

// Whether a field of that level is trilinear in every cell of this gold.
bool resolves(const GoldStream& gold, const LevelTriple& level) {
  const LevelTriple finest = gold.settings().finest();
  return level[0] <= finest[0] && level[1] <= finest[1] && level[2] <= finest[2];
}

bool passes(const BrickMeasure& m, double tolerance) {
  return m.total < 0 || static_cast<double>(m.total) <= tolerance;
}

}  // namespace

CellBox cells_of_finer(CellBox open) {
  const auto twice = [](std::int16_t n) {
    return static_cast<std::int16_t>(std::min<int>(2 * std::max<int>(n, 0), INT16_MAX));
  };
  std::transform(open.first.begin(), open.first.end(), open.first.begin(), twice);
  std::transform(open.end.begin(), open.end.end(), open.end.begin(), twice);
  return open;
}

// Cells that only the coarser gold tested hold no point of which a certificate speaks.
BrickMeasure on_finer_too(const BrickMeasure& before, BrickMeasure now) {
  now.total = std::clamp(std::max(now.total, before.passed), 0.0f, before.total);
  now.passed = std::max(now.passed, before.passed);
  now.error = std::max(now.error, before.error);
  return now;
}

Verdict verdict_of(const BrickMeasure& m, double tolerance) {
  // Each rate's total bounds |V - F|: what passes here has passed.
  if (passes(m, tolerance)) return Verdict::within;
  return static_cast<double>(m.error) > tolerance ? Verdict::beyond : Verdict::undecided;
}

ClassifyBricks::ClassifyBricks(JournalledRates& gold, OpenBricks& bricks, HostMemory& host, Progress progress,
                               Refuse refuse)
    : bricks_(bricks),
      host_(host),
      fine_(gold.fine),
      coarse_(gold.coarse),
      finer_(gold.finer),
      progress_(progress),
      whole_progress_(std::move(progress)),
      refuse_(std::move(refuse)) {}

bool ClassifyBricks::is_easy(std::size_t brick, double tolerance) const {
  const double share = fine_.gold().source()->kept.of_cone_beam() ? easy_share_of_cone : easy_share;
  return coarse_slack_[brick] >= 0 && static_cast<double>(coarse_slack_[brick]) <= share * tolerance;
}

void ClassifyBricks::classify(const DeviceField& base, const NodeTolerance& tolerance,
                              const std::vector<std::uint8_t>& near) {
  // Nothing of an earlier attempt stays: its levels are of another tolerance, or of another lattice.
  host_.uncount(tile_bytes_);
  tile_bytes_ = 0;
  bounds_ = {};
  bricks_.level.assign(bricks_.level.size(), LevelTriple{0, 0, 0});
  bricks_.involved.assign(bricks_.level.size(), 0);
  bricks_.samples.clear();
  measures_.assign(bricks_.level.size(), {});
  along_.assign(bricks_.level.size(), {});
  coarse_slack_.assign(bricks_.level.size(), -1.0f);
  for_each_band(near,
                [&](const std::vector<std::uint8_t>& of_band) { classify_band(base, tolerance, of_band); });
}

// Whole blocks of each rate, so that a block is the same in a band as in all.
void ClassifyBricks::for_each_band(const std::vector<std::uint8_t>& selected, const Work& work) {
  const GoldStream& fine = fine_.gold();
  const Bricks bricks(bricks_.grid, bricks_.granularity);
  const Index3 n = bricks.along();
  const std::int64_t block = coarse_ ? coarse_->gold().block_bricks()[2] : fine.block_bricks()[2];
  const std::int64_t cells = fine.source()->kept.cells_together(),
                     band = std::max<std::int64_t>(1, cells / bricks_.granularity / block) * block;
  for (std::int64_t first = 0; first < n[2]; first += band) {
    const std::int64_t last = std::min(n[2], first + band), layer = n[0] * n[1];
    std::vector<std::uint8_t> of_band(selected.size(), 0);
    std::copy(selected.begin() + first * layer, selected.begin() + last * layer,
              of_band.begin() + first * layer);
    progress_ = [&, first, last](const std::string& stage, double share) {
      report(whole_progress_, stage,
             (static_cast<double>(first) + share * static_cast<double>(last - first)) /
                 static_cast<double>(n[2]));
    };
    work(of_band);
  }
  progress_ = whole_progress_;
}

void ClassifyBricks::classify_band(const DeviceField& base, const NodeTolerance& tolerance,
                                   const std::vector<std::uint8_t>& near) {
  std::vector<std::uint8_t> refined = near;
  if (coarse_) {
    screen(base, tolerance, near, refined);
    std::vector<std::uint8_t> easy = refined, hard = refined;
    for (std::size_t i = 0; i < easy.size(); ++i) {
      easy[i] = refined[i] && is_easy(i, tolerance.of(i));
      hard[i] = refined[i] && !easy[i];
    }
    refine(*coarse_, base, tolerance, easy, GoldStream::For::samples);
    refine(*coarse_, base, tolerance, hard, GoldStream::For::proposing);
    for (std::size_t i = 0; i < easy.size(); ++i)
      if (is_above_base(bricks_.level[i])) refined[i] = 0;
  }
  refine(fine_, base, tolerance, refined, GoldStream::For::samples);
}

// Level 0: what each rate leaves undecided, the next one tests. Those that none passes stay in `refined`.
void ClassifyBricks::screen(const DeviceField& base, const NodeTolerance& tolerance,
                            const std::vector<std::uint8_t>& near, std::vector<std::uint8_t>& refined) {
  std::vector<JournalledGold*> rates{&*coarse_, &fine_};
  if (finer_) rates.push_back(&*finer_);
  std::vector<std::uint8_t> open = near;
  std::vector<BrickMeasure> fine(near.size());
  std::vector<CellBox> cells;
  for (JournalledGold* gold : rates) {
    std::vector<std::uint8_t> undecided(near.size(), 0);
    std::vector<CellBox> failing(near.size());
    test(*gold, base, tolerance, open, std::move(cells), [&](BrickLevels l) {
      const std::size_t id = at(l.base.brick);
      if (gold == &*coarse_) coarse_slack_[id] = l.base.slack;
      else l.base = fine[id] = gold == &fine_ ? l.base : on_finer_too(fine[id], l.base);
      const Verdict verdict = verdict_of(l.base, tolerance.of(id));
      undecided[id] = verdict == Verdict::undecided;
      failing[id] = cells_of_finer(l.base.open);
      if (verdict != Verdict::within) return;
      refined[id] = 0;
      take(l, true);
    });
    open = std::move(undecided);
    // The plan's own gold tests whole bricks: its nodes tell the largest error.
    if (gold != &*coarse_) cells = std::move(failing);
  }
}

// Level 0 only.
void ClassifyBricks::test(JournalledGold& gold, const DeviceField& base, const NodeTolerance& tolerance,
                          const std::vector<std::uint8_t>& selected, std::vector<CellBox> cells,
                          const std::function<void(const BrickLevels&)>& visit) {
  BlockPass pass;
  pass.cells = std::move(cells);
  pass.ask = BlockPass::Ask::test;
  pass.tolerance = tolerance;
  pass.selected = selected;
  gold.run(
      std::move(pass), &base, [&](ByteReader in) { read_levels(in, visit); }, progress_, "screen");
}

// Levels above 0, with their tiles. On coarse gold only levels that it can test are taken. What is proposed
// is measured on fine gold later, as every refined brick that coarse gold does not pass.
void ClassifyBricks::refine(JournalledGold& gold, const DeviceField& base, const NodeTolerance& tolerance,
                            const std::vector<std::uint8_t>& selected, GoldStream::For purpose) {
  BlockPass pass;
  pass.ask = BlockPass::Ask::classify;
  pass.fine = &gold == &fine_;
  pass.purpose = purpose;
  pass.tolerance = tolerance;
  pass.selected = selected;
  const BlockPass asked = pass;
  gold.run(
      std::move(pass), &base,
      [&](ByteReader in) {
        read_levels(in, [&](const BrickLevels& l) {
          if (!is_taken(asked, l)) return;
          if (asked.fine && l.base.total >= 0 &&
              !(static_cast<double>(l.base.slack) <= tolerance.of(at(l.base.brick))))
            refuse_(l.base.slack, tolerance.of(at(l.base.brick)));
          take(l, purpose != GoldStream::For::proposing);
        });
        take_tiles(in);
      },
      progress_, "classify");
}

void ClassifyBricks::take(const BrickLevels& l, bool is_bound) {
  const BrickMeasure& m = l.base;
  const std::size_t id = at(m.brick);
  bricks_.involved.at(id) = m.total >= 0;
  if (m.total < 0) return;
  measures_[id] = m;
  bricks_.level[id] = l.level;
  along_[id] = l.along;
  if (is_bound) take_slack(m);
}

void ClassifyBricks::take_slack(const BrickMeasure& m) {
  if (m.total < 0) return;
  const auto slack = static_cast<double>(m.slack);
  bounds_.total = std::max(bounds_.total, slack);
  bounds_.projection = fine_.gold().projection();
  bounds_.gold = std::max(bounds_.gold, slack - bounds_.projection);
}

std::vector<std::int64_t> ClassifyBricks::take_tiles(ByteReader& in) {
  std::vector<std::int64_t> bricks;
  std::vector<LevelTriple> levels;
  std::vector<float> samples;
  in(bricks, levels, samples);
  const float* next = samples.data();
  const float* const end = next + samples.size();
  const MixedVolume shape = bricks_.shape();
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    const std::int64_t size = shape.tile_size(levels.at(i));
    if (size > end - next) throw FileError("a journal record lacks samples; start without `resume`");
    bricks_.samples.put(at(bricks[i]), std::span(next, next + size));
    next += size;
  }
  const std::uint64_t now = bricks_.samples.memory_bytes();
  host_.count(now - tile_bytes_, "the tiles before closing");
  tile_bytes_ = now;
  return bricks;
}

void ClassifyBricks::extract(const std::vector<std::uint8_t>& raised) {
  BlockPass pass;
  pass.ask = BlockPass::Ask::extract;
  pass.purpose = GoldStream::For::samples;
  pass.selected = raised;
  pass.level = bricks_.level;
  fine_.run(
      std::move(pass), nullptr,
      [&](ByteReader in) {
        for (const std::int64_t brick : take_tiles(in)) along_[at(brick)] = in.get<AxisErrors>();
      },
      progress_, "repair");
}

void ClassifyBricks::measure_at(JournalledGold& gold, const DeviceField& field,
                                const NodeTolerance& tolerance, const std::vector<std::uint8_t>& selected,
                                const std::string& stage, std::vector<CellBox> cells,
                                const std::function<void(const BrickMeasure&)>& visit) {
  BlockPass pass;
  pass.cells = std::move(cells);
  pass.ask = BlockPass::Ask::measure;
  pass.tolerance = tolerance;
  pass.selected = selected;
  gold.run(
      std::move(pass), &field,
      [&](ByteReader in) {
        while (!in.empty()) visit(in.get<BrickMeasure>());
      },
      progress_, stage);
}

void ClassifyBricks::measure(const DeviceField& field, const std::vector<LevelTriple>& stored,
                             const NodeTolerance& tolerance, const std::vector<std::uint8_t>& pending,
                             const std::string& stage) {
  for_each_band(pending, [&](const std::vector<std::uint8_t>& of_band) {
    measure_band(field, stored, tolerance, of_band, stage);
  });
}

void ClassifyBricks::measure_band(const DeviceField& field, const std::vector<LevelTriple>& stored,
                                  const NodeTolerance& tolerance, const std::vector<std::uint8_t>& pending,
                                  const std::string& stage) {
  std::vector<std::uint8_t> rest = pending;
  if (coarse_) {
    // The test needs V to be trilinear in every cell of gold. Closing may have raised a brick's own level.
    std::vector<std::uint8_t> easy = pending;
    for (std::size_t i = 0; i < easy.size(); ++i)
      easy[i] = easy[i] && resolves(coarse_->gold(), stored.at(i)) && is_easy(i, tolerance.of(i));
    measure_at(*coarse_, field, tolerance, easy, stage, {}, [&](const BrickMeasure& m) {
      if (verdict_of(m, tolerance.of(at(m.brick))) != Verdict::within) return;
      measures_.at(at(m.brick)) = m;
      take_slack(m);
      rest[at(m.brick)] = 0;
    });
  }
  std::vector<JournalledGold*> rates{&fine_};
  if (finer_) rates.push_back(&*finer_);
  std::vector<CellBox> cells;
  for (JournalledGold* gold : rates) {
    std::vector<std::uint8_t> undecided(pending.size(), 0);
    std::vector<CellBox> failing(pending.size());
    measure_at(*gold, field, tolerance, rest, stage, std::move(cells), [&](const BrickMeasure& m) {
      BrickMeasure& known = measures_.at(at(m.brick));
      known = gold == &fine_ ? m : on_finer_too(known, m);
      take_slack(m);
      undecided[at(m.brick)] = verdict_of(known, tolerance.of(at(m.brick))) == Verdict::undecided;
      failing[at(m.brick)] = cells_of_finer(m.open);
    });
    rest = std::move(undecided);
    cells = std::move(failing);
  }
}

void ClassifyBricks::sharpen(const DeviceField& field, const NodeTolerance& tolerance) {
  if (!coarse_) return;
  const int rate = fine_.gold().settings().rate;
  for (;;) {
    float error = 0;
    std::vector<std::size_t> loose;
    for (std::size_t i = 0; i < measures_.size(); ++i)
      if (measures_[i].rate >= rate) error = std::max(error, measures_[i].error);
    for (std::size_t i = 0; i < measures_.size(); ++i)
      if (measures_[i].rate < rate && measures_[i].total > error) loose.push_back(i);
    if (loose.empty()) return;
    const std::size_t most =
        std::min(loose.size(), std::max<std::size_t>(64, measures_.size() / sharpened_share));
    std::partial_sort(loose.begin(), loose.begin() + static_cast<std::ptrdiff_t>(most), loose.end(),
                      [&](std::size_t a, std::size_t b) { return measures_[a].total > measures_[b].total; });
    std::vector<std::uint8_t> selected(measures_.size(), 0);
    for (std::size_t i = 0; i < most; ++i) selected[loose[i]] = 1;
    measure_at(fine_, field, tolerance, selected, "verify", {}, [&](const BrickMeasure& m) {
      // Either test bounds |V - F|.
      BrickMeasure& known = measures_.at(at(m.brick));
      const float total = std::min(known.total, m.total < 0 ? known.total : m.total);
      known = m;
      known.total = std::max(total, 0.0f);
    });
  }
}

}  // namespace vdvr
