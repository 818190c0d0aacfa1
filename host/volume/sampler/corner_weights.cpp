#include "host/volume/sampler/corner_weights.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <vector>

namespace vdvr {
namespace {

// Samples of a cell in half steps, the first of them 0.
using HalfSteps = std::array<int, 8>;

int half_steps(std::size_t steps, std::size_t axis) { return (steps >> axis & 1U) != 0 ? 2 : 1; }

// Whether edges along which samples differ by the whole step join all corners.
bool is_joined(const HalfSteps& s, std::size_t steps) {
  std::array<bool, 8> reached{true};
  for (int round = 0; round < 7; ++round)
    for (std::size_t c = 0; c < 8; ++c)
      for (std::size_t a = 0; a < 3; ++a) {
        const std::size_t to = c ^ (std::size_t{1} << a);
        if (reached[c] && std::abs(s[c] - s[to]) == half_steps(steps, a)) reached[to] = true;
      }
  return std::find(reached.begin(), reached.end(), false) == reached.end();
}

// The sum of errors times samples is linear in the samples. So it is largest at a vertex of what they may be,
// where edges of whole steps join all corners.
void add_vertices(std::size_t steps, HalfSteps& s, std::size_t corner, std::vector<HalfSteps>& out) {
  if (corner == 8) {
    if (is_joined(s, steps)) out.push_back(s);
    return;
  }
  int from = -6, to = 6;
  for (std::size_t a = 0; a < 3; ++a) {
    if ((corner >> a & 1U) == 0) continue;
    const int beside = s[corner ^ (std::size_t{1} << a)], step = half_steps(steps, a);
    from = std::max(from, beside - step);
    to = std::min(to, beside + step);
  }
  for (s[corner] = from; s[corner] <= to; ++s[corner]) add_vertices(steps, s, corner + 1, out);
}

// Corner by corner, the samples of all vertices: sums over corners are taken of all at once.
struct Vertices {
  static constexpr std::size_t most = 128;
  std::size_t count = 0;
  std::array<std::array<double, most>, 8> samples{};
};

std::array<Vertices, 8> all_vertices() {
  std::array<Vertices, 8> all;
  for (std::size_t steps = 1; steps < 8; ++steps) {
    HalfSteps s{};
    std::vector<HalfSteps> found;
    add_vertices(steps, s, 1, found);
    if (found.size() > Vertices::most) throw std::logic_error("corner_weights: more vertices than foreseen");
    all[steps].count = found.size();
    for (std::size_t n = 0; n < found.size(); ++n)
      for (std::size_t c = 0; c < 8; ++c) all[steps].samples[c][n] = 0.5 * found[n][c];
  }
  return all;
}

double largest_sum(const Corners& off, const Vertices& vertices) {
  std::array<double, Vertices::most> sums{};
  for (std::size_t c = 0; c < 8; ++c)
    for (std::size_t n = 0; n < Vertices::most; ++n) sums[n] += off[c] * vertices.samples[c][n];
  return *std::max_element(sums.begin(), sums.begin() + static_cast<std::ptrdiff_t>(vertices.count));
}

}  // namespace

Corners trilinear_weights(const std::array<double, 3>& fraction) {
  Corners w{};
  for (std::size_t c = 0; c < 8; ++c) {
    w[c] = 1;
    for (std::size_t a = 0; a < 3; ++a) w[c] *= (c >> a & 1U) != 0 ? fraction[a] : 1 - fraction[a];
  }
  return w;
}

double sum_of_steps(std::size_t steps) {
  double sum = 0;
  for (std::size_t a = 0; a < 3; ++a) sum += 0.5 * half_steps(steps, a);
  return sum;
}

void raise_to_error(BySteps& largest, const Corners& off) {
  static const std::array<Vertices, 8> vertices = all_vertices();
  double moved = 0;
  for (const double d : off) moved += 0.5 * std::abs(d);
  for (std::size_t steps = 1; steps < 8; ++steps) {
    // No two samples of the cell differ by more than the sum of the steps.
    if (moved * sum_of_steps(steps) <= largest[steps]) continue;
    if (!std::isfinite(moved)) largest[steps] = std::numeric_limits<double>::infinity();
    largest[steps] = std::max(largest[steps], largest_sum(off, vertices[steps]));
  }
}

}  // namespace vdvr
