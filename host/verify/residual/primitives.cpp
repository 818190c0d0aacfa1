#include "host/verify/residual/primitives.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>

namespace vdvr {
namespace {

using std::numbers::pi;
constexpr std::int64_t nodes_per_column = 16;

std::int64_t length_for(std::int64_t columns) {
  return static_cast<std::int64_t>(std::bit_ceil(static_cast<std::uint64_t>(2 * nodes_per_column * columns)));
}

}  // namespace

PrimitiveMaker::PrimitiveMaker(std::int64_t columns)
    : columns_(columns), length_(length_for(columns)), transform_(length_) {}

std::uint64_t PrimitiveMaker::bytes() const {
  return static_cast<std::uint64_t>(length_ / 2 + 2) * sizeof(Primitive::Piece) +
         static_cast<std::uint64_t>(length_) * 2 * sizeof(std::complex<double>);
}

// Nodes are i h - 1/2 - h. A piece lies beyond either end of the detector, where the series goes on.
Primitive PrimitiveMaker::operator()(std::span<const double> a) const {
  const auto n = static_cast<std::size_t>(length_), half = n / 2;
  const double h = 2 * static_cast<double>(columns_) / static_cast<double>(length_);
  // One transform gives q in the real part and the sines of Q in the imaginary one, the other q'.
  std::vector<std::complex<double>> value(n), slope(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto bin = static_cast<std::size_t>(transform_.bin_at(static_cast<std::int64_t>(i))),
               m = std::min(bin, n - bin);
    if (m >= a.size()) continue;
    if (m == 0) {
      value[i] = a[0];
      continue;
    }
    const double omega = pi * static_cast<double>(m) / static_cast<double>(columns_),
                 sign = bin == m ? 1 : -1;
    value[i] = 0.5 * (a[m] + sign * a[m] / omega);
    slope[i] = -0.5 * sign * a[m] * omega;
  }
  transform_.inverse(value);
  transform_.inverse(slope);
  // slope holds sum of -a omega sin / i: its imaginary part, turned.
  struct Node {
    double q0, q1, q2;  // Q, h Q', h^2 Q''
  };
  const auto node = [&](std::int64_t i) {
    const auto j = static_cast<std::size_t>((i + length_) % length_);
    return Node{a[0] * h * static_cast<double>(i) + value[j].imag(), h * value[j].real(),
                h * h * slope[j].imag()};
  };
  Primitive out;
  out.per_column_ = 1 / h;
  out.pieces_.reserve(half + 2);
  Node l = node(-1);
  for (std::int64_t i = 0; i <= static_cast<std::int64_t>(half) + 1; ++i) {
    const Node r = node(i);
    const double d = r.q0 - l.q0;
    out.pieces_.push_back({{l.q0, l.q1, 0.5 * l.q2, 10 * d - 6 * l.q1 - 4 * r.q1 - 1.5 * l.q2 + 0.5 * r.q2,
                            -15 * d + 8 * l.q1 + 7 * r.q1 + 1.5 * l.q2 - r.q2,
                            6 * d - 3 * (l.q1 + r.q1) - 0.5 * (l.q2 - r.q2)}});
    l = r;
  }
  bound(out, a);
  return out;
}

// docs/residual.md, "Bounds".
void PrimitiveMaker::bound(Primitive& out, std::span<const double> a) const {
  const double h = 1 / out.per_column_;
  double fourth = 0, fifth = 0, integral = std::abs(a[0]) * static_cast<double>(columns_);
  out.largest = std::abs(a[0]);
  for (std::size_t m = 1; m < a.size(); ++m) {
    const double omega = pi * static_cast<double>(m) / static_cast<double>(columns_), b = std::abs(a[m]);
    integral += b / omega;
    out.largest += b;
    out.slope += b * omega;
    fourth += b * std::pow(omega, 4);
    fifth += b * std::pow(omega, 5);
  }
  const double stages = std::log2(static_cast<double>(length_)),
               rounding = 0x1p-53 * (16 * stages + 512) * (integral + out.largest + h * out.slope);
  out.apart = 2 * (std::pow(h, 6) / 46080 * fifth + 4 * rounding);
  out.anywhere = std::pow(h, 5) / 1920 * fifth + kNarrow * kNarrow / 24 * std::pow(h, 3) / 6 * fifth +
                 std::pow(kNarrow, 4) / 1920 * fourth + 2048 * rounding;
}

Primitive::Place Primitive::at(double x) const {
  const double y = (x + 0.5) * per_column_ + 1;
  const auto i = std::clamp<std::int64_t>(static_cast<std::int64_t>(y), 0,
                                          static_cast<std::int64_t>(pieces_.size()) - 1);
  return {pieces_.data() + i, y - static_cast<double>(i)};
}

double Primitive::mean(double from, double to) const {
  const double width = to - from;
  if (std::abs(width) >= kNarrow) {
    const auto value = [&](double x) {
      const auto [piece, f] = at(x);
      const auto& c = piece->c;
      return c[0] + f * (c[1] + f * (c[2] + f * (c[3] + f * (c[4] + f * c[5]))));
    };
    return (value(to) - value(from)) / width;
  }
  const auto [piece, f] = at(0.5 * (from + to));
  const auto& c = piece->c;
  const double q = per_column_ * (c[1] + f * (2 * c[2] + f * (3 * c[3] + f * (4 * c[4] + f * 5 * c[5])))),
               curved = std::pow(per_column_, 3) * (6 * c[3] + f * (24 * c[4] + f * 60 * c[5]));
  return q + width * width / 24 * curved;
}

}  // namespace vdvr
