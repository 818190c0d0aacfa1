// What the steps of certified pictures err by in fp32, held to double precision: shares, coefficients of
// parts, and chains of steps whose lengths are off by what kernels may make of them (docs/pixel-bounds.md,
// theorem 6).
#define BOOST_TEST_MODULE certify_step
#include <boost/test/unit_test.hpp>

#include <fstream>
#include <sstream>

#include "host/base/opencl/embedded.hpp"
#include "host/picture/render/raycast.hpp"
#include "shared/certify_params.h"
#include "tests/support/device.hpp"
#include "tests/support/fields.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "tests/support/places.hpp"
#include "tests/support/tolerance.hpp"

using namespace vdvr;
using support::device;

namespace {

constexpr double u = tolerance::unit_roundoff;

/// The program of certified pictures, and the test's own kernels behind it.
cl::Program build_steps(int lanes, bool joint) {
  std::ifstream file(std::string(vdvr::support::source_dir) + "/tests/device/certify_step.cl");
  std::ostringstream text;
  text << opencl::resolve_source("picture/pixel/pixel_bounds.cl") << file.rdbuf();
  const ResidentVolume any(
      device(), as_mixed(fields::uniform(fields::centred_grid({4, 4, 4}), [](auto...) { return 0.5; })));
  RenderOptions o;
  opencl::Defines defines =
      raycast_defines(any.impl(), o, SamplerKind::buffer, GradientKind::central, {}, lanes);
  for (auto& [name, value] : defines)
    if (name == "VDVR_KERNEL") value = "VDVR_KERNEL_CERTIFY";
  defines.push_back({"VDVR_JOINT", joint ? "1" : "0"});
  opencl::State& state = device().state();
  cl::Program program(state.context, text.str());
  try {
    program.build({state.device}, opencl::build_options(defines).c_str());
  } catch (const cl::Error&) {
    BOOST_FAIL(program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(state.device));
  }
  return program;
}

double share(double x) { return -std::expm1(-x * std::log(2.0)); }

// --- chains ---

/// Of half of a part's values.
struct Half {
  double t1 = 0, t0 = 0;
  std::array<double, 3> c1{}, c0{};
};
struct TestPart {
  double length = 0;
  std::array<Half, 2> half;
};
using Chain = std::vector<TestPart>;

float rounded(double x) { return static_cast<float>(x); }

Half random_half(std::mt19937& random, double densest) {
  std::uniform_real_distribution<double> unit(0, 1);
  Half h;
  const double kind = unit(random);
  if (kind < 0.15) {  // clear
    h.c1.fill(-INFINITY);
    h.c0.fill(INFINITY);
    return h;
  }
  h.t1 = static_cast<double>(rounded(kind > 0.97 ? 1e30 : densest * unit(random)));
  h.t0 = unit(random) < 0.3 ? 0 : static_cast<double>(rounded(std::min(h.t1, densest) * unit(random)));
  for (std::size_t c = 0; c < 3; ++c) {
    const double a = static_cast<double>(rounded(unit(random))),
                 b = static_cast<double>(rounded(unit(random)));
    h.c1[c] = unit(random) < 0.2 ? 1 : std::max(a, b);
    h.c0[c] = unit(random) < 0.2 ? h.c1[c] : std::min(a, b);
  }
  return h;
}
/// Of parts that are all about as dense: from 2^-20 of what lies behind to all of it.
Chain random_chain(std::mt19937& random, int steps) {
  std::uniform_real_distribution<double> unit(0, 1);
  const double densest = std::exp2(-20 + 26 * unit(random));
  Chain chain(static_cast<std::size_t>(steps));
  for (TestPart& p : chain) {
    p.length = 0.05 + 1.7 * unit(random);
    p.half = {random_half(random, densest), random_half(random, densest)};
  }
  return chain;
}

Half both(const TestPart& p) {
  Half h;
  h.t1 = std::max(p.half[0].t1, p.half[1].t1);
  h.t0 = std::min(p.half[0].t0, p.half[1].t0);
  for (std::size_t c = 0; c < 3; ++c) {
    h.c1[c] = std::max(p.half[0].c1[c], p.half[1].c1[c]);
    h.c0[c] = std::min(p.half[0].c0[c], p.half[1].c0[c]);
  }
  return h;
}

/// Theorem 3; from below with the signs of colours turned.
double box_step(double t1, double t0, double c, double behind, double length) {
  return behind + (c - behind) * share(length * (c > behind ? t1 : t0));
}
double box_end(const Chain& chain, std::size_t c, bool up, double behind) {
  double end = up ? behind : -behind;
  for (std::size_t i = chain.size(); i-- > 0;) {
    const Half h = both(chain[i]);
    if (h.t1 > 0) end = box_step(h.t1, h.t0, up ? h.c1[c] : -h.c0[c], end, chain[i].length);
  }
  return end;
}
/// What a field may show that is within one half or the other, and changes ten times a part, at most.
double shown_end(const Chain& chain, std::size_t c, bool up, double behind) {
  double end = up ? behind : -behind;
  for (std::size_t i = chain.size(); i-- > 0;)
    for (int k = 0; k < 10; ++k) {
      double most = -INFINITY;
      for (const Half& h : chain[i].half) {
        const double colour = up ? h.c1[c] : -h.c0[c];
        most = std::max(most, h.t1 > 0 ? box_step(h.t1, h.t0, colour, end, chain[i].length / 10) : end);
      }
      end = most;
    }
  return end;
}

/// What theorem 6 says that box steps err by: each part's own, seen through what stands in front.
double box_error(const Chain& chain) {
  double error = 0;
  for (std::size_t i = chain.size(); i-- > 0;) {
    const Half h = both(chain[i]);
    if (!(h.t1 > 0)) continue;
    const double passes = 1 - share(chain[i].length * h.t0);
    error = error * passes + u / 2 + VDVR_STEP_ROUNDING * u * share(chain[i].length * h.t1);
  }
  return error;
}

struct Ends {
  std::array<float, 3> hi{}, minus_lo{};
  float error = 0;
};

/// The kernel's ends of chains whose parts are so many numbers, [step][number][chain].
std::vector<Ends> ends_of(const cl::Program& program, const char* kernel, int lanes,
                          const std::vector<float>& numbers, std::size_t count, std::size_t steps,
                          double behind) {
  VdvrCertify q{};
  q.sum_error = rounded(u / 2);
  q.share_error = rounded(VDVR_STEP_ROUNDING * u);
  q.joint_rounding = rounded(VDVR_JOINT_ROUNDING * u);
  opencl::State& state = device().state();
  const opencl::DeviceArray<float> parts(state, std::span<const float>(numbers), "parts"),
      ends(state, 7 * count, "ends");
  cl::KernelFunctor<VdvrCertify, cl::Buffer, cl_int, cl_int, cl_float, cl::Buffer> step(program, kernel);
  step(cl::EnqueueArgs(state.queue, cl::NDRange(count / static_cast<std::size_t>(lanes))), q, parts.buffer(),
       static_cast<cl_int>(count), static_cast<cl_int>(steps), rounded(behind), ends.buffer());
  const std::vector<float> all = ends.to_host();
  std::vector<Ends> result(count);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      result[i].hi[c] = all[c * count + i];
      result[i].minus_lo[c] = all[(3 + c) * count + i];
    }
    result[i].error = all[6 * count + i];
  }
  return result;
}

/// Lengths are up to `off` too long (1), too short (-1) or either (0): with the product by an extinction what
/// the exponent errs by is 8 u.
double off_by(double length, int off, std::mt19937& random) {
  const double sign = off == 0 ? (random() % 2 == 0 ? 1 : -1) : off;
  return length * (1 + 6 * u * sign);
}

std::vector<Ends> stepped(const cl::Program& program, int lanes, const std::vector<Chain>& chains, int off,
                          double behind) {
  const std::size_t count = chains.size(), steps = chains[0].size();
  std::mt19937 random(17);
  std::vector<float> numbers;
  for (std::size_t i = 0; i < steps; ++i) {
    const auto put = [&](auto&& number) {
      for (const Chain& chain : chains) numbers.push_back(rounded(number(chain[i])));
    };
    put([&](const TestPart& p) { return off_by(p.length, off, random); });
    for (std::size_t k = 0; k < 2; ++k) {
      put([&](const TestPart& p) { return p.half[k].t1; });
      put([&](const TestPart& p) { return -p.half[k].t0; });
      for (std::size_t c = 0; c < 3; ++c) put([&](const TestPart& p) { return p.half[k].c1[c]; });
      for (std::size_t c = 0; c < 3; ++c) put([&](const TestPart& p) { return -p.half[k].c0[c]; });
    }
  }
  return ends_of(program, "step_chains", lanes, numbers, count, steps, behind);
}

std::vector<Chain> random_chains(int steps) {
  std::mt19937 random(static_cast<unsigned>(steps));
  std::vector<Chain> chains;
  for (int i = 0; i < 64; ++i) chains.push_back(random_chain(random, steps));
  return chains;
}

}  // namespace

BOOST_AUTO_TEST_CASE(shares_are_as_well_known_as_they_are_small) {
  std::vector<float> x;
  std::mt19937 random(3);
  for (int exponent = -100; exponent <= 7; ++exponent)
    for (int i = 0; i < 2048; ++i)
      x.push_back(rounded(std::ldexp(1 + static_cast<double>(random() % (1 << 23)) * 0x1p-23, exponent)));
  for (float k = 1; k < 70; ++k) {
    for (const float near : {std::nextafter(k, 0.0f), k, std::nextafter(k, 100.0f), k - 0.5f})
      x.push_back(near);
  }
  x.insert(x.end(), {0.0f, 1e30f, 3e38f, INFINITY});
  while (x.size() % 16 != 0) x.push_back(1);
  opencl::State& state = device().state();
  for (const int lanes : {1, 4, 8, 16}) {
    const cl::Program program = build_steps(lanes, false);
    const opencl::DeviceArray<float> at(state, std::span<const float>(x), "x"),
        found(state, x.size(), "shares");
    cl::KernelFunctor<cl::Buffer, cl::Buffer> find(program, "find_absorbed");
    find(cl::EnqueueArgs(state.queue, cl::NDRange(x.size() / static_cast<std::size_t>(lanes))), at.buffer(),
         found.buffer());
    const std::vector<float> shares = found.to_host();
    double worst = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double right = share(static_cast<double>(x[i])), got = static_cast<double>(shares[i]);
      if (right == 0) BOOST_TEST(got == 0);
      else worst = std::max(worst, std::abs(got - right) / right);
    }
    BOOST_TEST_MESSAGE(lanes << " lanes: shares within " << worst / u << " u of themselves");
    BOOST_TEST(worst <= 3.2 * u);
  }
}

BOOST_AUTO_TEST_CASE(coefficients_of_parts_err_by_no_more_than_the_bound_is_widened_by) {
  constexpr int pieces = 512;
  std::mt19937 random(9);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<float> b(4 * pieces);
  for (int i = 0; i < pieces; ++i) {
    const double spread = std::exp2(-12 * std::abs(unit(random))), middle = unit(random) * (1 - spread);
    for (int k = 0; k < 4; ++k)
      b[static_cast<std::size_t>(k * pieces + i)] = rounded(middle + spread * unit(random));
  }
  opencl::State& state = device().state();
  const cl::Program program = build_steps(8, false);
  const opencl::DeviceArray<float> given(state, std::span<const float>(b), "pieces");
  double worst = 0;
  for (const int n : {1, 2, 3, 7, 10, 33, 63, VDVR_MOST_PARTS}) {
    const opencl::DeviceArray<float> cut(state, static_cast<std::uint64_t>(4 * pieces * n), "coefficients");
    cl::KernelFunctor<cl::Buffer, cl_int, cl_int, cl::Buffer> cut_pieces(program, "cut_pieces");
    cut_pieces(cl::EnqueueArgs(state.queue, cl::NDRange(pieces / 8)), given.buffer(), pieces, n,
               cut.buffer());
    const std::vector<float> found = cut.to_host();
    for (int i = 0; i < pieces; ++i) {
      std::array<double, 4> p{};
      for (std::size_t k = 0; k < 4; ++k)
        p[k] = static_cast<double>(b[k * pieces + static_cast<std::size_t>(i)]);
      double steepest = 0;
      for (std::size_t k = 0; k < 3; ++k) steepest = std::max(steepest, std::abs(p[k + 1] - p[k]));
      for (int part = 0; part < n; ++part) {
        // The blossom at the part's ends.
        const double ends[2] = {static_cast<double>(part) / n, (part + 1.0) / n};
        for (int k = 0; k < 4; ++k) {
          std::array<double, 4> q = p;
          for (std::size_t round = 0; round < 3; ++round) {
            const double s = ends[static_cast<int>(round) < k ? 1 : 0];
            for (std::size_t j = 0; j + round < 3; ++j) q[j] = (1 - s) * q[j] + s * q[j + 1];
          }
          const auto at = static_cast<std::size_t>(((part * 4) + k) * pieces + i);
          const double off = std::abs(static_cast<double>(found[at]) - q[0]);
          worst = std::max(worst, off / (static_cast<double>(VDVR_CUT_ROUNDING) * steepest + 2 * u));
        }
      }
    }
  }
  BOOST_TEST_MESSAGE("coefficients err by " << worst << " of what is allowed");
  BOOST_TEST(worst <= 1);
}

BOOST_AUTO_TEST_CASE(box_steps_err_by_no_more_than_they_say) {
  for (const int lanes : {1, 8}) {
    const cl::Program program = build_steps(lanes, false);
    double worst = 0, undamped = 0, least = INFINITY;
    for (const int steps : {1, 2, 30, 2000}) {
      const std::vector<Chain> chains = random_chains(steps);
      for (const double behind : {0.0, 0.5, 1.0})
        for (const int off : {-1, 0, 1}) {
          const auto ends = stepped(program, lanes, chains, off, behind);
          for (std::size_t i = 0; i < chains.size(); ++i) {
            const double allowed = static_cast<double>(ends[i].error);
            for (std::size_t c = 0; c < 3; ++c)
              for (const bool up : {true, false}) {
                const auto end = static_cast<double>(up ? ends[i].hi[c] : ends[i].minus_lo[c]);
                worst = std::max(worst, std::abs(end - box_end(chains[i], c, up, behind)) / allowed);
              }
            least = std::min(least, allowed - box_error(chains[i]) * (1 - 16 * u));
            undamped = std::max(undamped, allowed / (u * (steps + 1)));
          }
        }
    }
    BOOST_TEST_MESSAGE(lanes << " lanes: box steps err by " << worst << " of what they say, which is "
                             << undamped << " u a part at most");
    BOOST_TEST(worst <= 1);
    // What they say is the theorem's, whose shares are known to 12 u of themselves.
    BOOST_TEST(least >= 0);
    // A step that moves by little still rounds its sum, by up to half a unit: of the most that is said of
    // one, 20.5 units, that is 1/41. What nothing comes near would hide a fault.
    BOOST_TEST(worst > 1.0 / 41);
  }
}

BOOST_AUTO_TEST_CASE(joint_steps_hold_what_is_shown_and_are_within_box_steps) {
  const cl::Program box = build_steps(8, false), joint = build_steps(8, true);
  double outside = -1, gain = 0;
  int narrower = 0, wider = 0;
  for (const int steps : {1, 2, 5, 60}) {
    const std::vector<Chain> chains = random_chains(steps);
    for (const double behind : {0.0, 0.5, 1.0})
      for (const int off : {-1, 0, 1}) {
        const auto outer = stepped(box, 8, chains, off, behind),
                   inner = stepped(joint, 8, chains, off, behind);
        for (std::size_t i = 0; i < chains.size(); ++i)
          for (std::size_t c = 0; c < 3; ++c)
            for (const bool up : {true, false}) {
              const auto in = static_cast<double>(up ? inner[i].hi[c] : inner[i].minus_lo[c]),
                         out = static_cast<double>(up ? outer[i].hi[c] : outer[i].minus_lo[c]),
                         allowed = static_cast<double>(inner[i].error);
              outside = std::max(outside, (shown_end(chains[i], c, up, behind) - in) / allowed);
              if (in > out + allowed + static_cast<double>(outer[i].error)) ++wider;
              if (in < out - 1e-3) ++narrower;
              gain = std::max(gain, out - in);
            }
      }
  }
  BOOST_TEST_MESSAGE("joint steps: what is shown is beyond them by "
                     << outside << " of what they say they err by; " << narrower
                     << " ends narrower than of box steps, by " << gain << " at most");
  BOOST_TEST(outside <= 1);
  BOOST_TEST(wider == 0);
  BOOST_TEST(narrower > 1000);
}

// Of one step before a random colour, to either side of the formula.
BOOST_AUTO_TEST_CASE(a_joint_step_errs_by_no_more_than_it_says) {
  const cl::Program program = build_steps(1, true);
  const std::vector<Chain> chains = random_chains(1);
  const auto right = [&](const TestPart& p, std::size_t c, bool up, double behind) {
    const Half all = both(p);
    if (!(all.t1 > 0)) return behind;
    // H0 with what fp32 is allowed of it.
    double most = -INFINITY;
    for (const Half& h : p.half) {
      const double colour = up ? h.c1[c] : -h.c0[c],
                   shows = h.t1 > 0 ? (colour - behind) * (colour > behind ? h.t1 : h.t0) : 0.0;
      most = std::max(most, shows + VDVR_JOINT_ROUNDING * u * h.t1);
    }
    const double k = most > 0 ? all.t0 : all.t1,
                 length = k > 0 ? share(p.length * k) / k : p.length * std::log(2.0);
    return std::min(behind + most * length,
                    box_step(all.t1, all.t0, up ? all.c1[c] : -all.c0[c], behind, p.length));
  };
  double worst = 0;
  for (int k = 0; k <= 64; ++k) {
    const double behind = static_cast<double>(rounded(k / 64.0));
    for (const int off : {-1, 1}) {
      const auto ends = stepped(program, 1, chains, off, behind);
      for (std::size_t i = 0; i < chains.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c)
          for (const bool up : {true, false}) {
            const double exact = right(chains[i][0], c, up, up ? behind : -behind);
            const auto end = static_cast<double>(up ? ends[i].hi[c] : ends[i].minus_lo[c]);
            // H0 is a bound, so that fp32 may take it for more by what it is allowed, and for less by
            // nothing.
            const double of_h0 = 2 * VDVR_JOINT_ROUNDING * u * both(chains[i][0]).t1 * chains[i][0].length;
            worst = std::max({worst, (exact - end - of_h0) / static_cast<double>(ends[i].error),
                              (end - exact - of_h0) / static_cast<double>(ends[i].error)});
          }
    }
  }
  BOOST_TEST_MESSAGE("a joint step errs by " << worst << " of what it says");
  BOOST_TEST(worst <= 1);
}

// --- stretches ---

namespace {

/// The transfer function at three values, straight between them.
struct Bent {
  double length = 0;
  std::array<TransferPoint, 3> at;
};
using BentChain = std::vector<Bent>;

double halvings(double opacity) { return -std::log1p(-opacity) / std::log(2.0); }

/// Opacities of all sizes, also 0, and any colours; or `near` each other and no part opaque, as they mostly
/// are.
BentChain random_bent(std::mt19937& random, int steps, bool near) {
  std::uniform_real_distribution<double> unit(0, 1);
  const double densest = near                 ? std::exp2(-1 - 12 * unit(random))
                         : unit(random) < 0.3 ? 0.9999
                                              : std::exp2(-12 * unit(random)) * 0.999;
  BentChain chain(static_cast<std::size_t>(steps));
  for (Bent& p : chain) {
    p.length = 0.05 + 1.7 * unit(random);
    for (TransferPoint& x : p.at) {
      x.opacity = !near && unit(random) < 0.15 ? 0 : densest * unit(random);
      for (double& c : x.rgb) c = unit(random) < 0.2 ? 1 : unit(random);
      if (near) {
        x.opacity = p.at[0].opacity + (x.opacity - p.at[0].opacity) / 16;
        for (std::size_t c = 0; c < 3; ++c) x.rgb[c] = p.at[0].rgb[c] + (x.rgb[c] - p.at[0].rgb[c]) / 16;
      }
    }
  }
  return chain;
}

/// What a field shows that takes one of 65 values of a part in each twentieth of it, at most.
double bent_end(const BentChain& chain, std::size_t c, bool up, double behind) {
  double end = up ? behind : -behind;
  for (std::size_t i = chain.size(); i-- > 0;)
    for (int k = 0; k < 20; ++k) {
      double most = -INFINITY;
      for (int j = 0; j <= 64; ++j) {
        const TransferPoint &a = chain[i].at[j < 32 ? 0 : 1], &b = chain[i].at[j < 32 ? 1 : 2];
        const double f = (j < 32 ? j : j - 32) / 32.0, opacity = (1 - f) * a.opacity + f * b.opacity,
                     colour = (1 - f) * a.rgb[c] + f * b.rgb[c], seen = up ? colour : -colour;
        most = std::max(most, end + (seen - end) * share(halvings(opacity) * chain[i].length / 20));
      }
      end = most;
    }
  return end;
}

/// Box steps over the same values.
double bent_box_end(const BentChain& chain, std::size_t c, bool up, double behind) {
  double end = up ? behind : -behind;
  for (std::size_t i = chain.size(); i-- > 0;) {
    double t1 = 0, t0 = INFINITY, colour = -INFINITY;
    for (std::size_t k = 0; k < 3; ++k) {
      const TransferPoint& p = chain[i].at[k];
      t1 = std::max(t1, halvings(p.opacity));
      t0 = std::min(t0, halvings(p.opacity));
      const bool shows = p.opacity > 0 || (k > 0 && chain[i].at[k - 1].opacity > 0) ||
                         (k < 2 && chain[i].at[k + 1].opacity > 0);
      if (shows) colour = std::max(colour, up ? p.rgb[c] : -p.rgb[c]);
    }
    if (t1 > 0) end = box_step(t1, t0, colour, end, chain[i].length);
  }
  return end;
}

std::vector<Ends> stepped(const cl::Program& program, int lanes, const std::vector<BentChain>& chains,
                          int off, double behind) {
  std::mt19937 random(19);
  std::vector<float> numbers;
  for (std::size_t i = 0; i < chains[0].size(); ++i) {
    const auto put = [&](auto&& number) {
      for (const BentChain& chain : chains) numbers.push_back(rounded(number(chain[i])));
    };
    put([&](const Bent& p) { return off_by(p.length, off, random); });
    for (std::size_t k = 0; k < 3; ++k) {
      put([&](const Bent& p) { return halvings(p.at[k].opacity); });
      for (std::size_t c = 0; c < 3; ++c) put([&](const Bent& p) { return p.at[k].rgb[c]; });
    }
  }
  return ends_of(program, "step_stretches", lanes, numbers, chains.size(), chains[0].size(), behind);
}

}  // namespace

// docs/pixel-bounds.md, theorem 4.
BOOST_AUTO_TEST_CASE(joint_steps_hold_what_straight_stretches_show_and_little_more) {
  std::mt19937 random(23);
  for (const bool near : {false, true})
    for (const int lanes : {1, 8}) {
      const cl::Program program = build_steps(lanes, true);
      double outside = -1, of_joint = 0, of_box = 0;
      for (const int steps : {1, 2, 5, 40}) {
        std::vector<BentChain> chains;
        for (int i = 0; i < 64; ++i) chains.push_back(random_bent(random, steps, near));
        for (const double behind : {0.0, 0.4, 1.0})
          for (const int off : {-1, 0, 1}) {
            const auto ends = stepped(program, lanes, chains, off, behind);
            for (std::size_t i = 0; i < chains.size(); ++i)
              for (std::size_t c = 0; c < 3; ++c)
                for (const bool up : {true, false}) {
                  const auto end = static_cast<double>(up ? ends[i].hi[c] : ends[i].minus_lo[c]);
                  const double shown = bent_end(chains[i], c, up, behind);
                  outside = std::max(outside, (shown - end) / static_cast<double>(ends[i].error));
                  of_joint += end - shown;
                  of_box += bent_box_end(chains[i], c, up, behind) - shown;
                }
          }
      }
      BOOST_TEST_MESSAGE((near ? "near, " : "any, ")
                         << lanes << " lanes: what stretches show is beyond joint steps by " << outside
                         << " of what they say they err by; their slack is " << of_joint / of_box
                         << " of that of box steps");
      BOOST_TEST(outside <= 1);
      // Slack of box steps is of the first order in how far values lie apart, here a sixteenth; that of joint
      // steps is of the second.
      if (near) BOOST_TEST(of_joint < of_box / 4);
    }
}
