// Gold that is kept once for all devices of a machine, and made by all of them, by detector rows and then
// tiles.
#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "host/base/system/casts.hpp"
#include "host/certify/kept/kept_gold.hpp"
#include "host/field/fbp/back_project.hpp"

namespace vdvr {

namespace {

// Whether kernels read and write such memory where it lies: OpenCL allows a device of the host to copy it.
bool is_in_place(opencl::State& state) {
  constexpr std::size_t n = 1024;
  const std::shared_ptr<void> memory(std::aligned_alloc(4096, 4 * n), std::free);
  const std::span<float> values(static_cast<float*>(memory.get()), n);
  std::fill(values.begin(), values.end(), 1.0f);
  opencl::DeviceArray<float> array(state, values, memory, "memory of the host");
  array.fill(2.0f);
  state.queue.finish();
  if (values[n - 1] != 2.0f) return false;
  values[0] = 3.0f;
  float first = 0;
  array.read(std::span(&first, 1));
  return first == 3.0f;
}

}  // namespace

// Beyond the grid as far as halos and filters read: the first, and how many.
std::pair<std::int64_t, std::int64_t> KeptGold::all_heights() const {
  return {-run_margin, grid_.cells[2] * rates_[2] + 1 + 2 * run_margin};
}

std::optional<CommonGold::Shape> KeptGold::common_shape() const {
  if (cone_ || scratch() || !state_.info.is_cpu) return std::nullopt;
  CommonGold::Shape shape;
  shape.tiles = all_tiles();
  shape.tile = count(side * side * stride_);
  const auto [low, heights] = all_heights();
  if (!few_rows()) shape.heights = count(side * side * column_stride(heights));
  shape.rows = scan_.geometry.rows;
  shape.more = {low, heights, rates_[0], rates_[1], rates_[2], static_cast<std::int64_t>(columns_.count)};
  if (shape.tiles.empty() || !is_in_place(state_)) return std::nullopt;
  return shape;
}

void KeptGold::share(CommonMemory memory, bool leads) {
  const std::optional<CommonGold::Shape> shape = common_shape();
  if (!shape || memory.bytes.size() < CommonGold::bytes_of(*shape)) return;
  std::vector<std::uint8_t> given;
  if (leads)
    for (const TileAt& tile : shape->tiles) given.push_back(tiles_.contains(tile) ? 1 : 0);
  CommonGold common(std::move(memory), *shape, given);
  if (!common.agrees()) return;
  for (std::size_t i = 0; leads && i < common.given(); ++i) {
    const Place& place = tiles_.at(shape->tiles[common.order()[i]]);
    pages_[place.page].read(common.rows(i, 1), place.first);
  }
  tiles_.clear();
  pages_.clear();
  run_.reset();
  heights_.reset();
  common_bytes_.count(common.own_bytes(), "gold that is kept for all devices of this machine");
  common_.emplace(std::move(common));
}

// By runs of rows: columns of the detector are upsampled once, too.
void KeptGold::make_common(const Progress& progress) {
  const CommonGold& common = *common_;
  const std::vector<TileAt>& all = common.shape().tiles;
  const ParallelGeometry& g = scan_.geometry;
  const std::uint64_t tile = common.shape().tile;
  const std::size_t each = std::max<std::size_t>(1, page_bytes / (4 * tile));
  std::vector<std::pair<std::size_t, ColumnBlocks>> parts;  // page and what is made there
  const auto add_pages = [&](std::size_t first, std::size_t last, bool made) {
    for (std::size_t i = first; i < last; i += each) {
      const std::size_t n = std::min(each, last - i);
      std::vector<TileAt> tiles;
      for (std::size_t j = 0; j < n; ++j) {
        tiles.push_back(all[common.order()[i + j]]);
        tiles_[tiles.back()] = {pages_.size(), j * tile};
      }
      pages_.emplace_back(state_, common.rows(i, n), common.owner(), "gold that is kept");
      if (made) continue;
      ColumnBlocks blocks = blocks_of(tiles);
      blocks.wanted = wanted(blocks);
      blocks.out_stride = stride_;
      parts.emplace_back(pages_.size() - 1, std::move(blocks));
    }
  };
  add_pages(0, common.given(), true);
  add_pages(common.given(), all.size(), false);
  common_->make_rows(
      [&](std::size_t i) {
        const std::int64_t first = static_cast<std::int64_t>(i) * CommonGold::chunk;
        const UpsampledSlab slab = upsampled(first, std::min(g.rows, first + CommonGold::chunk));
        const auto begun = std::chrono::steady_clock::now();
        for (auto& [page, blocks] : parts) {
          blocks.out_row = first;
          back_project(state_, g, slab, blocks, interpolation_, pages_[page]);
        }
        state_.queue.finish();
        tile_seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
      },
      progress);
  if (!few_rows()) make_common_heights(progress);
  common_.reset();
}

void KeptGold::make_common_heights(const Progress& progress) {
  const CommonGold& common = *common_;
  const std::vector<TileAt>& all = common.shape().tiles;
  const auto [low, heights] = all_heights();
  begin_run(low, heights);
  Run& run = *run_;
  run.common = true;
  for (std::size_t i = 0; i < all.size(); i += run.a_page) {
    run.of_last = std::min(run.a_page, all.size() - i);
    for (std::size_t j = 0; j < run.of_last; ++j)
      run.tiles[all[common.order()[i + j]]] = {run.pages.size(), j * common.shape().heights};
    run.pages.emplace_back(state_, common.heights(i, run.of_last), common.owner(), "heights of kept gold");
  }
  run.of_last = run.a_page;  // what others have not goes elsewhere
  common_->make_heights(
      [&](std::size_t i) {
        const TileAt& tile = all[common.order()[i]];
        want_heights(tiles_.at(tile), run.tiles.at(tile));
        make_heights();
        state_.queue.finish();
      },
      progress);
}

}  // namespace vdvr
