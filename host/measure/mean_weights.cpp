#include "host/measure/mean_weights.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/system/casts.hpp"
#include "host/base/system/limits.hpp"
#include "host/base/system/parallel.hpp"
#include "host/field/fbp/cosine_series.hpp"
#include "host/field/fbp/ramp_kernel.hpp"
#include "host/field/fdk/filter_cone.hpp"
#include "host/scan/geometry/view_weights.hpp"

namespace vdvr::measured {
namespace {

constexpr double pi = std::numbers::pi;
// Places across a region: what sums over them lose falls with the power 3/2 of their number where a region is
// round. And places in a pixel: beyond, frequencies fold onto those that pixels have.
constexpr double places_across = 384;
constexpr int most_density = 16, least_density = 2;

// [low, high] halved evenly so that no piece is longer than `step`: their middles and lengths.
void add_pieces(double low, double high, double step, std::vector<double>& middle,
                std::vector<double>& length) {
  const auto n = std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil((high - low) / step)));
  for (std::int64_t i = 0; i < n; ++i) {
    middle.push_back(low + (static_cast<double>(i) + 0.5) / static_cast<double>(n) * (high - low));
    length.push_back((high - low) / static_cast<double>(n));
  }
}

// The integral over [a, b] of what row r of n has in the series.
double row_integral(std::int64_t n, double a, double b, std::int64_t r) {
  double sum = b - a;
  for (std::int64_t l = 1; l < n; ++l) {
    const double f = pi * static_cast<double>(l) / static_cast<double>(n);
    sum += 2 / f * (std::sin(f * (b + 0.5)) - std::sin(f * (a + 0.5))) *
           std::cos(f * (static_cast<double>(r) + 0.5));
  }
  return sum / static_cast<double>(n);
}

// to[j] += factor * from[j].
void add(double factor, const double* from, std::int64_t n, double* to) {
  for (std::int64_t j = 0; j < n; ++j) to[j] += factor * from[j];
}

}  // namespace

double volume_by_lines(const MeasuredRegion& region) {
  std::array<std::vector<double>, 2> middle, length;
  for (const std::size_t a : {1UL, 2UL}) {
    const std::vector<double> faces = region.faces(a);
    const double step = (faces.back() - faces.front()) / places_across;
    for (std::size_t i = 0; i + 1 < faces.size(); ++i)
      add_pieces(faces[i], faces[i + 1], step, middle[a - 1], length[a - 1]);
  }
  double sum = 0;
  for (std::size_t z = 0; z < middle[1].size(); ++z)
    for (std::size_t y = 0; y < middle[0].size(); ++y)
      sum += length[1][z] * length[0][y] * region.length_along({0, middle[0][y], middle[1][z]}, {1, 0, 0});
  return sum;
}

MeanWeights::MeanWeights(const ProjectionSet& scan, const FieldOptions& field, const MeasuredRegion& region,
                         std::uint64_t max_memory_bytes)
    : scan_(scan), region_(region), detector_(scan.geometry) {
  detector_.center = center_of(field, detector_);
  if (scan.cone) {
    const ConeGeometry cone = used_cone(scan, field);
    fdk_.emplace(cone, scan.geometry.columns, scan.geometry.rows);
    detector_.columns += fdk_->pad_before() + fdk_->pad_after();
    for (std::size_t k = 0; k < cone.views.size(); ++k) {
      const ViewMatrix& m = cone.views[k];
      matrices_.push_back(recentred(m, m[0][3] / m[2][3] + static_cast<double>(fdk_->pad_before())));
      of_view_.push_back(fdk_->of_view(k) / fdk_->view(k).pitch_u);
    }
    volume_ = volume_by_lines(region);
  } else {
    of_view_ = view_weights(detector_).weight;
  }
  choose_density(max_memory_bytes);
  fill_heights();
  fill_columns(field);
}

// Columns and rows that the region's box is seen within: u0, u1, v0, v1. Of parallel beam no rows.
std::array<double, 4> MeanWeights::seen_box(std::int64_t k) const {
  constexpr double far = 1e300;
  std::array<double, 4> box{far, -far, far, -far};
  std::array<std::vector<double>, 3> faces;
  for (std::size_t a = 0; a < 3; ++a) faces[a] = region_.faces(a);
  for (std::size_t c = 0; c < 8; ++c) {
    const Vec3 p{c & 1 ? faces[0].back() : faces[0].front(), c & 2 ? faces[1].back() : faces[1].front(),
                 c & 4 ? faces[2].back() : faces[2].front()};
    double u = 0, v = 0;
    if (fdk_) {
      const Vec3 seen = projected(matrices_[at(k)], p);
      u = seen[0];
      v = seen[1];
    } else {
      const double theta = detector_.theta_rad[at(k)];
      u = (p[0] * std::cos(theta) + p[1] * std::sin(theta)) / detector_.pitch_u + detector_.center;
    }
    box = {std::min(box[0], u), std::max(box[1], u), std::min(box[2], v), std::max(box[3], v)};
  }
  const auto on = [](double x, std::int64_t n) { return std::clamp(x, -0.5, static_cast<double>(n) - 0.5); };
  return {on(box[0], detector_.columns), on(box[1], detector_.columns), on(box[2], detector_.rows),
          on(box[3], detector_.rows)};
}

void MeanWeights::choose_density(std::uint64_t max_memory_bytes) {
  double low = 1e300, high = -1e300, widest = 0;
  for (std::int64_t k = 0; k < detector_.views(); ++k) {
    const auto box = seen_box(k);
    low = std::min(low, box[0]);
    high = std::max(high, box[1]);
    widest = std::max(widest, box[1] - box[0]);
  }
  density_ = std::clamp(static_cast<int>(places_across / std::max(widest, 1.0)), least_density, most_density);
  const auto bytes = [&] {
    first_place_ = static_cast<std::int64_t>(std::floor((low + 0.5) * density_));
    places_ = static_cast<std::int64_t>(std::ceil((high + 0.5) * density_)) - first_place_;
    const std::int64_t of_rows = fdk_ ? detector_.rows * density_ * detector_.rows : 0;
    return sizeof(double) * count(places_ * detector_.columns + of_rows);
  };
  constexpr std::uint64_t usual = std::uint64_t{256} << 20;
  while (density_ > least_density && bytes() > usual) --density_;
  io::require_memory(bytes(), max_memory_bytes, "the weights of a mean");
}

void MeanWeights::fill_heights() {
  const std::int64_t V = detector_.rows;
  if (fdk_) {
    std::vector<double> places;
    for (std::int64_t i = 0; i < V * density_; ++i) places.push_back(place_of(i));
    rows_ = resampling_matrix(V, places, 0, 1.0, 0);
    return;
  }
  // Where the region is upright it is the same throughout a slab, however thick.
  const std::vector<double> faces = region_.faces(2);
  const double pitch = detector_.pitch_v, height = faces.back() - faces.front(),
               step = region_.is_upright()
                          ? height
                          : std::clamp(height / places_across, pitch / most_density, pitch / least_density);
  for (std::size_t i = 0; i + 1 < faces.size(); ++i)
    add_pieces(faces[i], faces[i + 1], step, heights_, thickness_);
  rows_.resize(heights_.size() * at(V));
  parallel_for(std::ssize(heights_), {}, "", [&](std::int64_t h) {
    const double middle = heights_[at(h)] / pitch + 0.5 * static_cast<double>(V - 1),
                 half = 0.5 * thickness_[at(h)] / pitch;
    for (std::int64_t r = 0; r < V; ++r)
      rows_[at(h * V + r)] = row_integral(V, middle - half, middle + half, r);
  });
  for (double& t : thickness_) t /= pitch;
}

// H at the places: the ramp's kernel through the series.
void MeanWeights::fill_columns(const FieldOptions& field) {
  const std::int64_t U = detector_.columns;
  const std::vector<double> kernel = ramp_kernel(field, fdk_ ? 1.0 : detector_.pitch_u, U);
  std::vector<double> mirrored(at(2 * U - 1));  // [U - 1 + i - j]: the kernel at i - j
  for (std::int64_t i = 0; i < 2 * U - 1; ++i) mirrored[at(i)] = kernel[at(std::abs(i - (U - 1)))];
  columns_.assign(at(places_ * U), 0.0);
  parallel_for(places_, {}, "", [&](std::int64_t p) {
    const double place = place_of(first_place_ + p);
    const std::vector<double> series = resampling_matrix(U, std::span(&place, 1), 0, 1.0, 0);
    for (std::int64_t i = 0; i < U; ++i)
      add(series[at(i)], mirrored.data() + (U - 1 - i), U, columns_.data() + p * U);
  });
}

void MeanWeights::parallel_shadow(std::int64_t k, Shadow& s) const {
  const double c = std::cos(detector_.theta_rad[at(k)]), n = std::sin(detector_.theta_rad[at(k)]);
  s.heights = std::ssize(heights_);
  s.length.resize(at(s.heights * s.places));
  double sum = 0;
  for (std::int64_t h = 0; h < s.heights; ++h)
    for (std::int64_t i = 0; i < s.places; ++i) {
      const double t = (place_of(s.first + i) - detector_.center) * detector_.pitch_u;
      const double length = region_.length_along({t * c, t * n, heights_[at(h)]}, {-n, c, 0});
      s.length[at(h * s.places + i)] = length;
      sum += thickness_[at(h)] * length;
    }
  if (sum > 0)
    for (double& length : s.length) length *= of_view_[at(k)] / sum;
}

void MeanWeights::cone_shadow(std::int64_t k, Shadow& s) const {
  const ViewMatrix& m = matrices_[at(k)];
  const auto box = seen_box(k);
  s.first_height = static_cast<std::int64_t>(std::floor((box[2] + 0.5) * density_));
  s.heights = static_cast<std::int64_t>(std::ceil((box[3] + 0.5) * density_)) - s.first_height;
  s.length.resize(at(s.heights * s.places));
  // Rows of the inverse times the determinant.
  const auto cross = [](const Vec3& a, const Vec3& b) {
    return Vec3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const auto row = [&](std::size_t i) { return Vec3{m[i][0], m[i][1], m[i][2]}; };
  const std::array<Vec3, 3> column{cross(row(1), row(2)), cross(row(2), row(0)), cross(row(0), row(1))};
  const double det = row(0)[0] * column[0][0] + row(0)[1] * column[0][1] + row(0)[2] * column[0][2];
  const auto point = [&](double u, double v, double w) {
    Vec3 p{};
    for (std::size_t a = 0; a < 3; ++a) p[a] = (u * column[0][a] + v * column[1][a] + w * column[2][a]) / det;
    return p;
  };
  const Vec3 source = point(-m[0][3], -m[1][3], -m[2][3]);
  const double factor = of_view_[at(k)] / (std::abs(det) * volume_ * density_ * density_);
  for (std::int64_t h = 0; h < s.heights; ++h)
    for (std::int64_t i = 0; i < s.places; ++i)
      s.length[at(h * s.places + i)] =
          factor *
          region_.length_along(source, point(place_of(s.first + i), place_of(s.first_height + h), 1));
}

MeanWeights::Shadow MeanWeights::shadow_of(std::int64_t k) const {
  const auto box = seen_box(k);
  Shadow s;
  s.first = static_cast<std::int64_t>(std::floor((box[0] + 0.5) * density_));
  s.places = static_cast<std::int64_t>(std::ceil((box[1] + 0.5) * density_)) - s.first;
  if (fdk_) cone_shadow(k, s);
  else parallel_shadow(k, s);
  return s;
}

std::uint64_t MeanWeights::bytes_of_view() const {
  const std::int64_t heights = fdk_ ? detector_.rows * density_ : std::ssize(heights_);
  return sizeof(double) *
         count(heights * (places_ + detector_.columns) + 2 * detector_.rows * detector_.columns);
}

void MeanWeights::of_view(std::int64_t k, std::vector<double>& weight) const {
  const Shadow s = shadow_of(k);
  const std::int64_t U = detector_.columns, V = detector_.rows;
  std::vector<double> of_height(at(U)), all(at(V * U), 0.0);
  for (std::int64_t h = 0; h < s.heights; ++h) {
    std::fill(of_height.begin(), of_height.end(), 0.0);
    for (std::int64_t i = 0; i < s.places; ++i)
      if (const double length = s.length[at(h * s.places + i)]; length != 0)
        add(length, columns_.data() + (s.first + i - first_place_) * U, U, of_height.data());
    for (std::int64_t r = 0; r < V; ++r)
      add(rows_[at((s.first_height + h) * V + r)], of_height.data(), U, all.data() + r * U);
  }
  if (!fdk_) {
    weight = std::move(all);
    return;
  }
  const std::int64_t own = scan_.geometry.columns;
  weight.resize(at(V * own));
  for (std::int64_t r = 0; r < V; ++r)
    for (std::int64_t i = 0; i < own; ++i)
      weight[at(r * own + i)] = all[at(r * U + fdk_->pad_before() + i)] *
                                fdk_->redundancy(at(k), static_cast<double>(i)) *
                                fdk_->cosine(at(k), static_cast<double>(i), static_cast<double>(r));
}

}  // namespace vdvr::measured
