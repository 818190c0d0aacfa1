#include "host/picture/render/bake.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "shared/raycast_params.h"

namespace vdvr {
namespace {

// 16 KiB stay in a CPU's first cache; 1024 steps are finer than 8-bit pictures show.
constexpr int kTableSize = 1024;
// 1 MiB of colours stays in a second cache.
constexpr int kSquareSize = 256;
// Samples of the transfer function between two entries of the square table: a jump is placed to a 16th.
constexpr int kPerEntry = 16;
// Pieces that a path is cut into at most, each of which emits its mean colour.
constexpr int kPieces = 48;
// Extinction of one base cell that stands for full opacity: any step lets nothing through.
constexpr double kOpaque = 1e5;

void set_scale(BakedTransfer& t, double lo, double hi, int size) {
  t.size = size;
  t.lo = static_cast<float>(lo);
  t.scale = hi > lo ? static_cast<float>((size - 1) / (hi - lo)) : 0.0f;
  // A range that fp32 cannot tell from a point has one colour.
  if (!std::isfinite(t.scale)) t.scale = 0;
}

void append_opacities(std::vector<cl_float4>& rows, const std::vector<float>& opacities) {
  const std::size_t first = rows.size();
  rows.resize(first + (opacities.size() + 3) / 4);
  for (std::size_t i = 0; i < opacities.size(); ++i) rows[first + i / 4].s[i % 4] = opacities[i];
}

/// `shows(i)`: entry i or the stretch between it and the next does.
template <class Shows>
std::vector<std::uint8_t> stretches(int size, Shows&& shows) {
  std::vector<std::uint8_t> result;
  int number = 1;
  bool was_empty = false;
  for (int i = 0; i < size; ++i) {
    const bool empty = !shows(i);
    if (!empty && was_empty) ++number;
    was_empty = empty;
    // There may be more than a byte counts; the others are looked into as if they showed something.
    result.push_back(static_cast<std::uint8_t>(empty && number < 256 ? number : 0));
  }
  return result;
}

/// Extinction, and extinction times colour.
using Emission = std::array<double, 4>;

Emission emission_at(const TransferFunction& f, double value) {
  const TransferPoint p = transfer_at(f.points, value);
  const double tau = p.opacity < 1 ? std::min(kOpaque, -std::log1p(-p.opacity)) : kOpaque;
  return {tau * p.rgb[0], tau * p.rgb[1], tau * p.rgb[2], tau};
}

/// What a path of `length` emits and absorbs on which the field runs from entry i to entry j.
cl_float4 path(const std::vector<Emission>& sums, const std::vector<Emission>& at, int i, int j,
               double length) {
  Emission sum{0, 0, 0, 0};  // colour, opacity
  const auto add = [&](const Emission& mean, double piece) {
    const double absorbed = -std::expm1(-mean[3] * piece), weight = (1 - sum[3]) * absorbed;
    for (std::size_t c = 0; c < 3 && mean[3] > 0; ++c) sum[c] += weight * mean[c] / mean[3];
    sum[3] += weight;
  };
  const int fine = std::abs(j - i) * kPerEntry, pieces = std::min(fine, kPieces);
  if (fine == 0) add(at[static_cast<std::size_t>(i)], length);
  for (int k = 0; k < pieces; ++k) {
    const int sign = j > i ? 1 : -1, from = i * kPerEntry + sign * (fine * k / pieces),
              to = i * kPerEntry + sign * (fine * (k + 1) / pieces);
    const Emission &a = sums[static_cast<std::size_t>(std::min(from, to))],
                   &b = sums[static_cast<std::size_t>(std::max(from, to))];
    const double count = std::abs(to - from);
    Emission mean{};
    for (std::size_t c = 0; c < 4; ++c) mean[c] = (b[c] - a[c]) / count;
    add(mean, length * count / fine);
  }
  cl_float4 e{};
  for (std::size_t c = 0; c < 4; ++c) e.s[c] = static_cast<float>(sum[c]);
  return e;
}

}  // namespace

int BakedTransfer::first_entry(float value) const {
  const float x = std::clamp((value - lo) * scale, 0.0f, static_cast<float>(size - 1));
  return std::min(static_cast<int>(x), size - 2);
}

std::pair<float, float> BakedTransfer::shown_places() const {
  constexpr float kFar = std::numeric_limits<float>::infinity();
  const auto shows = [](std::uint8_t s) { return s == 0; };
  const auto first = std::find_if(stretch.begin(), stretch.end(), shows);
  if (first == stretch.end()) return {kFar, -kFar};
  const auto last = std::find_if(stretch.rbegin(), stretch.rend(), shows);
  // A value between two entries is made of both, one beyond all is the outermost.
  const auto from = first - stretch.begin() - 1, to = stretch.rend() - last;
  return {from > 0 ? static_cast<float>(from) : -kFar, to < size - 1 ? static_cast<float>(to) : kFar};
}

std::uint8_t BakedTransfer::stretch_of(float low, float high) const {
  const auto first = static_cast<std::size_t>(first_entry(low)),
             last = static_cast<std::size_t>(first_entry(high)) + 1;
  for (std::size_t i = first; i <= last; ++i)
    if (stretch[i] == 0) return 0;
  return stretch[first];
}

BakedTransfer bake(const TransferFunction& transfer, double step, int levels) {
  BakedTransfer t;
  // Iso-surfaces have colours of their own.
  const std::vector<TransferPoint> none{{0, {0, 0, 0}, 0}};
  const auto& points = transfer.points.empty() ? none : transfer.points;
  const double lo = points.front().value, hi = points.back().value;
  set_scale(t, lo, hi, kTableSize);
  std::vector<float> opacities;
  for (int level = 0; level < levels; ++level)
    for (int i = 0; i < kTableSize; ++i) {
      const TransferPoint p = transfer_at(points, lo + (hi - lo) * i / (kTableSize - 1));
      // `opacity` is over one base cell: what passes n steps of length s passes as much as n s base cells.
      opacities.push_back(static_cast<float>(1 - std::pow(1 - p.opacity, std::ldexp(step, -level))));
      if (level > 0) continue;
      cl_float4 e{};
      for (std::size_t c = 0; c < 3; ++c) e.s[c] = static_cast<float>(p.rgb[c]);
      e.s[3] = opacities.back();
      t.rows.push_back(e);
    }
  append_opacities(t.rows, opacities);
  // One number for all: samples are single values.
  for (int i = 0; i < kTableSize; ++i)
    t.stretch.push_back(opacities[static_cast<std::size_t>(i)] > 0 ? 0 : 1);
  return t;
}

BakedTransfer bake_adaptive(const TransferFunction& transfer, double step) {
  BakedTransfer t = bake(transfer, step, VDVR_ADAPTED_LEVELS);
  const auto entry = [&](int i) {
    const cl_float4& e = t.rows[static_cast<std::size_t>(i)];
    return std::array<float, 4>{e.s[3] * e.s[0], e.s[3] * e.s[1], e.s[3] * e.s[2], e.s[3]};
  };
  std::vector<float> sums{0};
  for (int i = 1; i < t.size; ++i) {
    const auto a = entry(i - 1), b = entry(i);
    float change = 0;
    for (std::size_t c = 0; c < 4; ++c) change = std::max(change, std::abs(b[c] - a[c]));
    sums.push_back(sums.back() + change);
  }
  append_opacities(t.rows, sums);
  // Between two clear stretches lies something that a step may pass.
  t.stretch = stretches(t.size, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    return entry(i)[3] > 0 || (i + 1 < t.size && sums[k + 1] > sums[k]);
  });
  return t;
}

BakedTransfer bake_preintegrated(const TransferFunction& transfer, double step,
                                 const std::pair<float, float>& range) {
  BakedTransfer t;
  const double lo = static_cast<double>(range.first), hi = static_cast<double>(range.second);
  set_scale(t, lo, hi, kSquareSize);
  const double width = (hi - lo) / (kSquareSize - 1);
  std::vector<Emission> at, sums{{0, 0, 0, 0}};
  for (int i = 0; i < kSquareSize; ++i) {
    at.push_back(emission_at(transfer, lo + width * i));
    for (int k = 0; k < kPerEntry && i + 1 < kSquareSize; ++k) {
      const Emission e = emission_at(transfer, lo + width * (i + (k + 0.5) / kPerEntry));
      Emission sum = sums.back();
      for (std::size_t c = 0; c < 4; ++c) sum[c] += e[c];
      sums.push_back(sum);
    }
  }
  std::vector<float> opacities;
  for (int i = 0; i < kSquareSize; ++i)
    for (int j = 0; j < kSquareSize; ++j) {
      t.rows.push_back(path(sums, at, i, j, step));
      opacities.push_back(t.rows.back().s[3]);
    }
  append_opacities(t.rows, opacities);
  const auto sum_at = [&](int i) { return sums[static_cast<std::size_t>(i * kPerEntry)][3]; };
  t.stretch = stretches(kSquareSize, [&](int i) {
    return at[static_cast<std::size_t>(i)][3] > 0 || (i + 1 < kSquareSize && sum_at(i + 1) > sum_at(i));
  });
  return t;
}

}  // namespace vdvr
