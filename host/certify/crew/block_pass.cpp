// Answers of a batch, as bytes and back.
#include "host/certify/crew/block_pass.hpp"

#include "host/base/system/casts.hpp"
#include "vdvr/error.hpp"

namespace vdvr {

BlockKey get_key(ByteReader& in) {
  auto key = in.get<BlockKey>();
  if (key.first.empty()) throw FileError("a journal record is of no block; start again without `resume`");
  return key;
}

bool is_taken(const BlockPass& pass, const BrickLevels& l) {
  return pass.fine || (l.base.total >= 0 && l.passes && is_above_base(l.level));
}

namespace {

using Tiles = std::vector<std::pair<std::int64_t, LevelTriple>>;

void put_levels(ByteWriter& out, const std::vector<BrickLevels>& levels) {
  out.put(static_cast<std::uint64_t>(levels.size()));
  for (const BrickLevels& l : levels) {
    out(l.base, l.level, l.passes);
    if (is_above_base(l.level)) out.put(l.along);
  }
}

void put_tiles(ByteWriter& out, const Tiles& tiles, const std::vector<float>& samples) {
  std::vector<std::int64_t> bricks;
  std::vector<LevelTriple> levels;
  for (const auto& [brick, level] : tiles) {
    bricks.push_back(brick);
    levels.push_back(level);
  }
  out(bricks, levels, samples);
}

// Runs of samples that lie one after another.
void put_fit(ByteWriter& out, GoldBatch& batch) {
  std::vector<std::uint64_t> first, length;
  std::vector<float> samples;
  batch.fit_base([&](std::size_t i, float sample) {
    if (first.empty() || first.back() + length.back() != i) {
      first.push_back(i);
      length.push_back(0);
    }
    ++length.back();
    samples.push_back(sample);
  });
  out(first, length, samples);
}

void put_classes(ByteWriter& out, GoldBatch& batch, const BlockPass& pass, const DeviceField& field,
                 const opencl::DeviceArray<std::uint8_t>& selected) {
  std::vector<BrickLevels> levels;
  Tiles tiles;
  std::vector<float> samples;
  for (const BrickClass& c : batch.classify(field, pass.tolerance, selected, pass.fine)) {
    levels.push_back({c.base, c.level, c.passes, c.along});
    if (!is_taken(pass, levels.back()) || c.base.total < 0 || !is_above_base(c.level)) continue;
    tiles.emplace_back(c.base.brick, c.level);
    samples.insert(samples.end(), c.tile.begin(), c.tile.end());
  }
  put_levels(out, levels);
  put_tiles(out, tiles, samples);
}

void put_extract(ByteWriter& out, GoldBatch& batch, const BlockPass& pass) {
  Tiles tiles;
  for (const std::int64_t id : batch.bricks()) tiles.emplace_back(id, pass.level.at(at(id)));
  put_tiles(out, tiles, batch.extract(tiles));
  for (const AxisErrors& along : batch.axis_errors(batch.bricks())) out.put(along);
}

}  // namespace

void read_levels(ByteReader& in, const std::function<void(const BrickLevels&)>& visit) {
  const auto n = in.get<std::uint64_t>();
  for (std::uint64_t i = 0; i < n; ++i) {
    BrickLevels l;
    in(l.base, l.level, l.passes);
    if (is_above_base(l.level)) l.along = in.get<AxisErrors>();
    visit(l);
  }
}

void read_fit(ByteReader& in, const std::function<void(std::size_t, float)>& visit) {
  std::vector<std::uint64_t> first, length;
  std::vector<float> samples;
  in(first, length, samples);
  std::size_t next = 0;
  for (std::size_t run = 0; run < first.size(); ++run)
    for (std::uint64_t i = 0; i < length.at(run); ++i) visit(first[run] + i, samples.at(next++));
}

std::vector<GoldStream::Work> works_of(std::span<const BrickRemainder::Block> blocks) {
  std::vector<GoldStream::Work> works;
  for (const auto& [first, size] : blocks) {
    if (works.empty() || works.back().z != first[2] || works.back().size() != size)
      works.push_back({first[2], size[2], size[0], size[1], {}});
    works.back().first.push_back({first[0], first[1]});
  }
  return works;
}

Bytes remainder_record(const BrickRemainder& remainder, const BrickRemainder::Block& block,
                       const BlockPass& pass, int rate) {
  ByteWriter out;
  const auto& [first, size] = block;
  out(BlockKey{rate, pass.number, first[2], size, {{first[0], first[1]}}}, remainder.found(block));
  return out.take();
}

void take_remainder(ByteReader& in, const BlockKey& key, BrickRemainder& remainder) {
  const auto& [x, y] = key.first.at(0);
  remainder.take({{x, y, key.z}, key.size}, in.get<std::vector<float>>());
}

Bytes compute_record(GoldBatch& batch, const BlockPass& pass, const DeviceField* field,
                     const opencl::DeviceArray<std::uint8_t>& selected, int rate) {
  ByteWriter out;
  BlockKey key{rate, pass.number, batch.first_brick().front()[2], batch.block_bricks(), {}};
  for (const auto& first : batch.first_brick()) key.first.push_back({first[0], first[1]});
  out.put(key);
  switch (pass.ask) {
    case BlockPass::Ask::fit:
      put_fit(out, batch);
      break;
    case BlockPass::Ask::test: {
      std::vector<BrickLevels> levels;
      for (const BrickMeasure& m : batch.measure(*field, pass.tolerance, selected, false, pass.cells))
        levels.push_back({m, {}, false, {}});
      put_levels(out, levels);
      put_tiles(out, {}, {});
      break;
    }
    case BlockPass::Ask::classify:
      put_classes(out, batch, pass, *field, selected);
      break;
    case BlockPass::Ask::measure:
      for (const BrickMeasure& m : batch.measure(*field, pass.tolerance, selected, true, pass.cells))
        out.put(m);
      break;
    case BlockPass::Ask::extract:
      put_extract(out, batch, pass);
      break;
    case BlockPass::Ask::remainder:  // is of no batch
      break;
  }
  return out.take();
}

}  // namespace vdvr
