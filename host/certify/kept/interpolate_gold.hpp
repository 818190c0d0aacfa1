// Gold from fewer nodes: products along z and filters across it, on the device.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host/base/opencl/array.hpp"
#include "shared/interpolate_gold.h"

namespace vdvr {

/// Heights out of heights: out[16 group + i] = sum_j weights[group][j][i] in[first[group] + j], j < terms.
struct HeightWeights {
  int chains = 0;  ///< AlongZ::chains_of
  std::int64_t terms = 0;
  std::vector<float> weights;  ///< [group][terms][16]
  std::vector<cl_int> first;   ///< [group]

  [[nodiscard]] std::int64_t groups() const { return static_cast<std::int64_t>(first.size()); }
};

/// Of float matrix[output][input] whose entries outside a band are 0: groups of 16 outputs, each over as many
/// inputs as the widest has. Without chains, of many inputs: in whole runs of AlongZ that begin at a multiple
/// of one; reads up to a run beyond the last input. An output is rounded in the same way whatever outputs
/// share its group. Throws std::logic_error where there is no input.
HeightWeights height_weights(std::span<const double> matrix, std::int64_t outputs, std::int64_t inputs,
                             int chains);

/// The same on the device.
class AlongZ {
 public:
  AlongZ(opencl::State& state, const HeightWeights& weights);
  /// Of these rectangles of columns, by one launch; of `shape` only the distances between columns are read.
  /// Enqueues. Cost: columns * groups * 16 * terms multiply-adds; error: that of a product in runs of `run`
  /// terms. In two chains or in four each has its share of a band, and one or two roundings more.
  void operator()(opencl::State& state, const opencl::DeviceArray<float>& in,
                  const opencl::DeviceArray<float>& out, std::span<const VdvrColumns> parts,
                  VdvrAlongZ shape) const;

  static constexpr int run = 8;
  /// Into how many chains a band of so many taps is summed, that these and their sum round no more than runs
  /// would; 0: in runs.
  static constexpr int chains_of(std::int64_t taps) { return taps <= 18 ? 2 : taps <= 32 ? 4 : 0; }

 private:
  opencl::DeviceArray<float> weights_;
  opencl::DeviceArray<cl_int> first_;
  int chains_ = 0;
  std::int64_t terms_ = 0, groups_ = 0;
};

/// Of a filter along x or y, on the device: float[phase - 1][taps] as gold_filters.hpp has them, of which
/// half lie before the `phases` outputs of an interval.
struct AcrossWeights {
  AcrossWeights(opencl::State& state, int phases, int taps, std::span<const float> weights);
  int phases = 1, taps = 2;
  opencl::DeviceArray<float> values;
};

/// Gold between kept columns: along y, and of what that gives along x, in one launch. Phases, chunks and room
/// of `shape` are not read. Throws std::logic_error where the filters' taps differ. Enqueues. Cost: `taps`
/// multiply-adds a kept column of every row of gold, and a node; error: along either axis taps + 1 roundings
/// of sum |weight| |input|.
void fill_across(opencl::State& state, const AcrossWeights& x, const AcrossWeights& y,
                 const opencl::DeviceArray<float>& in, const opencl::DeviceArray<float>& out,
                 VdvrAcross shape);

}  // namespace vdvr
