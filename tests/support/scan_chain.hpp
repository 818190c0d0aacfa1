// The chain from a scan to gold and its bounds on a small grid, beside F in double precision. Called by
// attack_chain.hpp, and by cone_attacks.cpp, which is no Boost test.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "host/certify/gold/gold_batch.hpp"
#include "host/certify/gold/gold_stream.hpp"
#include "host/field/fdk/filter_cone.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/exact_field.hpp"

namespace vdvr::attacks {

/// What the tests need of one scan.
struct ScanChain {
  ScanChain(Device& on, const ProjectionSet& given)
      : device(on),
        scan(given),
        exact(scan, {}),
        filtered(filter_scan(on.state(), scan, {})),
        upsampler(on.state(), filtered) {
    sups = (scan.cone ? cone_sups : field_sups)(on.state(), upsampler, filtered, 1);
  }
  Device& device;
  const ProjectionSet& scan;
  ExactField exact;
  FilteredScan filtered;
  Upsampler upsampler;
  FieldSups sups;
};

/// All gold nodes of a grid, x fastest, with what the certificate says of them. above, below: the smallest
/// slack that any brick uses; negative: untested.
struct GoldNodes {
  Grid grid;
  int rate = 1;
  double arithmetic = 0, projection = 0;  ///< A, and P of any node
  double sup = 0;                         ///< at least |F| wherever gold has bounds
  Index3 nodes{0, 0, 0};
  std::vector<double> gold, above, below;
  [[nodiscard]] std::size_t at(std::int64_t x, std::int64_t y, std::int64_t z) const {
    return static_cast<std::size_t>((z * nodes[1] + y) * nodes[0] + x);
  }
  [[nodiscard]] Vec3 position(std::int64_t x, std::int64_t y, std::int64_t z) const {
    const Index3 i{x, y, z};
    Vec3 out{};
    for (std::size_t a = 0; a < 3; ++a)
      out[a] = grid.origin[a] + static_cast<double>(i[a]) / rate * grid.spacing[a];
    return out;
  }
  [[nodiscard]] std::vector<Vec3> positions() const {
    std::vector<Vec3> out;
    for (std::int64_t z = 0; z < nodes[2]; ++z)
      for (std::int64_t y = 0; y < nodes[1]; ++y)
        for (std::int64_t x = 0; x < nodes[0]; ++x) out.push_back(position(x, y, z));
    return out;
  }
};

/// Streams the grid in bricks of one base cell, whose remainders are the sharpest.
inline GoldNodes stream_nodes(ScanChain& chain, const Grid& grid, const Rates& rates) {
  GoldStream stream(chain.device.state(), chain.filtered, chain.sups, gold_settings(grid, 1, rates));
  GoldNodes out;
  out.grid = grid;
  out.rate = rates.gold;
  out.arithmetic = stream.arithmetic();
  out.projection = stream.projection();
  out.sup = stream.source()->kept.sup();
  for (std::size_t a = 0; a < 3; ++a) out.nodes[a] = grid.cells[a] * rates.gold + 1;
  const auto count = static_cast<std::size_t>(out.nodes[0] * out.nodes[1] * out.nodes[2]);
  const auto cells = static_cast<std::size_t>(grid.cells[0] * grid.cells[1] * grid.cells[2]);
  out.gold.assign(count, 0);
  out.above.assign(count, INFINITY);
  out.below.assign(count, INFINITY);
  stream.run(
      std::vector<std::uint8_t>(cells, 1),
      [&](GoldStream::Batch& batch) {
        for (const std::int64_t id : batch.bricks()) {
          const Index3 brick{id % grid.cells[0], id / grid.cells[0] % grid.cells[1],
                             id / grid.cells[0] / grid.cells[1]};
          batch.for_each_node(id, [&](const Index3& i, float gold, const Slack& slack) {
            const std::size_t n = out.at(brick[0] * rates.gold + i[0], brick[1] * rates.gold + i[1],
                                         brick[2] * rates.gold + i[2]);
            out.gold[n] = static_cast<double>(gold);
            out.above[n] = std::min(out.above[n], static_cast<double>(slack.above));
            out.below[n] = std::min(out.below[n], static_cast<double>(slack.below));
          });
        }
      },
      {}, "attack");
  return out;
}

inline double trilinear(const std::array<double, 8>& corner, const Vec3& f) {
  double sum = 0;
  for (std::size_t c = 0; c < 8; ++c)
    sum +=
        corner[c] * ((c & 1) ? f[0] : 1 - f[0]) * ((c & 2) ? f[1] : 1 - f[1]) * ((c & 4) ? f[2] : 1 - f[2]);
  return sum;
}

}  // namespace vdvr::attacks
