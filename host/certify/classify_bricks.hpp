// Levels of bricks by the node test, and the measure of stored fields, at several rates of gold
// (docs/error-bounds.md, section 14).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/base/opencl/host_memory.hpp"
#include "host/certify/closing/open_bricks.hpp"
#include "host/certify/crew/journalled_gold.hpp"
#include "host/certify/gold/gold_batch.hpp"

namespace vdvr {

enum class Verdict { within, beyond, undecided };
/// Of a field measured at one rate of gold. Beyond: at one of its nodes, which are nodes of finer gold too.
Verdict verdict_of(const BrickMeasure& m, double tolerance);
/// The box of a brick's failing cells on gold of twice the rate.
CellBox cells_of_finer(CellBox open);
/// A brick that was measured on finer gold than before, in the box of the cells that failed there.
BrickMeasure on_finer_too(const BrickMeasure& before, BrickMeasure now);

class ClassifyBricks {
 public:
  /// What the passes learn besides the levels.
  struct Bounds {
    double total = 0;       ///< largest T + P of a tested node
    double projection = 0;  ///< largest P
    double gold = 0;        ///< largest T
  };
  /// Called with the slack of a brick that even gold cannot bring within the tolerance.
  using Refuse = std::function<void(float slack, double tolerance)>;

  /// All but `progress` is referred to. `bricks`: levels, involved and tiles are written.
  ClassifyBricks(JournalledRates& gold, OpenBricks& bricks, HostMemory& host, Progress progress,
                 Refuse refuse);

  /// Levels and tiles of the bricks `near`, by |interpolant - F| <= tolerance at every tested node; those
  /// that stay at level 0 are measured on the stored base samples, which closing does not change.
  void classify(const DeviceField& base, const NodeTolerance& tolerance,
                const std::vector<std::uint8_t>& near);

  /// Measures a closed field, of the levels `stored`, on the bricks `pending`.
  void measure(const DeviceField& field, const std::vector<LevelTriple>& stored,
               const NodeTolerance& tolerance, const std::vector<std::uint8_t>& pending,
               const std::string& stage);

  /// Tiles anew for bricks whose level rose.
  void extract(const std::vector<std::uint8_t>& raised);

  /// Measures on the fine gold the bricks whose coarse total is above every error seen, until none is: then
  /// the largest error is that of all fine nodes.
  void sharpen(const DeviceField& field, const NodeTolerance& tolerance);

  [[nodiscard]] const std::vector<BrickMeasure>& measures() const { return measures_; }
  /// By brick; of those refined, with levels per axis.
  [[nodiscard]] const std::vector<AxisErrors>& along() const { return along_; }
  [[nodiscard]] const Bounds& bounds() const { return bounds_; }
  /// Whether a brick is measured on coarse gold first.
  [[nodiscard]] bool is_easy(std::size_t brick, double tolerance) const;

 private:
  /// Bricks along z that share heights of kept gold, and calls `work` for each run of them with those of
  /// `selected` that lie in it.
  using Work = std::function<void(const std::vector<std::uint8_t>& selected)>;
  void for_each_band(const std::vector<std::uint8_t>& selected, const Work& work);
  void classify_band(const DeviceField& base, const NodeTolerance& tolerance,
                     const std::vector<std::uint8_t>& near);
  void screen(const DeviceField& base, const NodeTolerance& tolerance, const std::vector<std::uint8_t>& near,
              std::vector<std::uint8_t>& refined);
  void measure_band(const DeviceField& field, const std::vector<LevelTriple>& stored,
                    const NodeTolerance& tolerance, const std::vector<std::uint8_t>& pending,
                    const std::string& stage);
  void test(JournalledGold& gold, const DeviceField& base, const NodeTolerance& tolerance,
            const std::vector<std::uint8_t>& selected, std::vector<CellBox> cells,
            const std::function<void(const BrickLevels&)>& visit);
  void refine(JournalledGold& gold, const DeviceField& base, const NodeTolerance& tolerance,
              const std::vector<std::uint8_t>& selected, GoldStream::For purpose);
  void measure_at(JournalledGold& gold, const DeviceField& field, const NodeTolerance& tolerance,
                  const std::vector<std::uint8_t>& selected, const std::string& stage,
                  std::vector<CellBox> cells, const std::function<void(const BrickMeasure&)>& visit);
  void take(const BrickLevels& levels, bool is_bound);
  void take_slack(const BrickMeasure& measure);
  std::vector<std::int64_t> take_tiles(ByteReader& in);  // of which bricks

  OpenBricks& bricks_;
  HostMemory& host_;
  JournalledGold& fine_;
  std::optional<JournalledGold>&coarse_, &finer_;
  Progress progress_, whole_progress_;  // of a band, of all
  Refuse refuse_;
  std::vector<BrickMeasure> measures_;
  std::vector<AxisErrors> along_;
  std::vector<float> coarse_slack_;  // by brick; negative: not known
  Bounds bounds_;
  std::uint64_t tile_bytes_ = 0;  // counted of bricks_.samples
};

}  // namespace vdvr
