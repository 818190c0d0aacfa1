#include "host/base/opencl/trust_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <iterator>
#include <limits>
#include <random>
#include <type_traits>

// As host/volume/brick_layout.hpp includes it: one definition for all of the host.
#define VDVR_DIALECT_HOST
#define VDVR_SAMPLE_TYPES 7
#define VDVR_RECORDS 2
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"  // the shared headers are C99
#include "shared/mixed_sampler.h"
#include "shared/trust.h"
#pragma GCC diagnostic pop

namespace vdvr::opencl {
namespace {

constexpr std::size_t n = VDVR_TRUST_VALUES;

const char* const contraction = "contraction";
const char* const reassociation = "two-sum";
const char* const fused = "fma";
const char* const quotients = "division";
const char* const roots = "square root";
const char* const conversions = "conversions";
const char* const subnormal = "subnormals";
const char* const nans = "infinity and NaN";
const char* const integers = "integers";
const char* const one_lane = "select and masks";

std::uint64_t bits(float v) { return std::bit_cast<std::uint32_t>(v); }
std::uint64_t bits(double v) { return std::bit_cast<std::uint64_t>(v); }
std::uint64_t bits(std::int32_t v) { return static_cast<std::uint32_t>(v); }
std::uint64_t bits(std::uint32_t v) { return v; }

float lost(float a, float b) {
  const float s = a + b, from_b = s - a;
  return (a - (s - from_b)) + (b - from_b);
}

// The numbers that value i has.
struct Value {
  float a, b, c, small, odd, next_odd;
  std::int32_t m, n, d;
};
Value value(const TrustInputs& in, std::size_t i) {
  const auto& v = in.values;
  return {v[i],         v[n + i],        v[2 * n + i],
          v[3 * n + i], v[4 * n + i],    v[4 * n + (i + 1) % n],
          in.whole[i],  in.whole[n + i], in.whole[2 * n + i]};
}

class Lines {
 public:
  explicit Lines(const TrustInputs& in) : in_(in) {}
  template <class F>
  void exactly(const char* check, const char* what, F&& f) {
    constexpr bool is_float = std::is_same_v<decltype(f(value(in_, 0))), float>;
    TrustLine line{check, what, is_float ? TrustKind::fp32 : TrustKind::whole, {}, {}, 0};
    for (std::size_t i = 0; i < n; ++i) line.bits.push_back(bits(f(value(in_, i))));
    lines.push_back(std::move(line));
  }
  void within(const char* check, const char* what, double ulps,
              const std::function<double(const Value&)>& f) {
    TrustLine line{check, what, TrustKind::fp32, {}, {}, ulps};
    for (std::size_t i = 0; i < n; ++i) line.exact.push_back(f(value(in_, i)));
    lines.push_back(std::move(line));
  }
  std::vector<TrustLine> lines;

 private:
  const TrustInputs& in_;
};

float from_whole(const Value& v) { return static_cast<float>(v.d % 1000); }

}  // namespace

TrustInputs trust_inputs() {
  TrustInputs in;
  std::mt19937 random(41);
  const auto mantissa = [&] { return 1.0f + static_cast<float>(random() >> 9) * 0x1p-23f; };
  const auto sign = [&] { return (random() & 1u) != 0 ? 1.0f : -1.0f; };
  in.values.resize(5 * n);
  in.whole.resize(3 * n);
  in.doubles.resize(3 * n);
  for (std::size_t i = 0; i < n; ++i) {
    const float a = mantissa(), b = mantissa();
    in.values[i] = a;
    in.values[n + i] = b;
    // Most sums with products cancel but for what the product rounds off.
    in.values[2 * n + i] = i % 4 == 3 ? sign() * mantissa() : -(a * b);
    in.values[3 * n + i] = sign() * std::ldexp(mantissa(), -18 - static_cast<int>(random() % 12));
    in.values[4 * n + i] = sign() * std::ldexp(mantissa(), -126);
    in.whole[i] = static_cast<std::int32_t>(random());
    in.whole[n + i] = static_cast<std::int32_t>(random());
    in.whole[2 * n + i] = static_cast<std::int32_t>(1 + random() % 100000);
    const auto longer = [&] { return double{mantissa()} + 0x1p-40 * double{mantissa()}; };
    const double x = longer(), y = longer();
    in.doubles[i] = x;
    in.doubles[n + i] = i % 2 == 0 ? y : 0x1p-30 * y;
    in.doubles[2 * n + i] = -(in.doubles[i] * in.doubles[n + i]);
  }
  constexpr std::int32_t least = std::numeric_limits<std::int32_t>::min(),
                         most = std::numeric_limits<std::int32_t>::max();
  const std::int32_t edges[][3] = {{least, most, 1}, {most, least, most},    {-1, 31, 2},
                                   {0, 32, 3},       {0x01000001, -1, 1000}, {0x7fffffc0, 0, 999}};
  for (std::size_t i = 0; i < std::size(edges); ++i)
    for (std::size_t k = 0; k < 3; ++k) in.whole[k * n + i] = edges[i][k];
  constexpr std::size_t brick_bytes = 3000;  // of 9^3 samples of the largest type, at a multiple of each
  in.samples.resize(VDVR_TRUST_BRICKS * brick_bytes);
  for (std::uint32_t brick = 0; brick < VDVR_TRUST_BRICKS; ++brick) {
    const std::uint32_t type = brick % 3, size = type == VDVR_F32 ? 4 : type == VDVR_U16 ? 2 : 1;
    // The last brick reads the base.
    const std::uint32_t lx = brick & 1u, ly = brick >> 1 & 1u,
                        lz = brick == 7       ? 1
                             : (lx | ly) != 0 ? brick >> 2
                                              : 1;
    const std::uint32_t offset = (brick * 37u - 100u) & 0x7fffu, shift = brick % 4;
    in.records.push_back(static_cast<std::uint32_t>(brick * brick_bytes / size));
    in.records.push_back(lx | ly << 3 | lz << 6 | type << 10 | shift << 12 |
                         (type == VDVR_F32 ? 0 : offset << 17));
    for (std::size_t at = brick * brick_bytes; at < (brick + 1) * brick_bytes; at += 4) {
      const std::uint32_t word = type == VDVR_F32 ? std::bit_cast<std::uint32_t>(sign() * mantissa())
                                                  : static_cast<std::uint32_t>(random());
      std::memcpy(in.samples.data() + at, &word, 4);
    }
  }
  for (int i = 0; i < VDVR_TRUST_POINTS; ++i) {
    // Every eighth on faces of cells.
    const auto place = [&] {
      const auto whole = static_cast<float>(random() % 17) * 0.5f;
      return i % 8 == 0 ? whole : 8.0f * (mantissa() - 1.0f);
    };
    const float x = place(), y = place(), z = place();
    in.points.push_back({x, y, z, 0.0f});
  }
  return in;
}

std::vector<TrustLine> scalar_lines(const TrustInputs& in) {
  Lines out(in);
  out.exactly(contraction, "a b + c", [](const Value& v) { return v.a * v.b + v.c; });
  out.exactly(contraction, "c - a b", [](const Value& v) { return v.c - v.a * -v.b; });
  out.exactly(contraction, "(1 - t) a + t b", [](const Value& v) { return (1.0f - v.a) * v.b + v.a * v.c; });
  out.exactly(contraction, "p = a b, p + c", [](const Value& v) { return v.a * v.b + v.c; });
  out.exactly(reassociation, "what a + b rounds off", [](const Value& v) { return lost(v.a, v.small); });
  out.exactly(reassociation, "(b + a) - a", [](const Value& v) { return (v.small + v.a) - v.a; });
  out.exactly(reassociation, "(a + b) - (b + c)",
              [](const Value& v) { return (v.a + v.b) - (v.b + v.small); });
  out.exactly(reassociation, "(a c) b", [](const Value& v) { return (v.a * v.small) * v.b; });
  out.exactly(fused, "fma(a, b, c)", [](const Value& v) { return std::fma(v.a, v.b, v.c); });
  out.exactly(fused, "fma(-a, b, c)", [](const Value& v) { return std::fma(-v.a, v.b, v.small); });
  // OpenCL C 1.2, 7.4: quotients within 2.5 ulp, roots within 3.
  out.within(quotients, "a / b", 2.5, [](const Value& v) { return double{v.a} / double{v.b}; });
  out.within(quotients, "c / a", 2.5, [](const Value& v) { return double{v.small} / double{v.a}; });
  out.within(quotients, "1 / b", 2.5, [](const Value& v) { return 1.0 / double{v.b}; });
  out.within(roots, "sqrt(a)", 3, [](const Value& v) { return std::sqrt(double{v.a}); });
  out.within(roots, "sqrt(c)", 3, [](const Value& v) { return std::sqrt(std::fabs(double{v.small})); });
  out.exactly(conversions, "int to float", [](const Value& v) { return static_cast<float>(v.m); });
  out.exactly(conversions, "uint to float",
              [](const Value& v) { return static_cast<float>(static_cast<std::uint32_t>(v.m)); });
  out.exactly(conversions, "ushort to float",
              [](const Value& v) { return static_cast<float>(static_cast<std::uint16_t>(v.n)); });
  out.exactly(conversions, "float to int",
              [](const Value& v) { return static_cast<std::int32_t>(v.a * from_whole(v)); });
  out.exactly(conversions, "rint",
              [](const Value& v) { return static_cast<std::int32_t>(std::rint(0.5f * from_whole(v))); });
  out.exactly(conversions, "floor", [](const Value& v) { return std::floor(v.c * 7.5f); });
  out.exactly(conversions, "ceil", [](const Value& v) { return std::ceil(v.c * 7.5f); });
  out.exactly(conversions, "round", [](const Value& v) { return std::round(0.5f * from_whole(v)); });
  out.exactly(subnormal, "a / 4", [](const Value& v) { return v.odd * 0.25f; });
  out.exactly(subnormal, "a - b", [](const Value& v) { return v.odd - v.next_odd; });
  out.exactly(subnormal, "a 2^-20", [](const Value& v) { return std::fabs(v.odd) * 0x1p-20f; });
  out.exactly(subnormal, "a 2^100 of a subnormal a",
              [](const Value& v) { return std::bit_cast<float>((v.m & 0x7fffff) | 1) * 0x1p100f; });
  // a <= FLT_MAX and isfinite(a) hold, !(NaN <= a) does; nothing else.
  out.exactly(nans, "comparisons", [](const Value&) { return 1u << 3 | 1u << 6 | 1u << 7; });
  const auto u = [](std::int32_t v) { return static_cast<std::uint32_t>(v); };
  out.exactly(integers, "m n", [u](const Value& v) { return u(v.m) * u(v.n); });
  out.exactly(integers, "m / d", [](const Value& v) { return v.m / v.d; });
  out.exactly(integers, "m % d", [](const Value& v) { return v.m % v.d; });
  out.exactly(integers, "m >> n", [](const Value& v) { return v.m >> (v.n & 31); });
  out.exactly(integers, "unsigned m >> n", [u](const Value& v) { return u(v.m) >> (v.n & 31); });
  out.exactly(integers, "1 << n", [](const Value& v) { return 1u << (v.n & 31); });
  out.exactly(integers, "clz", [u](const Value& v) { return std::countl_zero(u(v.m)); });
  out.exactly(integers, "64 bits, m n", [u](const Value& v) {
    return static_cast<std::uint32_t>(std::uint64_t{u(v.m)} * std::uint64_t{u(v.n)} >> 32);
  });
  out.exactly(integers, "64 bits, m / d", [u](const Value& v) {
    return static_cast<std::uint32_t>(((std::uint64_t{u(v.m)} << 20) + u(v.n)) / u(v.d));
  });
  out.exactly(one_lane, "select", [](const Value& v) { return v.m > v.n ? v.a : v.b; });
  out.exactly(one_lane, "comparisons", [](const Value& v) {
    return (v.m > v.n ? 1u : 4u) + (v.m == v.n ? 2u : 0u) + (v.m > v.n && v.n < v.d ? 8u : 0u);
  });
  out.exactly(one_lane, "fmax, fmin",
              [](const Value& v) { return std::fmax(v.a, v.c) - std::fmin(v.b, v.small); });
  out.exactly(integers, "bits of a float", [](const Value& v) { return v.m & 0x3fffffff; });
  return std::move(out.lines);
}

std::vector<TrustLine> vector_lines(const TrustInputs& in) {
  Lines out(in);
  out.exactly(contraction, "a b + c, vectors", [](const Value& v) { return v.a * v.b + v.c; });
  out.exactly(contraction, "(1 - t) a + t b, vectors",
              [](const Value& v) { return (1.0f - v.a) * v.b + v.a * v.c; });
  out.exactly(reassociation, "what a + b rounds off, vectors",
              [](const Value& v) { return lost(v.a, v.small); });
  out.exactly(fused, "fma(a, b, c), vectors", [](const Value& v) { return std::fma(v.a, v.b, v.c); });
  out.exactly(conversions, "int to float, vectors", [](const Value& v) { return static_cast<float>(v.m); });
  out.exactly(conversions, "float to int, vectors",
              [](const Value& v) { return static_cast<std::int32_t>(v.c * 1000.0f); });
  out.exactly(one_lane, "select, vectors", [](const Value& v) { return v.m > v.n ? v.a : v.b; });
  TrustLine lanes{one_lane, "masks, vectors", TrustKind::whole, {}, {}, 0};
  for (std::size_t first = 0; first < n; first += 8) {
    std::int32_t more = 0, less = 0;
    for (std::size_t i = first; i < first + 8; ++i) {
      more += in.whole[i] > in.whole[n + i] ? 1 : 0;
      less += in.whole[i] < in.whole[n + i] ? 1 : 0;
    }
    for (std::size_t i = first; i < first + 8; ++i)
      lanes.bits.push_back(bits((in.whole[i] > in.whole[n + i] ? -1 : 0) + (more > 0 ? 1 : 0) +
                                (more == 8 ? 2 : 0) + (less > 0 ? 4 : 0) + 8));
  }
  out.lines.push_back(lanes);
  return std::move(out.lines);
}

std::vector<TrustLine> double_lines(const TrustInputs& in) {
  std::vector<TrustLine> lines;
  const auto add = [&](const char* what, TrustKind kind,
                       const std::function<std::uint64_t(double, double, double, std::size_t)>& f) {
    TrustLine line{"double precision", what, kind, {}, {}, 0};
    for (std::size_t i = 0; i < n; ++i)
      line.bits.push_back(f(in.doubles[i], in.doubles[n + i], in.doubles[2 * n + i], i));
    lines.push_back(std::move(line));
  };
  add("a b + c", TrustKind::fp64, [](double a, double b, double c, std::size_t) { return bits(a * b + c); });
  add("what a + b rounds off", TrustKind::fp64, [](double a, double b, double, std::size_t) {
    const double s = a + b, from_b = s - a;
    return bits((a - (s - from_b)) + (b - from_b));
  });
  add("fma(a, b, c)", TrustKind::fp64,
      [](double a, double b, double c, std::size_t) { return bits(std::fma(a, b, c)); });
  add("a / b", TrustKind::fp64, [](double a, double b, double, std::size_t) { return bits(a / b); });
  add("double to float", TrustKind::fp32,
      [](double a, double, double, std::size_t) { return bits(static_cast<float>(a)); });
  add("float and int to double", TrustKind::fp64, [](double a, double, double, std::size_t i) {
    return bits((a < 2.0 ? 1.5 : 2.5) * static_cast<double>(i));
  });
  return lines;
}

TrustLine sampler_line(const TrustInputs& in) {
  TrustLine line{"sampler", "the field at points", TrustKind::fp32, {}, {}, 0};
  const VdvrGrid grid{8, 8, 8, 4, 2, 2, 2, 0x1p-10f, 1, 0, 0, 0};
  for (const auto& c : in.points) {
    const int x = vdvr_brick_of(c[0], 4, 2), y = vdvr_brick_of(c[1], 4, 2), z = vdvr_brick_of(c[2], 4, 2);
    const VdvrBrick b =
        vdvr_record(in.records.data() + 2 * ((z * 2 + y) * 2 + x), VDVR_RECORDS_COMPACT, grid);
    line.bits.push_back(bits(vdvr_sample_in_brick(
        in.samples.data(), b, vdvr_local(c[0], x, b.level_x, 4, 8, 1),
        vdvr_local(c[1], y, b.level_y, 4, 8, 0), vdvr_local(c[2], z, b.level_z, 4, 8, 0))));
  }
  return line;
}

std::array<std::int32_t, 4> atomic_totals(const TrustInputs& in) {
  std::array<std::int32_t, 4> totals{0, std::numeric_limits<std::int32_t>::min(), 0, 0};
  for (std::size_t i = 0; i < n; ++i) {
    const Value v = value(in, i);
    totals[0] += v.n & 255;
    totals[1] = std::max(totals[1], v.m);
    totals[2] = static_cast<std::int32_t>(static_cast<std::uint32_t>(totals[2]) | 1u << (i & 31));
    totals[3] = std::max(totals[3], std::bit_cast<std::int32_t>(std::fabs(v.c)));
  }
  return totals;
}

namespace {

double number(TrustKind kind, std::uint64_t bits) {
  if (kind == TrustKind::fp64) return std::bit_cast<double>(bits);
  const auto low = static_cast<std::uint32_t>(bits);
  return kind == TrustKind::fp32 ? double{std::bit_cast<float>(low)}
                                 : static_cast<double>(std::bit_cast<std::int32_t>(low));
}

}  // namespace

std::string wrong_answers(const TrustLine& line, const std::vector<std::uint64_t>& got, bool flushes) {
  std::size_t wrong = 0;
  double most = 0, found = 0, right = 0;
  for (std::size_t i = 0; i < got.size(); ++i) {
    const double is = number(line.kind, got[i]),
                 should = line.exact.empty() ? number(line.kind, line.bits[i]) : line.exact[i];
    double off = std::fabs(is - should);
    if (line.exact.empty()) {
      const bool flushed = flushes && line.check == subnormal && is == 0;
      if (got[i] == line.bits[i] || flushed) continue;
    } else {
      off = std::ldexp(off, 23 - std::ilogb(should));
      if (off <= line.ulps) continue;
    }
    if (wrong++ == 0 || !(off <= most)) {
      most = off;
      found = is;
      right = should;
    }
  }
  if (wrong == 0) return {};
  const std::string count = fmt::format("{}: {} of {} wrong", line.what, wrong, got.size());
  return line.exact.empty() ? fmt::format("{}, as {:.9g} for {:.9g}", count, found, right)
                            : fmt::format("{}, by {:.3g} units in the last place, where {:.3g} are allowed",
                                          count, most, line.ulps);
}

}  // namespace vdvr::opencl
