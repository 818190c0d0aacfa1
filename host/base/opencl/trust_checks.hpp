// What a device should answer to kernels/base/opencl/trust.cl, computed on the host.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "vdvr/device.hpp"

namespace vdvr::opencl {

/// What a line's answers are: its bits are read so.
enum class TrustKind : std::uint8_t { fp32, fp64, whole };

/// One line of results: the check it belongs to, what it computes, and the answer for each value.
struct TrustLine {
  std::string check, what;
  TrustKind kind = TrustKind::fp32;
  std::vector<std::uint64_t> bits;
  /// Of quotients and roots: what they are, and how many units in the last place they may err.
  std::vector<double> exact;
  double ulps = 0;
};

struct TrustInputs {
  std::vector<float> values;        // [5][values]
  std::vector<std::int32_t> whole;  // [3][values]
  std::vector<double> doubles;      // [3][values]
  std::vector<std::uint8_t> samples;
  std::vector<std::uint32_t> records;
  std::vector<std::array<float, 4>> points;
};

/// The same in every run.
TrustInputs trust_inputs();
std::vector<TrustLine> scalar_lines(const TrustInputs& in);
std::vector<TrustLine> vector_lines(const TrustInputs& in);
std::vector<TrustLine> double_lines(const TrustInputs& in);
TrustLine sampler_line(const TrustInputs& in);
std::array<std::int32_t, 4> atomic_totals(const TrustInputs& in);

/// "a b + c: 48 of 64 wrong, as 1.1e-08 for 0"; empty where none is. `flushes`: the device says that it takes
/// subnormal numbers for 0.
std::string wrong_answers(const TrustLine& line, const std::vector<std::uint64_t>& got, bool flushes);

}  // namespace vdvr::opencl
