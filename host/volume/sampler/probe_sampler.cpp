// What the device's texture unit does to weights and constants, and which sampler is faster (method:
// docs/error-bounds.md, samplers). Launches: read_points, rate_image, rate_buffer of
// kernels/volume/sampler/probe_sampler.cl.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <random>
#include <set>
#include <utility>

#include "host/base/opencl/kernel.hpp"
#include "host/base/system/parallel.hpp"
#include "host/volume/sampler/corner_weights.hpp"
#include "host/volume/sampler/remembered_probe.hpp"
#include "vdvr/expert/probe_sampler.hpp"

namespace vdvr {
namespace {

using opencl::DeviceArray;

constexpr std::uint32_t kSide = 64;
// A unit that rounds to 8 fraction bits may add a few ulp of its own; 2^-20 keeps it in its class.
constexpr double slack = 0x1p-20;
// Not all fractions are tried (docs/error-bounds.md, section 8).
constexpr double untried = 1.1;
const opencl::Defines kDefines{{"VDVR_SAMPLE_TYPES", "1"}};  // the rates are those of float32

struct ProbePoint {
  std::array<std::uint32_t, 3> cell{};
  std::array<double, 3> fraction{};
};

// A cube of samples, as the device reads them.
struct Tile {
  std::vector<double> truth;
  cl::Image3D image;
};

template <class T>
cl::Image3D make_image(opencl::State& state, const std::vector<T>& values, cl_channel_type format) {
  const DeviceArray<T> staged(state, std::span<const T>(values), "probe tile");
  try {
    cl::Image3D image(state.context, CL_MEM_READ_ONLY, cl::ImageFormat(CL_R, format), kSide, kSide, kSide);
    state.queue.enqueueCopyBufferToImage(staged.buffer(), image, 0, cl::array<cl::size_type, 3>{0, 0, 0},
                                         cl::array<cl::size_type, 3>{kSide, kSide, kSide});
    state.queue.finish();
    return image;
  } catch (const cl::Error& e) {
    throw DeviceError(fmt::format("probe image of {}^3 texels on '{}': {} {}", kSide, state.info.name,
                                  e.what(), opencl::code_name(e.err())));
  }
}

// Values in [0, 1], rounded to what a normalised format holds.
template <class T>
Tile make_normalised(opencl::State& state, const std::vector<float>& values, cl_channel_type format) {
  constexpr double most = std::numeric_limits<T>::max();
  Tile tile;
  std::vector<T> codes;
  for (const float v : values) {
    codes.push_back(static_cast<T>(std::lround(std::clamp(static_cast<double>(v), 0.0, 1.0) * most)));
    tile.truth.push_back(codes.back() / most);
  }
  tile.image = make_image(state, codes, format);
  return tile;
}

Tile make_tile(opencl::State& state, const std::vector<float>& values, SampleType type) {
  if (type == SampleType::u16) return make_normalised<std::uint16_t>(state, values, CL_UNORM_INT16);
  if (type == SampleType::u8) return make_normalised<std::uint8_t>(state, values, CL_UNORM_INT8);
  return {{values.begin(), values.end()}, make_image(state, values, CL_FLOAT)};
}

template <class Field>
std::vector<float> cube(const Field& f) {
  std::vector<float> values;
  values.reserve(kSide * kSide * kSide);
  for (std::uint32_t z = 0; z < kSide; ++z)
    for (std::uint32_t y = 0; y < kSide; ++y)
      for (std::uint32_t x = 0; x < kSide; ++x) values.push_back(static_cast<float>(f(x, y, z)));
  return values;
}

std::vector<float> read_points(opencl::State& state, const cl::Image3D& image,
                               const std::vector<ProbePoint>& points) {
  std::vector<cl_float4> where;
  for (const auto& p : points) {
    cl_float4 c{{0, 0, 0, 0}};
    for (std::size_t a = 0; a < 3; ++a) c.s[a] = static_cast<float>(p.cell[a] + p.fraction[a] + 0.5);
    where.push_back(c);
  }
  const DeviceArray<cl_float4> in(state, std::span<const cl_float4>(where), "probe points");
  const DeviceArray<float> out(state, points.size(), "probe values");
  opencl::Kernel<cl::Image3D, cl::Buffer, cl_uint, cl::Buffer> kernel(state, "volume/sampler/probe_sampler",
                                                                      "read_points", kDefines);
  kernel({{points.size(), 1, 1}, {64, 1, 1}}, image, in.buffer(), static_cast<cl_uint>(points.size()),
         out.buffer());
  return out.to_host();
}

// Fractions are multiples of 2^-14 and coordinates below 64, so that every coordinate is exact in fp32 and
// what is measured is the unit's, not the coordinate's rounding.
std::vector<ProbePoint> weight_points(std::size_t axis) {
  std::vector<ProbePoint> points;
  for (std::uint32_t i = 0; i < (1u << 14); ++i) {
    ProbePoint p{{7, 11, 13}, {0, 0, 0}};
    // An odd multiplier visits every cell of the row with every kind of fraction.
    p.cell[axis] = i * 29u % (kSide - 1);
    p.fraction[axis] = static_cast<double>(i) * 0x1p-14;
    points.push_back(p);
  }
  return points;
}

double over_steps(const BySteps& errors) {
  double largest = 0;
  for (std::size_t k = 1; k < errors.size(); ++k) largest = std::max(largest, errors[k] / sum_of_steps(k));
  return largest;
}

// Of each two the second has fractions next to the middle of two multiples of 2^-8, where units that round to
// these err most.
std::vector<ProbePoint> scattered_points() {
  std::mt19937 random(20060301);
  std::vector<ProbePoint> points(1u << 15);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t a = 0; a < 3; ++a) {
      points[i].cell[a] = static_cast<std::uint32_t>(random() % (kSide - 1));
      std::uint32_t fraction = random() % (1u << 14);
      if (i % 2 == 1) fraction = (fraction & ~63u) + 31 + 2 * (fraction & 1u);
      points[i].fraction[a] = fraction * 0x1p-14;
    }
  return points;
}

// The weight itself: a comb of 0 and 1 along one axis, constant along the others. Returns the largest error.
double measure_weights(opencl::State& state, std::size_t axis, SampleType type) {
  const auto tile = cube([axis](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    return static_cast<double>((axis == 0 ? x : axis == 1 ? y : z) % 2);
  });
  const auto points = weight_points(axis);
  const auto values = read_points(state, make_tile(state, tile, type).image, points);
  double worst = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double f = points[i].fraction[axis], truth = points[i].cell[axis] % 2 == 0 ? f : 1 - f;
    const double error = std::abs(static_cast<double>(values[i]) - truth);
    // NaN counts as the largest error there is.
    if (!(error <= worst)) worst = std::isnan(error) ? std::numeric_limits<double>::infinity() : error;
  }
  return worst;
}

// The exact trilinear value, and the cell's largest neighbour difference along each axis.
std::pair<double, std::array<double, 3>> trilinear(const std::vector<double>& tile, const ProbePoint& p) {
  const auto at = [&](std::size_t c) -> double {
    return tile[((p.cell[2] + (c >> 2)) * kSide + p.cell[1] + (c >> 1 & 1U)) * kSide + p.cell[0] + (c & 1U)];
  };
  const Corners weights = trilinear_weights(p.fraction);
  double value = 0;
  std::array<double, 3> steps{};
  for (std::size_t c = 0; c < 8; ++c) {
    value += weights[c] * at(c);
    for (std::size_t a = 0; a < 3; ++a)
      steps[a] = std::max(steps[a], std::abs(at(c) - at(c ^ (std::size_t{1} << a))));
  }
  return {value, steps};
}

// Normalised formats hold 0 to 1 only.
std::vector<float> random_tile(SampleType type) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(type != SampleType::f32 ? 0 : -1, 1);
  return cube([&](double, double, double) { return uniform(random); });
}

// The largest error of a tile beyond what steps are charged, relative to the tile's largest magnitude, or to
// the whole scale of a normalised format.
double beyond_steps(opencl::State& state, const FilterProbe& charged, SampleType type,
                    const std::vector<float>& values, const std::vector<ProbePoint>& points) {
  const Tile tile = make_tile(state, values, type);
  const auto read = read_points(state, tile.image, points);
  double magnitude = type != SampleType::f32 ? 1 : 0, largest = 0;
  for (const double v : tile.truth) magnitude = std::max(magnitude, std::abs(v));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto [truth, steps] = trilinear(tile.truth, points[i]);
    const double beyond =
        (std::abs(static_cast<double>(read[i]) - truth) - charged.of_steps(steps)) / magnitude;
    if (!(beyond <= largest)) largest = std::isnan(beyond) ? std::numeric_limits<double>::infinity() : beyond;
  }
  return largest;
}

// rho: on constant, affine and random tiles. Units that round products of weights err even where all samples
// are equal.
double measure_constants(opencl::State& state, const FilterProbe& charged, SampleType type) {
  const bool normalised = type != SampleType::f32;
  const double offset = normalised ? 0 : 100, slope = normalised ? 0.01 : 1;
  const std::vector<std::vector<float>> tiles{
      cube([&](double, double, double) { return normalised ? 1.0 : 1.2345678; }),
      cube([&](double, double, double) { return normalised ? 0.61803 : -777.77; }),
      cube([&](double x, double y, double z) {
        return offset + slope * (0.31 * x + 0.17 * (63 - y) + 0.23 * z);
      }),
      random_tile(type)};
  const auto points = scattered_points();
  double rho = 0;
  for (const auto& values : tiles) rho = std::max(rho, beyond_steps(state, charged, type, values, points));
  return rho;
}

// Whether some points of what was measured then err by no more now: a setting of the driver, or a program
// that measures better, is not told by what the device says of itself.
bool errs_no_more(opencl::State& state, const SamplerProbe& known) {
  constexpr std::size_t some = 1024;
  auto points = scattered_points();
  points.resize(some);
  return std::ranges::all_of(std::array{SampleType::f32, SampleType::u16, SampleType::u8}, [&](SampleType t) {
    const FilterProbe& filter = known.of(t);
    return !filter.image3d || beyond_steps(state, filter, t, random_tile(t), points) <= filter.constant_error;
  });
}

// The weights of all corners of a cell, by tiles of which every second sample along each axis is 1, all
// others 0, and what they err by. On combs two of three fractions are 0, and units err less there.
class CornerTiles {
 public:
  CornerTiles(opencl::State& state, SampleType type) : state_(state) {
    for (std::uint32_t parity = 0; parity < 8; ++parity)
      images_[parity] = make_tile(state, cube([&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
                                    return (x % 2 | y % 2 << 1 | z % 2 << 2) == parity ? 1.0 : 0.0;
                                  }),
                                  type)
                            .image;
  }
  // What the eight weights err by at each point.
  [[nodiscard]] std::vector<Corners> errors_at(const std::vector<ProbePoint>& points) const {
    std::array<std::vector<float>, 8> read;
    for (std::size_t parity = 0; parity < 8; ++parity)
      read[parity] = read_points(state_, images_[parity], points);
    std::vector<Corners> errors;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const ProbePoint& p = points[i];
      Corners off = trilinear_weights(p.fraction);
      for (std::uint32_t c = 0; c < 8; ++c) {
        std::uint32_t parity = 0;
        for (std::uint32_t a = 0; a < 3; ++a) parity |= (p.cell[a] + (c >> a & 1u)) % 2 << a;
        off[c] = static_cast<double>(read[parity][i]) - off[c];
      }
      errors.push_back(off);
    }
    return errors;
  }

 private:
  opencl::State& state_;
  std::array<cl::Image3D, 8> images_;
};

// The largest error found for each kind of steps, and where.
struct Worst {
  BySteps error{};
  std::array<std::size_t, 8> at{};  // of `places`
  std::vector<ProbePoint> places;

  void raise(const CornerTiles& tiles, const std::vector<ProbePoint>& points) {
    const std::vector<Corners> errors = tiles.errors_at(points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const BySteps last = error;
      raise_to_error(error, errors[i]);
      if (error == last) continue;
      for (std::size_t k = 1; k < error.size(); ++k)
        if (error[k] > last[k]) at[k] = places.size();
      places.push_back(points[i]);
    }
  }
  // The places of the largest errors from number `first` on, each once.
  [[nodiscard]] std::vector<ProbePoint> from(std::size_t first) const {
    const std::set<std::size_t> numbers(at.begin() + 1, at.end());
    std::vector<ProbePoint> out;
    for (const std::size_t n : numbers)
      if (n >= first) out.push_back(places[n]);
    return out;
  }
};

// From the worst points on, one fraction at a time: the multiples of 2^-8, the middles between them and what
// lies next to these.
void climb(Worst& worst, const CornerTiles& tiles) {
  std::size_t tried = 0;
  for (auto begin = worst.from(0); !begin.empty(); begin = worst.from(tried)) {
    tried = worst.places.size();
    std::vector<ProbePoint> points;
    for (const ProbePoint& place : begin)
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::uint32_t step = 0; step < 256; ++step)
          for (const std::uint32_t within : {0u, 31u, 32u, 33u}) {
            points.push_back(place);
            points.back().fraction[axis] = (64 * step + within) * 0x1p-14;
          }
    worst.raise(tiles, points);
  }
}

BySteps measure_corners(opencl::State& state, SampleType type) {
  const CornerTiles tiles(state, type);
  const std::vector<ProbePoint> points = scattered_points();
  Worst worst;
  worst.raise(tiles, points);
  // What is of a class is charged for all places. Else from several beginnings.
  if (over_steps(worst.error) > 0x1p-8 + slack) {
    constexpr std::ptrdiff_t parts = 4;
    for (std::ptrdiff_t part = 0; part < parts; ++part) {
      const auto first = points.begin() + part * std::ssize(points) / parts;
      Worst of_part;
      of_part.raise(tiles, {first, first + std::ssize(points) / parts});
      climb(of_part, tiles);
      for (std::size_t k = 1; k < worst.error.size(); ++k)
        worst.error[k] = std::max(worst.error[k], of_part.error[k]);
    }
  }
  // Seven lerps in fp32 are charged by themselves, 14 u of the largest sample, which is at least half of the
  // largest step.
  for (double& error : worst.error) error = std::max(0.0, error - 7 * 0x1p-24);
  return worst.error;
}

// Charges what was measured; says for which class.
std::string charge(FilterProbe& p, const BySteps& measured) {
  p.weight_error = over_steps(measured);
  const auto charge_each = [&](double least) {
    p.delta = std::max(least, p.weight_error);
    for (std::size_t k = 1; k < measured.size(); ++k) p.by_steps[k] = p.delta * sum_of_steps(k);
  };
  if (p.weight_error <= 0x1p-22) {
    charge_each(0x1p-22);
    return "weights in fp32";
  }
  if (p.weight_error <= 0x1p-9 + slack) {
    charge_each(0x1p-9);
    return "weights rounded to 8 fraction bits or better";
  }
  if (p.weight_error <= 0x1p-8 + slack) {
    charge_each(0x1p-8);
    return "weights truncated to 8 fraction bits";
  }
  p.delta = untried * p.weight_error;
  for (std::size_t k = 1; k < measured.size(); ++k) p.by_steps[k] = untried * measured[k];
  return fmt::format("weights err by {:.3g}, more than truncation to 8 bits; {} times that is charged",
                     p.weight_error, untried);
}

std::string measure_filter(opencl::State& state, FilterProbe& p, SampleType type) {
  BySteps measured = measure_corners(state, type);
  BySteps along{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double error = measure_weights(state, axis, type);
    for (std::size_t k = 1; k < along.size(); ++k) along[k] += (k >> axis & 1U) != 0 ? error : 0.5 * error;
  }
  for (std::size_t k = 1; k < measured.size(); ++k) measured[k] = std::max(measured[k], along[k]);
  std::string note = charge(p, measured);
  p.constant_error = measure_constants(state, p, type);
  return note;
}

// Samples per second: the best of three runs after one that compiles and warms up.
template <class Kernel, class Field>
double measure_rate(opencl::State& state, Kernel& kernel, const Field& field,
                    const DeviceArray<float>& sums) {
  const auto count = static_cast<cl_uint>(sums.size());
  const auto run = [&](cl_uint steps) {
    const auto start = std::chrono::steady_clock::now();
    kernel({{count, 1, 1}, {64, 1, 1}}, field, kSide, count, steps, sums.buffer());
    opencl::finish(state, "sampler rate");
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  run(1);
  // Lengthen the run until it can be timed: a GPU needs some thousand times the work of a CPU.
  cl_uint steps = 64;
  double seconds = run(steps);
  while (seconds < 0.01 && steps < (1u << 16)) seconds = run(steps *= 4);
  for (int i = 0; i < 2; ++i) seconds = std::min(seconds, run(steps));
  return static_cast<double>(count) * steps / seconds;
}

SamplerProbe measure_filters(opencl::State& state) {
  SamplerProbe p;
  p.image3d = state.info.linear_float_image;
  if (!p.image3d) {
    p.note = "no CL_R / CL_FLOAT 3D image with the linear filter";
    return p;
  }
  p.u16.image3d = state.info.linear_u16_image;
  p.u8.image3d = state.info.linear_u8_image;
  const std::array<std::pair<FilterProbe*, SampleType>, 3> each{
      {{&p, SampleType::f32}, {&p.u16, SampleType::u16}, {&p.u8, SampleType::u8}}};
  const std::int64_t strands = state.most_strands() > 1 ? std::ssize(each) : 1;
  in_strands(std::ssize(each), strands, [&](std::size_t, std::int64_t i) -> Take {
    const auto& [of, type] = each[static_cast<std::size_t>(i)];
    if (!of->image3d) return [] {};
    const std::string note = measure_filter(state, *of, type);
    return [&p, type, note] {
      if (type == SampleType::f32) p.note = note;
    };
  });
  return p;
}

void measure_rates(opencl::State& state, SamplerProbe& p) {
  const auto tile =
      cube([](double x, double y, double z) { return std::sin(0.3 * x) * std::cos(0.2 * y) + 0.01 * z; });
  const DeviceArray<float> samples(state, std::span<const float>(tile), "probe samples");
  const DeviceArray<float> sums(state, 1u << 14, "probe sums");
  opencl::Kernel<cl::Buffer, cl_uint, cl_uint, cl_uint, cl::Buffer> buffer_kernel(
      state, "volume/sampler/probe_sampler", "rate_buffer", kDefines);
  p.buffer_rate = measure_rate(state, buffer_kernel, samples.buffer(), sums);
  p.chosen = "buffer";
  if (!p.image3d) return;
  opencl::Kernel<cl::Image3D, cl_uint, cl_uint, cl_uint, cl::Buffer> image_kernel(
      state, "volume/sampler/probe_sampler", "rate_image", kDefines);
  p.image3d_rate = measure_rate(state, image_kernel, make_tile(state, tile, SampleType::f32).image, sums);
  if (p.image3d_rate > p.buffer_rate && std::isfinite(p.weight_error)) p.chosen = "image3d";
}

SamplerProbe filters_of(opencl::State& state) {
  if (auto known = remembered_filters(state); known && errs_no_more(state, *known)) return *std::move(known);
  SamplerProbe measured = measure_filters(state);
  remember_filters(state, measured);
  return measured;
}

// By device, for the process' life: the answer belongs to the hardware and its driver, not to a context.
SamplerProbe known_probe(opencl::State& state, bool rates) {
  static std::mutex mutex;
  static std::map<cl_device_id, SamplerProbe> known;
  const std::lock_guard lock(mutex);
  auto found = known.find(state.device());
  if (found == known.end()) found = known.emplace(state.device(), filters_of(state)).first;
  if (rates && found->second.chosen.empty()) measure_rates(state, found->second);
  return found->second;
}

}  // namespace

SamplerProbe probe_filters(Device& device) { return known_probe(device.state(), false); }

SamplerProbe probe_sampler(Device& device) { return known_probe(device.state(), true); }

}  // namespace vdvr
