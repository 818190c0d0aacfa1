// Gold in boxes, from what is kept: heights of the detector's rows, then filters across. Calls
// interpolate_gold.cpp.
#include <algorithm>
#include <stdexcept>

#include "host/base/system/casts.hpp"
#include "host/certify/kept/kept_gold.hpp"
#include "host/field/fbp/cosine_series.hpp"
#include "host/field/fbp/reconstruct.hpp"

namespace vdvr {
namespace {

// Of the heights made of them, in bytes: less is made that nobody asks for, but each page that a box reads is
// a launch. The larger one only as far as it is a small part of the memory that is left, and no more than
// all.
constexpr std::uint64_t least_run_page = std::uint64_t{8} << 20, most_run_page = std::uint64_t{256} << 20,
                        most_run_page_of_card = std::uint64_t{1} << 30;
// Floats on the way from heights to gold: boxes that fit are made together. On a CPU they stay in caches; a
// card runs dry between small launches.
constexpr std::uint64_t floats_together = std::uint64_t{1} << 23,
                        most_floats_of_card = std::uint64_t{1} << 28;

}  // namespace

// Rows that determine nodes of height `first` + i * `step`, in kept heights: [i][row].
std::vector<double> KeptGold::rows_of(double first, double step, std::int64_t heights) const {
  const ParallelGeometry& g = scan_.geometry;
  std::vector<double> positions;
  // One by one: a height has the same weights in every box.
  for (std::int64_t i = 0; i < heights; ++i)
    positions.push_back(
        detector_rows(g, grid_.origin[2] + (first + static_cast<double>(i) * step) * spacing_[2], 0, 1)
            .front());
  return resampling_matrix(g.rows, positions, 0, 1.0, 0);
}

std::int64_t KeptGold::cells_together() const {
  const std::int64_t cells = grid_.cells[2];
  if (few_rows() || cone_) return cells;
  const auto heights = static_cast<std::int64_t>(heights_bytes_ / (4 * count(side * side)) /
                                                 std::max<std::size_t>(1, all_tiles().size()));
  if (heights >= cells * rates_[2] + 1 + 2 * run_margin) return cells;
  return std::clamp<std::int64_t>((heights - 4 * run_margin) / rates_[2], 1, cells);
}

void KeptGold::require_run(const Span& z) {
  if (cone_ || (run_ && run_->low <= z.low && z.low + z.count <= run_->low + run_->count)) return;
  const auto [all_low, all] = all_heights();
  const std::int64_t all_high = all_low + all;
  std::int64_t low = std::min(all_low, z.low), heights_made = std::max(all_high, z.low + z.count) - low;
  const auto bytes = [&](std::int64_t heights) {
    return count(4 * side * side * column_stride(heights)) * tiles_.size();
  };
  const std::uint64_t room = (state_.memory.left() + run_bytes()) / 2;
  if (!scratch() && bytes(heights_made) > room / 2) {
    // Passes go upwards: as many heights as a band of them reads, where these fit.
    const std::int64_t least = z.count + 2 * run_margin, band = cells_together() * rates_[2] + 4 * run_margin;
    low = z.low - run_margin;
    heights_made =
        std::max(band > least && bytes(band) <= room ? std::min(band, all_high - low) : least, least);
  }
  begin_run(low, heights_made);
}

void KeptGold::begin_run(std::int64_t low, std::int64_t heights) {
  run_.reset();
  Run run;
  run.low = low;
  run.count = heights;
  const HeightWeights weights = height_weights(rows_of(static_cast<double>(run.low), 1.0, run.count),
                                               run.count, scan_.geometry.rows, 0);
  run.stride = column_stride(run.count);
  const std::uint64_t a_tile = 4 * count(side * side * run.stride),
                      most = std::min(state_.info.is_cpu ? most_run_page : most_run_page_of_card,
                                      state_.info.max_allocation),
                      page = std::clamp(state_.memory.left() / 16, std::min(least_run_page, most), most);
  run.a_page = scratch() ? page_bytes / a_tile : std::min<std::size_t>(page / a_tile, tiles_.size());
  run.a_page = std::max<std::size_t>(1, run.a_page);
  run.from_rows.emplace(state_, weights);
  run_ = std::move(run);
}

std::uint64_t KeptGold::run_bytes() const {
  std::uint64_t bytes = 0;
  if (run_)
    for (const auto& page : run_->pages) bytes += 4 * page.size();
  return bytes;
}

KeptGold::Place KeptGold::heights_of(const TileAt& tile, const Place& place) {
  if (const auto known = run_->tiles.find(tile); known != run_->tiles.end()) return known->second;
  const std::uint64_t size = count(side * side * run_->stride);
  if (run_->pages.empty() || run_->of_last == run_->a_page) {
    run_->pages.emplace_back(state_, scratch(), run_->a_page * size, "heights of kept gold");
    run_->of_last = 0;
  }
  const Place out{run_->pages.size() - 1, run_->of_last++ * size};
  run_->tiles.emplace(tile, out);
  want_heights(place, out);
  return out;
}

void KeptGold::want_heights(const Place& rows, const Place& heights) {
  run_->to_make[{rows.page, heights.page}].push_back({rows.first, heights.first, to_int(side), to_int(side)});
}

void KeptGold::make_heights() {
  VdvrAlongZ shape{};
  shape.in_x = count(stride_);
  shape.in_y = count(side * stride_);
  shape.out_x = count(run_->stride);
  shape.out_y = count(side * run_->stride);
  for (const auto& [pages, parts] : run_->to_make)
    (*run_->from_rows)(state_, pages_[pages[0]], run_->pages[pages[1]], parts, shape);
  run_->to_make.clear();
}

// Of all rows where they are few, else of heights at half a pixel.
void KeptGold::resample_heights(const GoldLattice& lattice, const GoldBox& box) {
  const Span s = heights_span(lattice, box);
  const std::int64_t before = span(lattice, 2, box).low - s.low;
  if (!few_rows()) require_run(s);
  if (heights_ && heights_->first == box.first[2] && heights_->nodes == box.nodes[2] &&
      heights_->phases == lattice.phases[2] && heights_->step == lattice.step[2])
    return;
  Heights h;
  h.first = box.first[2];
  h.nodes = box.nodes[2];
  h.phases = lattice.phases[2];
  h.step = lattice.step[2];
  HeightWeights weights;
  if (few_rows()) {
    const double step = static_cast<double>(h.step) / h.phases;
    weights = height_weights(rows_of(static_cast<double>(h.first) * step, step, h.nodes), h.nodes,
                             scan_.geometry.rows, 0);
  } else {
    const GoldFilter& f = filter_of(h.phases, 2);
    std::vector<double> between(at(h.nodes * s.count), 0.0);
    for (std::int64_t n = 0; n < h.nodes; ++n) {
      const std::int64_t position = n + s.skipped, interval = position / h.phases,
                         phase = position % h.phases;
      double* row = between.data() + n * s.count;
      const std::int64_t first = before + interval * h.step;
      const auto put = [&](std::int64_t t, double weight) {
        if (first + t >= 0 && first + t < s.count) row[first + t] = weight;
      };
      if (phase == 0) put(half_taps_[2] - 1, 1);
      else
        for (std::int64_t t = 0; t < f.taps; ++t)
          put(t, static_cast<double>(f.weights[at(phase * f.taps + t)]));
    }
    weights = height_weights(between, h.nodes, s.count, AlongZ::chains_of(f.taps));
  }
  h.weights.emplace(state_, weights);
  h.padded = 16 * weights.groups();
  heights_ = std::move(h);
}

opencl::DeviceArray<float>& KeptGold::heights_buffer(std::uint64_t size) {
  opencl::DeviceArray<float>& b = buffer_;
  if (b.size() < size) {
    b = {};  // before the next one is allocated
    b = opencl::DeviceArray<float>(state_, size, "gold between its nodes");
    b.fill(0.0f);  // what is not written is read by nobody who counts, but must be finite
  }
  return b;
}

const AcrossWeights& KeptGold::across_of(int phases, std::size_t axis) {
  const std::pair key{phases, axis};
  if (const auto known = across_.find(key); known != across_.end()) return known->second;
  const GoldFilter& f = filter_of(phases, axis);
  return across_
      .emplace(key, AcrossWeights(state_, phases, f.taps,
                                  std::span<const float>(f.weights).subspan(at(std::min(
                                      f.taps, to_int(static_cast<std::int64_t>(f.weights.size())))))))
      .first->second;
}

// float out[box][y][x][padded]: gold's heights on kept columns.
void KeptGold::take_heights(const GoldLattice& lattice, std::span<const GoldBox> boxes,
                            const opencl::DeviceArray<float>& out) {
  const Span z = heights_span(lattice, boxes.front());
  const std::int64_t padded = heights_->padded, stride = few_rows() ? stride_ : run_->stride;
  std::map<std::size_t, std::vector<VdvrColumns>> by_page;
  std::uint64_t first = 0;
  VdvrAlongZ shape{};
  const auto resample = [&] {
    if (!few_rows()) make_heights();
    for (const auto& [page, parts] : by_page)
      (*heights_->weights)(state_, few_rows() ? pages_[page] : run_->pages[page], out, parts, shape);
    by_page.clear();
  };
  for (const GoldBox& box : boxes) {
    // Tiles that came later than the run were not foreseen by it: heights can be made again.
    if (!few_rows() && !cone_ && !run_->common && !scratch() && run_bytes() > state_.memory.left() / 2) {
      resample();
      run_->tiles.clear();
      run_->pages.clear();
      run_->of_last = 0;
    }
    const Span x = span(lattice, 0, box), y = span(lattice, 1, box);
    for (std::int64_t ty = floor_div(y.low, side); ty * side < y.low + y.count; ++ty)
      for (std::int64_t tx = floor_div(x.low, side); tx * side < x.low + x.count; ++tx) {
        const auto tile = tiles_.find({ty, tx});
        if (tile == tiles_.end()) continue;  // beyond reach
        const std::int64_t x0 = std::max(x.low, tx * side), x1 = std::min(x.low + x.count, (tx + 1) * side),
                           y0 = std::max(y.low, ty * side), y1 = std::min(y.low + y.count, (ty + 1) * side);
        const Place in = few_rows() ? tile->second : heights_of(tile->first, tile->second);
        by_page[in.page].push_back({in.first + (few_rows() ? 0 : count(z.low - run_->low)) +
                                        count(((y0 - ty * side) * side + x0 - tx * side) * stride),
                                    first + count(((y0 - y.low) * x.count + x0 - x.low) * padded),
                                    to_int(x1 - x0), to_int(y1 - y0)});
      }
    shape.in_x = count(stride);
    shape.in_y = count(side * stride);
    shape.out_x = count(padded);
    shape.out_y = count(x.count * padded);
    first += count(x.count * y.count * padded);
  }
  resample();
}

void KeptGold::fill(const GoldLattice& lattice, std::span<const GoldBox> boxes,
                    const opencl::DeviceArray<float>& out, std::uint64_t first, std::uint64_t apart,
                    std::int64_t stride) {
  if (boxes.empty()) return;
  const GoldBox& one = boxes.front();
  const Span x = span(lattice, 0, one), y = span(lattice, 1, one);
  for (const GoldBox& box : boxes)
    if (box.nodes != one.nodes || box.first[2] != one.first[2] ||
        span(lattice, 0, box).skipped != x.skipped || span(lattice, 1, box).skipped != y.skipped)
      throw std::logic_error("KeptGold: boxes that differ");
  resample_heights(lattice, one);
  const std::uint64_t largest = count(x.count * y.count * heights_->padded);
  // A twelfth of what is left.
  const std::uint64_t floats =
      state_.info.is_cpu ? floats_together
                         : std::clamp(state_.memory.left() / 48, floats_together, most_floats_of_card);
  const std::size_t together =
      std::max<std::size_t>(1, std::min(floats, state_.info.max_allocation / 4) / largest);
  for (std::size_t i = 0; i < boxes.size(); i += together)
    fill_together(lattice, boxes.subspan(i, std::min(together, boxes.size() - i)), out, first + i * apart,
                  apart, stride);
}

// Boxes whose heights were resampled.
void KeptGold::fill_together(const GoldLattice& lattice, std::span<const GoldBox> boxes,
                             const opencl::DeviceArray<float>& out, std::uint64_t first, std::uint64_t apart,
                             std::int64_t stride) {
  const GoldBox& box = boxes.front();
  const Span x = span(lattice, 0, box), y = span(lattice, 1, box);
  const std::int64_t padded = heights_->padded;
  const opencl::DeviceArray<float>& heights =
      heights_buffer(boxes.size() * count(x.count * y.count * padded));
  take_heights(lattice, boxes, heights);
  VdvrAcross shape{};
  shape.in_box = count(x.count * y.count * padded);
  shape.in_x = count(padded);
  shape.in_y = count(x.count * padded);
  shape.out_first = first;
  shape.out_box = apart;
  shape.out_x = count(stride);
  shape.out_y = count(box.nodes[0] * stride);
  shape.boxes = to_int(static_cast<std::int64_t>(boxes.size()));
  shape.z = to_int(padded);
  shape.kept_x = to_int(x.count);
  shape.intervals_x = to_int(x.intervals);
  shape.step_x = lattice.step[0];
  shape.step_y = lattice.step[1];
  shape.skipped_x = to_int(x.skipped);
  shape.skipped_y = to_int(y.skipped);
  shape.outputs_x = to_int(box.nodes[0]);
  shape.outputs_y = to_int(box.nodes[1]);
  fill_across(state_, across_of(lattice.phases[0], 0), across_of(lattice.phases[1], 1), heights, out, shape);
}

}  // namespace vdvr
