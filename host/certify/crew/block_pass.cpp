// Answers of a batch, as bytes and back.
#include "host/certify/crew/block_pass.hpp"

#include "host/base/system/casts.hpp"
#include "vdvr/error.hpp"

namespace vdvr {

void put(ByteWriter& out, const BlockKey& key) {
  for (const std::int64_t n : {key.rate, key.pass, key.z, key.size[0], key.size[1], key.size[2]}) out.put(n);
  out.put(key.first);
}

BlockKey get_key(ByteReader& in) {
  BlockKey key;
  for (std::int64_t* n : {&key.rate, &key.pass, &key.z, key.size.data(), &key.size[1], &key.size[2]})
    *n = in.get<std::int64_t>();
  key.first = in.get_vector<std::array<std::int64_t, 2>>();
  if (key.first.empty()) throw FileError("a journal record is of no block; start again without `resume`");
  return key;
}

void put(ByteWriter& out, const BrickMeasure& m) {
  out.put(m.brick);
  out.put(m.total);
  out.put(m.error);
  out.put(m.slack);
  out.put(m.violated);
  out.put(m.rate);
}

BrickMeasure get_measure(ByteReader& in) {
  BrickMeasure m;
  m.brick = in.get<std::int64_t>();
  m.total = in.get<float>();
  m.error = in.get<float>();
  m.slack = in.get<float>();
  m.violated = in.get<std::uint32_t>();
  m.rate = in.get<int>();
  return m;
}

AxisErrors get_along(ByteReader& in) {
  AxisErrors along;
  for (auto& axis : along.of)
    for (auto& level : axis)
      for (float& error : level) error = in.get<float>();
  return along;
}

bool is_taken(const BlockPass& pass, const BrickLevels& l) {
  return pass.fine || (l.base.total >= 0 && l.passes && is_above_base(l.level));
}

namespace {

using Tiles = std::vector<std::pair<std::int64_t, LevelTriple>>;

void put(ByteWriter& out, const AxisErrors& along) {
  for (const auto& axis : along.of)
    for (const auto& level : axis)
      for (const float error : level) out.put(error);
}

void put_levels(ByteWriter& out, const std::vector<BrickLevels>& levels) {
  out.put(static_cast<std::uint64_t>(levels.size()));
  for (const BrickLevels& l : levels) {
    vdvr::put(out, l.base);
    out.put(l.level);
    out.put(static_cast<std::uint8_t>(l.passes));
    if (is_above_base(l.level)) put(out, l.along);
  }
}

void put_tiles(ByteWriter& out, const Tiles& tiles, const std::vector<float>& samples) {
  std::vector<std::int64_t> bricks;
  std::vector<LevelTriple> levels;
  for (const auto& [brick, level] : tiles) {
    bricks.push_back(brick);
    levels.push_back(level);
  }
  out.put(bricks);
  out.put(levels);
  out.put(samples);
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
  out.put(first);
  out.put(length);
  out.put(samples);
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
  for (const AxisErrors& along : batch.axis_errors(batch.bricks())) put(out, along);
}

}  // namespace

void read_levels(ByteReader& in, const std::function<void(const BrickLevels&)>& visit) {
  const auto n = in.get<std::uint64_t>();
  for (std::uint64_t i = 0; i < n; ++i) {
    BrickLevels l;
    l.base = get_measure(in);
    l.level = in.get<LevelTriple>();
    l.passes = in.get<std::uint8_t>() != 0;
    if (is_above_base(l.level)) l.along = get_along(in);
    visit(l);
  }
}

void read_fit(ByteReader& in, const std::function<void(std::size_t, float)>& visit) {
  const auto first = in.get_vector<std::uint64_t>(), length = in.get_vector<std::uint64_t>();
  const auto samples = in.get_vector<float>();
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
  put(out, BlockKey{rate, pass.number, first[2], size, {{first[0], first[1]}}});
  out.put(remainder.found(block));
  return out.take();
}

void take_remainder(ByteReader& in, const BlockKey& key, BrickRemainder& remainder) {
  const auto& [x, y] = key.first.at(0);
  remainder.take({{x, y, key.z}, key.size}, in.get_vector<float>());
}

Bytes compute_record(GoldBatch& batch, const BlockPass& pass, const DeviceField* field,
                     const opencl::DeviceArray<std::uint8_t>& selected, int rate) {
  ByteWriter out;
  BlockKey key{rate, pass.number, batch.first_brick().front()[2], batch.block_bricks(), {}};
  for (const auto& first : batch.first_brick()) key.first.push_back({first[0], first[1]});
  put(out, key);
  switch (pass.ask) {
    case BlockPass::Ask::fit:
      put_fit(out, batch);
      break;
    case BlockPass::Ask::test: {
      std::vector<BrickLevels> levels;
      for (const BrickMeasure& m : batch.measure(*field, pass.tolerance, selected))
        levels.push_back({m, {}, false, {}});
      put_levels(out, levels);
      put_tiles(out, {}, {});
      break;
    }
    case BlockPass::Ask::classify:
      put_classes(out, batch, pass, *field, selected);
      break;
    case BlockPass::Ask::measure:
      for (const BrickMeasure& m : batch.measure(*field, pass.tolerance, selected, true)) put(out, m);
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
