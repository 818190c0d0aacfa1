// The paper's bounds, from derivatives by cosine series.
#include "host/certify/bounds/paper_bounds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "host/field/fbp/axis_product.hpp"
#include "host/field/fbp/cosine_series.hpp"

namespace vdvr {
namespace {

using opencl::DeviceArray;

// Derivatives of `batch` boxes of samples [z][y][x] under mirror extension, at the samples.
class Derivatives {
 public:
  Derivatives(opencl::State& state, std::span<const float> samples, const Index3& size, const Vec3& spacing,
              std::int64_t batch)
      : state_(state),
        size_(size),
        spacing_(spacing),
        batch_(batch),
        samples_(state, samples, "samples"),
        a_(state, samples.size(), "derivatives"),
        b_(state, samples.size(), "derivatives"),
        axis_(state) {}

  // The sum over the boxes of the largest |derivative| of these orders along x, y, z; 0 along an axis of one
  // sample.
  double maximum(const std::array<int, 3>& orders) {
    const DeviceArray<float>* from = &samples_;
    DeviceArray<float>*to = &a_, *other = &b_;
    for (std::size_t j = 0; j < 3; ++j) {
      if (orders[j] == 0) continue;
      if (size_[j] == 1) return 0;
      apply(*to, *from, j, orders[j]);
      from = to;
      std::swap(to, other);
    }
    const std::vector<float> values = from->to_host();
    const std::size_t per_box = values.size() / static_cast<std::size_t>(batch_);
    double sum = 0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(batch_); ++k) {
      float largest = 0;
      for (std::size_t i = 0; i < per_box; ++i)
        largest = std::max(largest, std::abs(values[k * per_box + i]));
      sum += static_cast<double>(largest);
    }
    return sum;
  }

 private:
  void apply(const DeviceArray<float>& out, const DeviceArray<float>& in, std::size_t axis, int order) {
    std::int64_t inner = 1, outer = batch_;
    for (std::size_t j = 0; j < axis; ++j) inner *= size_[j];
    for (std::size_t j = axis + 1; j < 3; ++j) outer *= size_[j];
    const std::int64_t n = size_[axis];
    axis_(out, in, matrix(axis, order), outer, n, inner);
  }

  const DeviceArray<float>& matrix(std::size_t axis, int order) {
    const auto found = matrices_.find({axis, order});
    if (found != matrices_.end()) return found->second;
    const auto n = static_cast<std::size_t>(size_[axis]);
    std::vector<double> positions(n);
    for (std::size_t i = 0; i < n; ++i) positions[i] = static_cast<double>(i);
    const auto exact = resampling_matrix(size_[axis], positions, order, spacing_[axis], 1);
    return matrices_.emplace(std::pair{axis, order}, transposed_on_device(state_, exact, size_[axis]))
        .first->second;
  }

  opencl::State& state_;
  Index3 size_;
  Vec3 spacing_;
  std::int64_t batch_;
  DeviceArray<float> samples_, a_, b_;
  AxisProduct axis_;
  std::map<std::pair<std::size_t, int>, DeviceArray<float>> matrices_;
};

}  // namespace

std::vector<Bound> paper_projection_bounds(opencl::State& state, const FilteredScan& scan,
                                           const std::vector<int>& rates, std::int64_t step) {
  const ParallelGeometry& g = scan.geometry;
  const std::int64_t looked_at = (g.views() + step - 1) / step;
  // So many views at once that three times as much stays small, whatever the scan's size.
  constexpr std::int64_t together_samples = std::int64_t{16} << 20;
  const std::int64_t view = g.rows * g.columns,
                     together = std::clamp<std::int64_t>(together_samples / view, 1, looked_at);
  double uu = 0, vv = 0, uuv = 0, uvv = 0;
  for (std::int64_t first = 0; first < looked_at; first += together) {
    const std::int64_t n = std::min(together, looked_at - first);
    std::vector<float> some(static_cast<std::size_t>(n * view));
    for (std::int64_t i = 0; i < n; ++i)
      std::copy_n(scan.samples.data() + (first + i) * step * view, view, some.data() + i * view);
    Derivatives d(state, some, {g.rows, g.columns, 1}, {g.pitch_v, g.pitch_u, 1}, n);
    uu += d.maximum({0, 2, 0});
    vv += d.maximum({2, 0, 0});
    uuv += d.maximum({1, 2, 0});
    uvv += d.maximum({2, 1, 0});
  }
  const double share = static_cast<double>(g.views()) / static_cast<double>(looked_at);
  for (double* sum : {&uu, &vv, &uuv, &uvv}) *sum *= share;
  std::vector<Bound> out;
  for (const int rate : rates) {
    const double width = std::max(g.pitch_u, g.pitch_v) / rate;
    out.push_back(
        {"projection", "paper Eq. 5, at samples", rate, std::pow(g.pitch_u / rate, 2) / 8 * uu, false});
    out.push_back({"projection", "paper Eq. 7, at samples", rate,
                   width * width / 8 * (uu + vv) + std::pow(width, 3) / 4 * (uuv + uvv), false});
  }
  return out;
}

std::vector<Bound> paper_gold_bounds(opencl::State& state, const Volume& base,
                                     const std::vector<int>& rates) {
  const Index3 n = base.grid.samples();
  Derivatives d(state, base.samples, n, base.grid.spacing, 1);
  double second = 0, third = 3 * d.maximum({1, 1, 1});
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      std::array<int, 3> orders{0, 0, 0};
      orders[i] += 2;
      if (i == j) {
        second += d.maximum(orders);
        continue;
      }
      orders[j] += 1;
      third += d.maximum(orders);
    }
  const double spacing = *std::max_element(base.grid.spacing.begin(), base.grid.spacing.end());
  std::vector<Bound> out;
  for (const int rate : rates) {
    const double step = spacing / rate;
    out.push_back({"gold", "paper Eq. 9, 1x volume at samples", rate,
                   step * step / 8 * second + std::pow(step, 3) / 4 * third, false});
  }
  return out;
}

}  // namespace vdvr
