// Gold where it determines the field: at twice the detector's columns across z and at its rows along z,
// back-projected once; gold at every other node is interpolated from there with a bound
// (docs/error-bounds.md, section 3).
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "host/base/opencl/host_memory.hpp"
#include "host/certify/bounds/projection_bounds.hpp"
#include "host/certify/kept/common_gold.hpp"
#include "host/certify/kept/cone_tiles.hpp"
#include "host/certify/kept/gold_filters.hpp"
#include "host/certify/kept/interpolate_gold.hpp"
#include "host/field/fbp/coverage.hpp"
#include "host/field/fbp/filter_projections.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/rates.hpp"

namespace vdvr {

/// Nodes of gold against kept ones, per axis: so many for each kept one, or every so manieth of these.
struct GoldLattice {
  std::array<int, 3> phases{1, 1, 1}, step{1, 1, 1};
};

/// Bounds at the nodes of a lattice, in the units of the field. F^ is the field of the computed filtered
/// samples.
struct GoldErrors {
  double interpolation = 0;         ///< of a node of gold from F^, by six taps in u and by the filters
  double rounding = 0;              ///< alike, by fp32 from the upsampled columns on
  double curved_interpolation = 0;  ///< what that adds to an eighth of the three second differences at a node
  double curved_rounding = 0;
  double ramp = 0;  ///< of F^ from F, anywhere
};

/// A rectangle across z, world units.
struct PlanePart {
  std::array<double, 2> low{}, high{};
  bool operator==(const PlanePart&) const = default;
};

/// A box of nodes of a lattice: node 0 is the grid's first sample.
struct GoldBox {
  Index3 first{}, nodes{};
};

class KeptGold {
 public:
  /// Kept for nodes of a coverage margin of at least -`reach` (world units). All but the numbers is referred
  /// to. Rates of the grid's own lattice follow from its spacing and the detector's pitch. `heights_bytes`:
  /// of heights that cells_together() of every column share.
  KeptGold(opencl::State& state, const FilteredScan& scan, const FieldSups& sups, const Grid& grid,
           double reach, int upsampling, Interpolation interpolation,
           std::uint64_t heights_bytes = std::uint64_t{1} << 30);

  /// Kept nodes to a cell of the grid, by axis: powers of two, so that their spacing is at most half a pixel.
  [[nodiscard]] const Index3& rates() const { return rates_; }
  /// At least |F| wherever nodes are kept.
  [[nodiscard]] double sup() const { return cone_ ? cone_->sup() : sups_.value; }
  /// How far outside the covered region gold of cone beam has the bounds of errors(), by axis. Farther out,
  /// where a view's source may be near, it is only finite.
  [[nodiscard]] Vec3 claimed() const;
  [[nodiscard]] bool of_cone_beam() const { return cone_.has_value(); }
  /// In u.
  [[nodiscard]] Interpolation interpolation() const { return interpolation_; }
  /// Of gold at `rate` of a grid with the same origin whose cells are powers of two of this one's. Throws
  /// std::logic_error where they are not.
  [[nodiscard]] GoldLattice lattice(const Grid& grid, int rate) const;
  /// Cost: milliseconds for each new ratio.
  [[nodiscard]] GoldErrors errors(const GoldLattice& lattice);
  /// What the `interpolation` of these may be in a file whose cone beam has such taps: this program's, and
  /// those of earlier ones.
  [[nodiscard]] std::vector<double> interpolation_by(Interpolation taps, const GoldLattice& lattice);
  /// What fourth differences of gold on that lattice err, xx, yy, zz, xy, xz, yz: of F^, rounding included.
  [[nodiscard]] std::array<double, 6> fourth_errors(const GoldLattice& lattice);
  /// The least and the most that `rounding` of these would be: on this device whatever memory allows, which
  /// of cone beam says how many views lie there together; else on any, with double precision or without; and
  /// of earlier programs. Of files with six taps only the least is known.
  [[nodiscard]] std::pair<double, double> rounding_elsewhere(const GoldLattice& lattice, bool this_device,
                                                             Interpolation taps);

  /// How all that can be kept would lie in memory that other devices of this machine have too; none where
  /// this device does not compute in the host's memory, where it would take most of what is left, or where
  /// gold is kept in another way.
  [[nodiscard]] std::optional<CommonGold::Shape> common_shape() const;
  /// From the next prepare() on, all is made together with those who have that memory, once, and lies there.
  /// `leads`: nobody else has it yet, and what is kept already is given to all. Does nothing where those who
  /// have it keep other gold.
  void share(CommonMemory memory, bool leads);

  /// Back-projects what `boxes` will read and is not kept yet; where that is most of what can be kept, all of
  /// it, since the columns of the detector are upsampled anew each time. Throws ResourceError where memory
  /// does not suffice. Cost: views * 6 multiply-adds a kept sample, and the upsampled columns of all rows.
  void prepare(const GoldLattice& lattice, const std::vector<GoldBox>& boxes, const Progress& progress);

  /// From now on, of cone beam, prepare() makes what boxes read and no more of their tiles: for those who ask
  /// for some places. Nodes are the same to the bit.
  void make_only_what_is_read() { sparing_ = cone_.has_value(); }
  /// Of cone beam, that are summed up together: as memory allows, or as another device does. Else 0.
  [[nodiscard]] std::int64_t views_together() const { return cone_ ? cone_->views_together() : 0; }
  void take_views_together(std::int64_t views) {
    if (cone_) cone_->take_views_together(views);
  }
  /// Then the next prepare() that misses anything makes that for these boxes too: its views are upsampled
  /// once.
  void will_read(const GoldLattice& lattice, const std::vector<GoldBox>& boxes);

  /// float out[box][y][x][stride] from `first` on, `apart` floats from box to box: gold at the nodes of boxes
  /// that were prepared; its z is padded to a multiple of 16. Nodes beyond `reach` hold anything finite. The
  /// boxes are equal, begin at the same height, and at the same node of an interval of kept ones; throws
  /// std::logic_error where they do not. Enqueues.
  void fill(const GoldLattice& lattice, std::span<const GoldBox> boxes, const opencl::DeviceArray<float>& out,
            std::uint64_t first, std::uint64_t apart, std::int64_t stride);
  void fill(const GoldLattice& lattice, const GoldBox& box, const opencl::DeviceArray<float>& out,
            std::uint64_t first, std::int64_t stride) {
    fill(lattice, std::span<const GoldBox>(&box, 1), out, first, 0, stride);
  }

  /// Cells of the grid along z whose heights, made of all rows, take `heights_bytes` where every column of
  /// the grid is asked for; all where rows are few. Follows from scan and grid, not from the memory that is
  /// left: journals count passes.
  [[nodiscard]] std::int64_t cells_together() const;

  /// Seconds of all calls of prepare; of these, for the columns of the detector (of cone beam, whose views
  /// are upsampled anew each time, of one call) and for the tiles; kept tiles, and how many tiles boxes would
  /// add.
  [[nodiscard]] double prepare_seconds() const { return prepare_seconds_; }
  [[nodiscard]] double column_seconds() const { return column_seconds_; }
  [[nodiscard]] double tile_seconds() const { return tile_seconds_; }
  [[nodiscard]] std::int64_t tiles() const { return static_cast<std::int64_t>(tiles_.size()); }
  /// Of all tiles, with the heights made of them.
  [[nodiscard]] std::uint64_t bytes() const;
  [[nodiscard]] std::int64_t missing(const GoldLattice& lattice, const std::vector<GoldBox>& boxes) const;

  /// For estimates, before anything is prepared: nodes outside of that part hold 0. What prepare() finds
  /// missing it then makes for the whole part.
  void keep_only(const PlanePart& part) { part_ = part; }
  /// Where there is a part: how many times its columns, and its tiles, all would take.
  struct Shares {
    double columns = 1, tiles = 1;
  };
  [[nodiscard]] Shares all_over_part();

 private:
  /// Rows of the detector up to which gold's heights are products with all of them: beyond, heights at half a
  /// pixel and filters between them are the cheaper.
  static constexpr std::int64_t most_few_rows = 32;
  /// Kept nodes of a tile's side: positions in u are relative to its middle.
  static constexpr std::int64_t side = 32;
  /// Bytes of the tiles that are made together, which share one allocation.
  static constexpr std::uint64_t page_bytes = std::uint64_t{128} << 20;
  /// Kept heights around those asked for: boxes of other halos will read them.
  static constexpr std::int64_t run_margin = 32;

  /// The quotient rounded down.
  static constexpr std::int64_t floor_div(std::int64_t a, std::int64_t b) {
    return a >= 0 ? a / b : -((b - 1 - a) / b);
  }

  using TileAt = std::pair<std::int64_t, std::int64_t>;  // y, x
  // Nodes of a tile by axis, from its first column and the lowest height on: [low, end).
  struct PartOfTile {
    Index3 low{side, side, INT64_MAX}, end{};
    void add(const PartOfTile& other);
    [[nodiscard]] bool holds(const PartOfTile& other) const;
  };
  using PartsOfTiles = std::map<TileAt, PartOfTile>;
  struct Place {
    std::size_t page = 0;
    std::uint64_t first = 0;
  };
  // Along one axis: intervals of kept nodes, and the kept nodes that they read.
  struct Span {
    std::int64_t low = 0, count = 0;  // kept nodes read
    std::int64_t intervals = 0, skipped = 0;
  };
  [[nodiscard]] Span span(const GoldLattice& lattice, std::size_t axis, const GoldBox& box) const;
  /// Along z, in whole runs of products wherever the box begins.
  [[nodiscard]] Span heights_span(const GoldLattice& lattice, const GoldBox& box) const;
  [[nodiscard]] PartsOfTiles read_by(const GoldLattice& lattice, const std::vector<GoldBox>& boxes) const;
  [[nodiscard]] std::vector<TileAt> new_tiles(const GoldLattice& lattice,
                                              const std::vector<GoldBox>& boxes) const;
  [[nodiscard]] std::vector<TileAt> sparing_tiles(const GoldLattice& lattice,
                                                  const std::vector<GoldBox>& boxes);
  /// All within reach of the covered part of the grid.
  [[nodiscard]] std::vector<TileAt> all_tiles() const;
  [[nodiscard]] double margin_of(const TileAt& tile) const;
  /// Whether any node of it may be kept.
  [[nodiscard]] bool is_kept(const TileAt& tile) const;
  [[nodiscard]] std::vector<std::array<std::int32_t, 2>> wanted(const ColumnBlocks& blocks) const;
  [[nodiscard]] std::vector<std::array<std::int32_t, 4>> wanted(std::span<const TileAt> tiles,
                                                                const ColumnBlocks& blocks) const;
  [[nodiscard]] ColumnBlocks blocks_of(std::span<const TileAt> tiles) const;
  [[nodiscard]] UpsampledSlab upsampled(std::int64_t first, std::int64_t end);
  void back_project_tiles(std::span<const TileAt> tiles, const Progress& progress);
  void make_common(const Progress& progress);
  void make_common_heights(const Progress& progress);
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> all_heights() const;
  void begin_run(std::int64_t low, std::int64_t heights);
  const AcrossWeights& across_of(int phases, std::size_t axis);
  const GoldFilter& filter_of(int phases, std::size_t axis);
  void resample_heights(const GoldLattice& lattice, const GoldBox& box);
  void require_run(const Span& z);
  Place heights_of(const TileAt& tile, const Place& place);
  void want_heights(const Place& rows, const Place& heights);
  void make_heights();  // those that are wanted
  void take_heights(const GoldLattice& lattice, std::span<const GoldBox> boxes,
                    const opencl::DeviceArray<float>& out);
  void fill_together(const GoldLattice& lattice, std::span<const GoldBox> boxes,
                     const opencl::DeviceArray<float>& out, std::uint64_t first, std::uint64_t apart,
                     std::int64_t stride);
  [[nodiscard]] std::vector<double> rows_of(double first, double step, std::int64_t heights) const;
  [[nodiscard]] std::uint64_t run_bytes() const;
  [[nodiscard]] bool few_rows() const { return !cone_ && scan_.geometry.rows <= most_few_rows; }
  void set_spacing();
  void keep_heights(double reach);
  [[nodiscard]] ConeLattice cone_lattice(double reach) const;
  [[nodiscard]] double room_to_sources(double from, const std::pair<double, double>& heights) const;
  /// What gold of cone beam errs: kept nodes, each by itself; filters between them, and their rounding.
  struct ConeParts {
    ConeTiles::Errors kept;
    double filters = 0, rounding = 0;
  };
  ConeParts cone_parts(const GoldFilter& x, const GoldFilter& y, const GoldFilter& z);
  double norm_of_filters(const GoldLattice& lattice);
  GoldErrors cone_errors(const GoldLattice& lattice);
  GoldErrors parallel_errors(const GoldLattice& lattice, Fp64 fp64);
  void back_project_heights(std::span<const TileAt> tiles, const Progress& progress);
  opencl::DeviceArray<float>& heights_buffer(std::uint64_t count);
  /// Where the scan lies there and the device computes in the host's memory; else none.
  [[nodiscard]] std::shared_ptr<Scratch> scratch() const;

  opencl::State& state_;
  const FilteredScan& scan_;
  Upsampler upsampler_;
  const FieldSups& sups_;
  Grid grid_;
  double reach_;
  std::uint64_t heights_bytes_;
  Interpolation interpolation_;
  Index3 half_taps_{8, 8, 8};  // of filters between kept nodes, by axis
  Coverage coverage_;
  std::optional<PlanePart> part_;
  bool sparing_ = false;
  PartsOfTiles made_, to_be_read_;  // where sparing: of tiles that are kept; of those that will be asked for
  UpsampledColumns columns_;
  Index3 rates_{1, 1, 1};
  Vec3 spacing_{};  // of kept nodes; of the heights made of the rows, along z
  std::int64_t stride_ = 0;
  std::vector<opencl::DeviceArray<float>> pages_;
  std::map<TileAt, Place> tiles_;
  std::map<std::pair<int, std::size_t>, GoldFilter> filters_;
  std::map<std::pair<int, std::size_t>, AcrossWeights> across_;
  // Heights at half a pixel, tile by tile: all of them where memory allows, else a run that serves many
  // blocks.
  struct Run {
    std::int64_t low = 0, count = 0, stride = 0;
    std::optional<AlongZ> from_rows;
    std::vector<opencl::DeviceArray<float>> pages;  // of `a_page` tiles, the last one not yet full
    std::size_t a_page = 1, of_last = 0;            // and how many that has
    bool common = false;
    std::map<TileAt, Place> tiles;
    std::map<std::array<std::size_t, 2>, std::vector<VdvrColumns>> to_make;  // by pages of rows and heights
  };
  std::optional<Run> run_;  // of cone beam the kept nodes themselves, never made again
  std::optional<ConeTiles> cone_;
  // How the last box's heights come of these, or of all rows where they are few: blocks of a slab share that.
  struct Heights {
    std::int64_t first = 0, nodes = 0, padded = 0;
    int phases = 1, step = 1;
    std::optional<AlongZ> weights;
  };
  std::optional<Heights> heights_;
  opencl::DeviceArray<float> buffer_;  // gold's heights on kept columns, of boxes that are made together
  std::optional<CommonGold> common_;   // until it is made
  HostMemory common_bytes_;            // this device's part of it
  double column_seconds_ = 0, tile_seconds_ = 0, prepare_seconds_ = 0;
};

}  // namespace vdvr
