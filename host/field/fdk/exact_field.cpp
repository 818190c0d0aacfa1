// F by its definition: direct sums in double precision over host threads (docs/geometry.md). Shares nothing
// with the device path but the angular weights and the ramp kernel.
#include "vdvr/expert/exact_field.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <span>
#include <thread>

#include "host/base/system/parallel.hpp"
#include "host/base/system/wide.hpp"
#include "host/field/fbp/coverage.hpp"
#include "host/field/fbp/ramp_kernel.hpp"
#include "host/field/fdk/cone_coverage.hpp"
#include "host/field/fdk/fdk_weights.hpp"
#include "host/field/fdk/filter_cone.hpp"
#include "host/field/fdk/ordered_product.hpp"
#include "host/scan/geometry/view_weights.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;

// cos(pi m (i + 1/2) / n) for all m, i: [m][i].
std::vector<double> cosine_table(std::int64_t n) {
  std::vector<double> table(static_cast<std::size_t>(n * n));
  for (std::int64_t m = 0; m < n; ++m)
    for (std::int64_t i = 0; i < n; ++i)
      table[static_cast<std::size_t>(m * n + i)] =
          std::cos(pi * static_cast<double>(m * (2 * i + 1) % (4 * n)) / static_cast<double>(2 * n));
  return table;
}

double absolute_sum(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0,
                         [](double s, double x) { return s + std::abs(x); });
}

// Trigonometric interpolation in 2n points makes errors at them grow by no more.
double growth(std::int64_t n) { return 2 / pi * std::log(2.0 * static_cast<double>(n)) + 1.5; }

// Points, or heights, side by side.
constexpr std::size_t group = 8;
constexpr auto step = static_cast<std::int64_t>(group);

// waves[l][i] = cos(l x[i]) for l < n, turned on from one l to the next.
template <std::int64_t N>
VDVR_ALWAYS_INLINE void turn_on_in(const double* cosine, const double* sine, std::int64_t n, double* waves) {
  using Points = wide::Doubles<N>;
  for (std::int64_t i = 0; i < step; i += N) {
    const typename Points::Vector c = Points::at(cosine + i), s = Points::at(sine + i);
    typename Points::Vector re = typename Points::Vector{} + 1.0, im{};
    for (std::int64_t l = 0; l < n; ++l) {
      Points::at(waves + l * step + i) = re;
      const typename Points::Vector next = re * c - im * s;
      im = im * c + re * s;
      re = next;
    }
  }
}
VDVR_IN_WIDTHS(turn_on, (const double* cosine, const double* sine, std::int64_t n, double* waves),
               (cosine, sine, n, waves))

// sums[m][i] = sum over l of a[m][l] waves[l][i]. One sum after the other would wait for each of its
// additions: four columns' take turns.
template <std::int64_t N>
VDVR_ALWAYS_INLINE void sum_columns_in(const double* a, std::int64_t columns, std::int64_t rows,
                                       const double* waves, double* sums) {
  using Points = wide::Doubles<N>;
  for (std::int64_t i = 0; i < step; i += N, waves += N, sums += N) {
    std::int64_t m = 0;
    for (; m + 4 <= columns; m += 4) {
      typename Points::Vector s0{}, s1{}, s2{}, s3{};
      const double* of = a + m * rows;
      for (std::int64_t l = 0; l < rows; ++l, ++of) {
        const typename Points::Vector wave = Points::at(waves + l * step);
        s0 += of[0] * wave;
        s1 += of[rows] * wave;
        s2 += of[2 * rows] * wave;
        s3 += of[3 * rows] * wave;
      }
      Points::at(sums + m * step) = s0;
      Points::at(sums + (m + 1) * step) = s1;
      Points::at(sums + (m + 2) * step) = s2;
      Points::at(sums + (m + 3) * step) = s3;
    }
    for (; m < columns; ++m) {
      typename Points::Vector sum{};
      for (std::int64_t l = 0; l < rows; ++l) sum += a[m * rows + l] * Points::at(waves + l * step);
      Points::at(sums + m * step) = sum;
    }
  }
}
VDVR_IN_WIDTHS(sum_columns,
               (const double* a, std::int64_t columns, std::int64_t rows, const double* waves, double* sums),
               (a, columns, rows, waves, sums))

/// Which of n points, or heights, a task takes: whole groups, as many as leave every thread some tasks.
struct GroupTasks {
  explicit GroupTasks(std::size_t points) : n(points) {
    const std::size_t groups = (n + group - 1) / group,
                      shares = 4 * std::max<std::size_t>(1, std::thread::hardware_concurrency());
    each = group * std::clamp<std::size_t>(groups / shares, 1, most);
    count = static_cast<std::int64_t>((n + each - 1) / each);
  }
  [[nodiscard]] std::size_t first(std::int64_t task) const {
    return std::min(n, static_cast<std::size_t>(task) * each);
  }
  static constexpr std::size_t most = 16;
  std::size_t n, each;
  std::int64_t count;
};

// sum over m of lines[m][i] waves[m][i].
template <std::int64_t N>
VDVR_ALWAYS_INLINE void sum_lines_in(const double* lines, const double* waves, std::int64_t n, double* out) {
  using Points = wide::Doubles<N>;
  for (std::int64_t i = 0; i < step; i += N) {
    typename Points::Vector sum{};
    for (std::int64_t m = 0; m < n; ++m)
      sum += Points::at(lines + m * step + i) * Points::at(waves + m * step + i);
    Points::at(out + i) = sum;
  }
}
VDVR_IN_WIDTHS(sum_lines, (const double* lines, const double* waves, std::int64_t n, double* out),
               (lines, waves, n, out))

// cos(l pi (place + 1/2) / n) for l < n of each place: [l][place].
void put_waves(const std::array<double, group>& places, std::int64_t n, std::vector<double>& waves) {
  std::array<double, group> cosine{}, sine{};
  for (std::size_t i = 0; i < group; ++i) {
    const double x = pi * (places[i] + 0.5) / static_cast<double>(n);
    cosine[i] = std::cos(x);
    sine[i] = std::sin(x);
  }
  turn_on(cosine.data(), sine.data(), n, waves.data());
}

// [i][m] of table[m][i].
std::vector<double> transposed(const std::vector<double>& table, std::int64_t n) {
  std::vector<double> out(table.size());
  for (std::int64_t m = 0; m < n; ++m)
    for (std::int64_t i = 0; i < n; ++i)
      out[static_cast<std::size_t>(i * n + m)] = table[static_cast<std::size_t>(m * n + i)];
  return out;
}

// q[i] = sum over j of p[j] kernel[n - 1 + i - j]: sums side by side over i.
VDVR_WIDE void convolve(const double* p, const double* kernel, std::int64_t n, double* q) {
  std::fill(q, q + n, 0.0);
  for (std::int64_t j = 0; j < n; ++j) {
    const double sample = p[j], *shifted = kernel + (n - 1 - j);
    for (std::int64_t i = 0; i < n; ++i) q[i] += shifted[i] * sample;
  }
}

// n zeros, in memory or in scratch.
std::shared_ptr<double[]> zeros(std::size_t n, const std::shared_ptr<Scratch>& scratch) {
  if (!scratch) return std::make_shared<double[]>(n);
  return {scratch->map<double>(n, "the cosine coefficients").data(),
          [scratch](double* first) { scratch->unmap(first); }};
}

// The samples that the ramp filter is given, and what each view weighs.
struct WeighedViews {
  WeighedViews(const ProjectionSet& of, const FieldOptions& field) : scan(of), columns(of.geometry.columns) {
    if (!scan.cone) {
      weight = view_weights(scan.geometry).weight;
      return;
    }
    const ConeGeometry cone = used_cone(scan, field);
    fdk.emplace(cone, columns, scan.geometry.rows);
    pad_before = fdk->pad_before();
    columns += pad_before + fdk->pad_after();
    for (std::size_t k = 0; k < cone.views.size(); ++k) {
      const ViewMatrix& m = cone.views[k];
      matrices.push_back(recentred(m, m[0][3] / m[2][3] + static_cast<double>(pad_before)));
      weight.push_back(fdk->of_view(k) / fdk->view(k).pitch_u);
    }
  }
  // double [row][column] of view k.
  [[nodiscard]] std::vector<double> samples(std::int64_t k) const {
    const ParallelGeometry& g = scan.geometry;
    const float* first = scan.data.data() + k * g.rows * g.columns;
    if (!fdk) return {first, first + g.rows * g.columns};
    std::vector<double> out(static_cast<std::size_t>(g.rows * columns));
    fdk->apply(static_cast<std::size_t>(k), {first, static_cast<std::size_t>(g.rows * g.columns)}, out);
    return out;
  }

  const ProjectionSet& scan;
  std::int64_t columns, pad_before = 0;
  std::optional<FdkWeights> fdk;
  std::vector<ViewMatrix> matrices;
  std::vector<double> weight;
};

}  // namespace

ExactField::ExactField(const ProjectionSet& scan, const FieldOptions& field, const Progress& progress)
    : geometry_(scan.geometry) {
  geometry_.center = center_of(field, geometry_);
  const WeighedViews views(scan, field);
  if (scan.cone) {
    cone_coverage_ = std::make_shared<ConeCoverage>(cone_coverage(scan, field));
    views_ = views.matrices;
    geometry_.center += static_cast<double>(views.pad_before);
    geometry_.columns = views.columns;
  } else {
    coverage_ = std::make_shared<Coverage>(geometry_);
  }
  const std::int64_t U = geometry_.columns, V = geometry_.rows, K = geometry_.views();
  const auto g = ramp_kernel(field, scan.cone ? 1.0 : geometry_.pitch_u, U);
  const auto cos_v = cosine_table(V);
  const auto at = [](std::int64_t i) { return static_cast<std::size_t>(i); };
  const OrderedFactor cos_u(transposed(cosine_table(U), U).data(), U, U);
  std::vector<double> mirrored(at(2 * U - 1));  // [U - 1 + i - j]: the kernel at i - j
  for (std::int64_t i = 0; i < 2 * U - 1; ++i) mirrored[at(i)] = g[at(std::abs(i - (U - 1)))];
  const std::shared_ptr<double[]> coefficients = zeros(at(K * U * V), scan.data.scratch());
  const double kernel_norm = std::accumulate(mirrored.begin(), mirrored.end(), 0.0,
                                             [](double s, double x) { return s + std::abs(x); });
  std::vector<double> rounding(at(K));
  parallel_for(K, progress, "exact field", [&](std::int64_t k) {
    double row_norm = 0, norm = 0;
    std::vector<double> filtered(at(V * U)), rows(at(V * U));  // [v][i]; [v][m]: cosine coefficients in u
    std::vector<double> p = views.samples(k);
    for (double& sample : p) sample *= views.weight[at(k)];
    double largest_sample = 0;
    for (const double sample : p) largest_sample = std::max(largest_sample, std::abs(sample));
    for (std::int64_t v = 0; v < V; ++v) {
      double* q = filtered.data() + v * U;
      convolve(p.data() + v * U, mirrored.data(), U, q);
      row_norm = std::max(row_norm, absolute_sum(std::span<const double>(q, at(U))));
    }
    cos_u.product(filtered.data(), V, rows.data());
    for (std::int64_t i = 0; i < V * U; ++i)
      rows[at(i)] = rows[at(i)] * (i % U == 0 ? 1.0 : 2.0) / static_cast<double>(U);
    const double rows_norm = absolute_sum(rows);
    OrderedFactor(rows.data(), V, U).product(cos_v.data(), V, filtered.data());  // [l][m]
    for (std::int64_t m = 0; m < U; ++m)
      for (std::int64_t l = 0; l < V; ++l) {
        const double a = filtered[at(l * U + m)] * (l == 0 ? 1.0 : 2.0) / static_cast<double>(V);
        coefficients[(k * U + m) * V + l] = a;
        norm += std::abs(a);
      }
    // docs/error-bounds.md, "What verify does": convolution, both transforms, and sums over coefficients.
    const auto u = static_cast<double>(U), v = static_cast<double>(V);
    rounding[at(k)] = 0x1p-53 * ((u + 8) * kernel_norm * largest_sample * growth(U) * growth(V) +
                                 2 * (u + 8) * row_norm * growth(V) + 2 * (v + 8) * rows_norm +
                                 (scan.cone ? 160 : 30) * (u + v + 1) * norm);
  });
  coefficients_ = coefficients;
  rounding_ = std::accumulate(rounding.begin(), rounding.end(), 0.0);
}

// lambda^-2 times the series in u and v, view by view.
// Some points go together: a view's coefficients come from memory once for all groups of a task, and from the
// cache for each of them, whose sums run side by side.
std::vector<double> ExactField::at_cone(std::span<const Vec3> points, const Progress& progress) const {
  const std::int64_t U = geometry_.columns, V = geometry_.rows;
  std::vector<double> values(points.size());
  const GroupTasks tasks(points.size());
  parallel_for(tasks.count, progress, "exact points", [&](std::int64_t t) {
    std::vector<double> lines(group * static_cast<std::size_t>(U)), along_u(lines.size()),
        along_v(group * static_cast<std::size_t>(V));
    std::array<double, group> u{}, v{}, lambda{}, sums{};
    for (std::size_t k = 0; k < views_.size(); ++k) {
      throw_if_stopped();
      for (std::size_t first = tasks.first(t); first < tasks.first(t + 1); first += group) {
        const std::size_t count = std::min(group, points.size() - first);
        for (std::size_t i = 0; i < count; ++i) {
          const Vec3 seen = projected(views_[k], points[first + i]);
          u[i] = seen[0];
          v[i] = seen[1];
          lambda[i] = seen[2];
        }
        put_waves(u, U, along_u);
        put_waves(v, V, along_v);
        sum_columns(coefficients_.get() + static_cast<std::int64_t>(k) * U * V, U, V, along_v.data(),
                    lines.data());
        sum_lines(lines.data(), along_u.data(), U, sums.data());
        for (std::size_t i = 0; i < count; ++i) values[first + i] += sums[i] / (lambda[i] * lambda[i]);
      }
    }
  });
  return values;
}

std::vector<double> ExactField::at(std::span<const Vec3> points, const Progress& progress) const {
  if (!views_.empty()) return at_cone(points, progress);
  const std::int64_t U = geometry_.columns, V = geometry_.rows, K = geometry_.views();
  std::map<double, std::vector<std::size_t>> by_height;
  for (std::size_t i = 0; i < points.size(); ++i) by_height[points[i][2]].push_back(i);
  std::vector<std::pair<double, const std::vector<std::size_t>*>> heights;
  for (const auto& [z, members] : by_height) heights.emplace_back(z, &members);

  // Heights go together in groups, so that one pass over the coefficients serves the whole group, and groups
  // in tasks, as those of cone beam.
  struct Group {
    std::vector<double> along_v;
    std::vector<std::pair<std::size_t, std::size_t>> members;  // height of the group, point
  };
  const auto group_of = [&](std::size_t first) {
    Group of{std::vector<double>(group * static_cast<std::size_t>(V)), {}};
    std::array<double, group> places{};
    for (std::size_t h = 0; h < std::min(group, heights.size() - first); ++h) {
      places[h] = heights[first + h].first / geometry_.pitch_v + 0.5 * static_cast<double>(V - 1);
      for (const std::size_t i : *heights[first + h].second) of.members.emplace_back(h, i);
    }
    put_waves(places, V, of.along_v);
    return of;
  };
  std::vector<double> values(points.size());
  const GroupTasks tasks(heights.size());
  parallel_for(tasks.count, progress, "exact points", [&](std::int64_t t) {
    std::vector<double> lines(group * static_cast<std::size_t>(U)), columns(lines.size()),
        along_u(lines.size());
    std::array<double, group> places{}, sums{};
    std::vector<Group> of_task;
    for (std::size_t first = tasks.first(t); first < tasks.first(t + 1); first += group)
      of_task.push_back(group_of(first));
    for (std::size_t k = 0; k < static_cast<std::size_t>(K); ++k) {
      throw_if_stopped();
      const double c = std::cos(geometry_.theta_rad[k]), s = std::sin(geometry_.theta_rad[k]);
      for (const Group& of : of_task) {
        sum_columns(coefficients_.get() + static_cast<std::int64_t>(k) * U * V, U, V, of.along_v.data(),
                    lines.data());
        for (std::size_t from = 0; from < of.members.size(); from += group) {
          const std::size_t together = std::min(group, of.members.size() - from);
          for (std::size_t j = 0; j < together; ++j) {
            const auto& [height, point] = of.members[from + j];
            const Vec3& p = points[point];
            places[j] = (p[0] * c + p[1] * s) / geometry_.pitch_u + geometry_.center_of_view(k);
            for (std::size_t m = 0; m < static_cast<std::size_t>(U); ++m)
              columns[m * group + j] = lines[m * group + height];
          }
          put_waves(places, U, along_u);
          sum_lines(columns.data(), along_u.data(), U, sums.data());
          for (std::size_t j = 0; j < together; ++j) values[of.members[from + j].second] += sums[j];
        }
      }
    }
  });
  return values;
}

bool ExactField::covered(const Vec3& point) const {
  if (cone_coverage_) return cone_coverage_->margin(point) >= 0;
  return coverage_->margin(point[0], point[1]) >= 0 && coverage_->margin_z(point[2]) >= 0;
}

}  // namespace vdvr
