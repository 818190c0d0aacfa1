// Antiderivatives of a view's filtered rows: quintic Hermite pieces through the cosine series and its
// derivatives at nodes, and bounds on what such a piece errs (docs/residual.md).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "host/base/opencl/host_fft.hpp"

namespace vdvr {

/// Below this many columns between a ray's ends a mean value is taken of the row itself and its second
/// derivative, not as a difference of antiderivatives.
inline constexpr double kNarrow = 0x1p-7;

/// Q with Q' = q, q(x) = sum_m a_m cos(pi m (x + 1/2) / n), x in columns.
class Primitive {
 public:
  /// Mean of q between two places on the detector.
  [[nodiscard]] double mean(double from, double to) const;

  /// |mean - its exact value| is at most `apart` / |to - from| for ends apart by kNarrow or more, and
  /// `anywhere` always.
  double apart = 0, anywhere = 0;
  double largest = 0, slope = 0;  ///< bounds of |q| and |q'|

 private:
  friend class PrimitiveMaker;
  struct Piece {
    std::array<double, 6> c{};  ///< of powers of the part of the piece that is passed
  };
  struct Place {
    const Piece* piece;
    double part;
  };
  [[nodiscard]] Place at(double x) const;

  std::vector<Piece> pieces_;
  double per_column_ = 1;
};

class PrimitiveMaker {
 public:
  /// `columns` samples a row. Pieces are a 16th to a 32nd of a column.
  explicit PrimitiveMaker(std::int64_t columns);
  /// Of the cosine coefficients a_m. Cost: two FFTs of 32 to 64 times the columns.
  [[nodiscard]] Primitive operator()(std::span<const double> coefficients) const;
  /// Bytes of a primitive, and of the work on one.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  void bound(Primitive& out, std::span<const double> coefficients) const;

  std::int64_t columns_, length_;
  fft::HostFft transform_;
};

}  // namespace vdvr
