// Bricks that a lattice touches, the chunks of the file that hold their samples, and these in memory that
// takes room only where it is written.
#include "vdvr/expert/lazy_volume.hpp"

#include <fmt/format.h>
#include <sys/mman.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "host/base/system/casts.hpp"
#include "host/files/hdf5/hdf5_chunks.hpp"
#include "host/volume/bricks.hpp"
#include "host/volume/sampler/sample_box.hpp"
#include "host/volume/validate_volume.hpp"
#include "host/volume/vdvr_file.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

namespace h5 = io::hdf5;

/// Of a cell: what a point given by a spacing that is no power of two may miss its brick by.
constexpr double kFace = 1e-6;

/// n zeros that take addresses, and memory where they are written.
template <class T>
Samples<T> unwritten(std::uint64_t n, const std::string& what) {
  const std::uint64_t bytes = n * sizeof(T);
  void* const first =
      ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (first == MAP_FAILED) throw ResourceError(fmt::format("{}: no addresses for its {} bytes", what, bytes));
  std::shared_ptr<const void> owner(first, [bytes](void* p) { ::munmap(p, bytes); });
  return Samples<T>(std::span<T>(static_cast<T*>(first), n), std::move(owner));
}

void reserve(SampleBlock& b, const h5::Dataset& d) {
  if (b.type == SampleType::f32) b.f32 = unwritten<float>(d.count, d.name);
  else if (b.type == SampleType::u16) b.u16 = unwritten<std::uint16_t>(d.count, d.name);
  else b.u8 = unwritten<std::uint8_t>(d.count, d.name);
}

/// Samples of one tile of a block, where they lie.
SampleBlock view_of(SampleBlock& b, std::size_t tile, std::size_t first, std::size_t count) {
  SampleBlock view;
  view.type = b.type;
  const auto part = [&](auto& samples) { return std::span(samples.data() + first, count); };
  if (b.type == SampleType::f32) view.f32 = {part(b.f32), nullptr};
  else if (b.type == SampleType::u16) view.u16 = {part(b.u16), nullptr};
  else view.u8 = {part(b.u8), nullptr};
  if (b.type == SampleType::f32) return view;
  view.offset = {b.offset[tile]};
  view.shift = {b.shift[tile]};
  return view;
}

/// Which chunks of a dataset are in memory.
class Chunks {
 public:
  explicit Chunks(const h5::Dataset& d) : d_(&d) {
    std::uint64_t n = 1;
    for (std::size_t a = 0; a < d.shape.size(); ++a) {
      along_.push_back((d.shape[a] - 1) / d.chunk[a] + 1);
      n *= along_.back();
    }
    here_.resize(n);
  }

  /// Calls read(at) for each chunk that is not here and meets the box, half-open, of elements.
  void fetch(const h5::Shape& first, const h5::Shape& end,
             const std::function<void(const h5::Shape&)>& read) {
    h5::Shape at(first.size());
    visit(0, 0, first, end, at, read);
  }

 private:
  void visit(std::size_t axis, std::uint64_t number, const h5::Shape& first, const h5::Shape& end,
             h5::Shape& at, const std::function<void(const h5::Shape&)>& read) {
    if (axis == at.size()) {
      if (here_[number]) return;
      read(at);
      here_[number] = true;
      return;
    }
    const std::uint64_t side = d_->chunk[axis];
    for (std::uint64_t i = first[axis] / side; i * side < end[axis]; ++i) {
      at[axis] = i * side;
      visit(axis + 1, number * along_[axis] + i, first, end, at, read);
    }
  }

  const h5::Dataset* d_;
  std::vector<std::uint64_t> along_;
  std::vector<bool> here_;
};

}  // namespace

struct LazyVolume::State {
  VdvrParts parts;
  std::map<TileKind, Chunks> tiles;
  std::optional<Chunks> base;
  std::uint64_t limit = 0, resident = 0, bytes_read = 0;

  [[nodiscard]] MixedVolume& volume() { return parts.file.volume; }

  void read(const h5::Dataset& d, SampleBlock& b, const h5::Shape& at) {
    resident += d.chunk_bytes;
    if (limit != 0 && resident > limit)
      throw ResourceError(
          fmt::format("{}: the samples asked for so far take {} bytes of memory, {} are allowed: raise "
                      "`max_memory`, or open the "
                      "file anew",
                      d.name, resident, limit));
    void* const values = const_cast<void*>(b.data());
    if (const auto problem = h5::read_chunk(d, at, values, bytes_read))
      throw FileError(fmt::format("{}: cannot be read: {}; the file is damaged", d.name, *problem));
  }

  void need_tile(std::size_t brick) {
    MixedVolume& v = volume();
    std::uint64_t tile = v.tile[brick];
    // Numbers run on from part to part.
    TileKind kind(v.level[brick], 0);
    while (tile >= parts.tiles.at(kind).shape.front()) {
      tile -= parts.tiles.at(kind).shape.front();
      ++kind.part;
    }
    const h5::Dataset& d = parts.tiles.at(kind);
    SampleBlock& b = v.tiles.at(kind);
    h5::Shape first(4, 0), end = d.shape;
    first[0] = tile;
    end[0] = tile + 1;
    bool fresh = false;
    tiles.at(kind).fetch(first, end, [&](const h5::Shape& at) {
      read(d, b, at);
      fresh = true;
    });
    if (!fresh) return;
    const auto size = static_cast<std::size_t>(v.tile_size(kind));
    const std::uint64_t most = std::min(d.shape[0], (tile / d.chunk[0] + 1) * d.chunk[0]);
    for (std::uint64_t t = tile / d.chunk[0] * d.chunk[0]; t < most; ++t)
      check(path_of(kind), view_of(b, t, t * size, size));
  }

  void need_base(const Bricks& bricks, const Index3& at) {
    MixedVolume& v = volume();
    const Index3 cell = bricks.first_cell(at), n = bricks.cells(at);
    h5::Shape first(3), end(3);
    for (std::size_t a = 0; a < 3; ++a) {
      const std::size_t axis = 2 - a;
      first[axis] = static_cast<std::uint64_t>(cell[a] >> v.coarsening[axis]);
      end[axis] = static_cast<std::uint64_t>((cell[a] + n[a]) >> v.coarsening[axis]) + 1;
    }
    base->fetch(first, end, [&](const h5::Shape& from) {
      read(parts.base, v.base, from);
      check_base(from);
    });
  }

  /// The rows of one of its chunks.
  void check_base(const h5::Shape& from) {
    const h5::Dataset& d = parts.base;
    const auto end = [&](std::size_t axis) { return std::min(d.shape[axis], from[axis] + d.chunk[axis]); };
    for (std::uint64_t z = from[0]; z < end(0); ++z)
      for (std::uint64_t y = from[1]; y < end(1); ++y)
        check("/base",
              view_of(volume().base, 0, (z * d.shape[1] + y) * d.shape[2] + from[2], end(2) - from[2]));
  }

  void check(const std::string& where, const SampleBlock& samples) const {
    if (const auto p = block_problem(where, samples)) parts.reader->refuse(p->where, p->what);
  }

  /// First and last brick along each axis that holds points of the lattice.
  [[nodiscard]] std::pair<Index3, Index3> touched(const Lattice& lattice, const Bricks& bricks) {
    const auto exact = exact_box(volume(), lattice);
    const Grid& g = volume().grid;
    std::pair<Index3, Index3> range;
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int64_t last = lattice.first[a] + lattice.count[a] - 1, granularity = bricks.granularity();
      const auto brick_of = [&](std::int64_t i, double margin) {
        if (exact) return (i >> exact->per_cell[a]) / granularity;
        const double cell =
            (lattice.origin[a] + static_cast<double>(i) * lattice.spacing[a] - g.origin[a]) / g.spacing[a];
        return static_cast<std::int64_t>(std::floor((cell + margin) / static_cast<double>(granularity)));
      };
      range.first[a] = std::clamp<std::int64_t>(brick_of(lattice.first[a], -kFace), 0, bricks.along()[a] - 1);
      range.second[a] = std::clamp<std::int64_t>(brick_of(last, kFace), 0, bricks.along()[a] - 1);
    }
    return range;
  }

  void need(const Lattice& lattice, const Progress& progress) {
    MixedVolume& v = volume();
    const Bricks bricks(v.grid, v.granularity);
    const auto [low, high] = touched(lattice, bricks);
    for (std::int64_t z = low[2]; z <= high[2]; ++z) {
      report(progress, "read", static_cast<double>(z - low[2]) / static_cast<double>(high[2] - low[2] + 1));
      for (std::int64_t y = low[1]; y <= high[1]; ++y)
        for (std::int64_t x = low[0]; x <= high[0]; ++x) {
          const Index3 at{x, y, z};
          const auto brick = static_cast<std::size_t>(bricks.number(at));
          if (v.level[brick] == LevelTriple{}) need_base(bricks, at);
          else need_tile(brick);
        }
    }
  }
};

LazyVolume::LazyVolume(const std::filesystem::path& path, std::uint64_t max_memory_bytes)
    : state_(std::make_unique<State>()) {
  state_->limit = max_memory_bytes;
  state_->parts = open_parts(path, max_memory_bytes);
  MixedVolume& v = state_->volume();
  reserve(v.base, state_->parts.base);
  state_->base.emplace(state_->parts.base);
  for (const auto& [kind, d] : state_->parts.tiles) {
    reserve(v.tiles.at(kind), d);
    state_->tiles.emplace(kind, Chunks(d));
  }
}

LazyVolume::~LazyVolume() = default;

const Grid& LazyVolume::grid() const { return file().volume.grid; }

const VdvrFile& LazyVolume::file() const { return state_->parts.file; }

void LazyVolume::values_on(const Lattice& lattice, std::span<float> out, const Progress& progress) {
  state_->need(lattice, progress);
  vdvr::values_on(file().volume, lattice, out, progress);
}

void LazyVolume::bounds_on(const Lattice& lattice, std::span<float> out, const Progress& progress) const {
  CertifiedPoints(file().volume, file().certificate).bounds(lattice, out, progress);
}

std::uint64_t LazyVolume::bytes_read() const { return state_->bytes_read; }

std::uint64_t LazyVolume::bytes_stored() const {
  std::uint64_t bytes = state_->parts.base.stored_bytes;
  for (const auto& [kind, d] : state_->parts.tiles) bytes += d.stored_bytes;
  return bytes;
}

}  // namespace vdvr
