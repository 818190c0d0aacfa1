// Cosine series at many places at once, as `verify` computes them: in double precision, by a transform of its
// own. Nothing of build uses it.
#pragma once

#include <cstdint>
#include <vector>

namespace vdvr {

/// The sums f(x) over m < terms of a[m] cos(m x) at x = (n + 1/2) pi / places(), 0 <= n < places(). They
/// err by fewer than 6 (log2(terms) + 2) roundings in double precision of the sum of magnitudes of the a[m],
/// the largest of all series (docs/error-bounds.md, "What verify does", step 1).
class CosineTransform {
 public:
  /// Series that are summed side by side.
  static constexpr std::int64_t together = 16;

  /// At least `density` places to a term.
  CosineTransform(std::int64_t terms, std::int64_t density);
  [[nodiscard]] std::int64_t places() const { return length_ * shifts_; }
  /// The sup of |f| is at most so many times its largest magnitude at the places (Bernstein's inequality).
  [[nodiscard]] double rise() const;

  /// Of `together` series a[m * stride + series], the largest magnitude at the places. `work` is what the
  /// transform needs and may be used again. Cost: 2.5 places() log2(terms) operations a series.
  [[nodiscard]] double largest(const double* a, std::int64_t stride, std::vector<double>& work) const;
  /// out[n * out_stride + series] = f / unit, which is a power of two.
  void values(const double* a, std::int64_t stride, double unit, float* out, std::int64_t out_stride,
              std::vector<double>& work) const;

 private:
  void transform(const double* a, std::int64_t stride, std::int64_t shift, std::vector<double>& work) const;

  std::int64_t terms_, length_, shifts_;
  std::vector<double> root_;         // e^(2 pi i j / length): cosine and sine, j < length / 2
  std::vector<double> phase_;        // [shift][m]: e^(2 pi i m (shift + 1/4) / places): cosine and sine
  std::vector<std::int32_t> index_;  // by place in the transform
};

}  // namespace vdvr
