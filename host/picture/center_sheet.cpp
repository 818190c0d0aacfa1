// The sheet of `vdvr center`: scans of one row with other centres, reconstructed and drawn.
#include "vdvr/expert/center_sheet.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "host/picture/canvas.hpp"
#include "host/picture/sheet.hpp"
#include "host/picture/text.hpp"
#include "host/scan/geometry/views_of_rows.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/reconstruct.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;

// --- scans of one row ---

// Of parallel beam one row. Of cone beam all: the views' weights and the slice's rows belong together.
ProjectionSet row_of(const ProjectionSet& scan, std::int64_t row) {
  if (scan.cone) return scan;
  if (auto seen = views_of_rows(scan, row, 1)) return *std::move(seen);
  ProjectionSet one;
  one.geometry = scan.geometry;
  one.geometry.rows = 1;
  one.geometry.series = {};
  one.report = scan.report;
  const ParallelGeometry& g = scan.geometry;
  for (std::int64_t k = 0; k < g.views(); ++k)
    for (std::int64_t i = 0; i < g.columns; ++i)
      one.data.push_back(scan.data[static_cast<std::size_t>((k * g.rows + row) * g.columns + i)]);
  return one;
}

double arc_of(const ParallelGeometry& g) {
  const auto [low, high] = std::minmax_element(g.theta_rad.begin(), g.theta_rad.end());
  return *high - *low;
}

bool is_half_acquisition(ParallelGeometry g, double center) {
  g.center = center;
  return looks_half_acquired(g);
}

double linear_at(const float* row, std::int64_t columns, double at) {
  const auto j = static_cast<std::int64_t>(std::floor(at));
  const double f = at - static_cast<double>(j);
  const auto value = [&](std::int64_t i) {
    return static_cast<double>(row[std::clamp<std::int64_t>(i, 0, columns - 1)]);
  };
  return (1 - f) * value(j) + f * value(j + 1);
}

// The view nearest to the one that looks from the other side.
std::int64_t opposite_of(const ParallelGeometry& g, double theta) {
  const auto off = [&](double t) { return std::abs(std::remainder(t - theta - pi, 2 * pi)); };
  return std::min_element(g.theta_rad.begin(), g.theta_rad.end(),
                          [&](double a, double b) { return off(a) < off(b); }) -
         g.theta_rad.begin();
}

double shift_of(const ParallelGeometry& g, std::int64_t view) {
  return g.column_shift.empty() ? 0 : g.column_shift[static_cast<std::size_t>(view)];
}

// Of the columns that opposite views both see: squares of the difference over those of the views.
double mismatch(const ProjectionSet& row, double center) {
  const ParallelGeometry& g = row.geometry;
  const auto reach =
      static_cast<std::int64_t>(std::floor(std::min(center, static_cast<double>(g.columns - 1) - center)));
  double apart = 0, both = 0;
  for (std::int64_t k = 0; k < g.views(); ++k) {
    const std::int64_t opposite = opposite_of(g, g.theta_rad[static_cast<std::size_t>(k)]);
    const float *own = row.data.data() + k * g.columns, *other = row.data.data() + opposite * g.columns;
    for (std::int64_t t = -reach; t <= reach; ++t) {
      const double a = linear_at(own, g.columns, center + shift_of(g, k) + static_cast<double>(t)),
                   b = linear_at(other, g.columns, center + shift_of(g, opposite) - static_cast<double>(t));
      apart += (a - b) * (a - b);
      both += a * a + b * b;
    }
  }
  return both > 0 ? apart / both : 0;
}

// The first half turn of the views, each with its opposite one beyond the axis, which is then the middle of a
// wider detector. Where both see, the weight goes over from one to the other.
ProjectionSet joined(const ProjectionSet& row, double center) {
  const ParallelGeometry& g = row.geometry;
  const double near = std::min(center, static_cast<double>(g.columns - 1) - center),
               far = std::max(center, static_cast<double>(g.columns - 1) - center),
               side = center < 0.5 * static_cast<double>(g.columns - 1) ? 1 : -1;
  const auto half = static_cast<std::int64_t>(std::floor(far));
  ProjectionSet out;
  out.geometry = g;
  out.geometry.columns = 2 * half + 1;
  out.geometry.center = static_cast<double>(half);
  out.geometry.theta_rad.clear();
  const double first = *std::min_element(g.theta_rad.begin(), g.theta_rad.end());
  for (std::int64_t k = 0; k < g.views(); ++k) {
    const double theta = g.theta_rad[static_cast<std::size_t>(k)];
    if (theta - first >= pi * (1 - 1e-9)) continue;
    const auto opposite = opposite_of(g, theta);
    out.geometry.theta_rad.push_back(theta);
    const float *own = row.data.data() + k * g.columns, *other = row.data.data() + opposite * g.columns;
    for (std::int64_t i = 0; i < out.geometry.columns; ++i) {
      const double t = static_cast<double>(i - half),
                   share = std::clamp(near > 0 ? 0.5 + 0.5 * side * t / near : 0.5 + side * t, 0.0, 1.0);
      out.data.push_back(
          static_cast<float>((share > 0 ? share * linear_at(own, g.columns, center + t) : 0.0) +
                             (share < 1 ? (1 - share) * linear_at(other, g.columns, center - t) : 0.0)));
    }
  }
  return out;
}

ProjectionSet with_center(const ProjectionSet& row, double center) {
  ProjectionSet out = row;
  out.geometry.center = center;
  if (!out.cone) return out;
  for (ViewMatrix& m : out.cone->views) m = recentred(m, m[0][3] / m[2][3] + center - row.geometry.center);
  out.geometry = parallel_limit(*out.cone, row.geometry.columns, row.geometry.rows, row.geometry.unit);
  return out;
}

// --- drawing ---

constexpr Colour kMark{215, 80, 20};
constexpr std::int64_t kAcross = 5, kGap = 8, kLine = 24, kChart = 260;

void centred_text(Image& image, std::int64_t x, std::int64_t y, const std::string& text, const Colour& c) {
  draw_text(image, static_cast<double>(x) - text_width(text, kText) / 2, static_cast<double>(y), text, kText,
            c);
}

struct Slices {
  std::int64_t side = 0;  // of a slice, in samples
  std::int64_t zoom = 1;  // pixels of a sample
  [[nodiscard]] std::int64_t pixels() const { return side * zoom; }
  std::vector<std::vector<float>> values;  // [slice][y][x]
};

// What all slices are shown under: all but the outermost two hundredths of the marked one.
std::pair<float, float> window_of(const Slices& slices, std::size_t marked) {
  std::vector<float> sorted = slices.values[marked];
  std::sort(sorted.begin(), sorted.end());
  const std::size_t cut = sorted.size() / 200;
  return {sorted[cut], sorted[sorted.size() - 1 - cut]};
}

std::string merit_text(const CenterSheet& sheet) {
  if (sheet.joined) return "figure of merit: difference of opposite views where both see; least is best";
  return sheet.sharpness ? "figure of merit: mean |slice| / its root mean square; least is best"
                         : "figure of merit: integral of |slice| / integral of |view|; least is best";
}

void draw_chart(Image& image, std::int64_t top, const CenterSheetOptions& options, const CenterSheet& sheet) {
  const std::int64_t x0 = kEdge + 10, x1 = image.width - kEdge - 10, y0 = top + kLine, y1 = y0 + kChart;
  draw_text(image, kEdge, static_cast<double>(top), merit_text(sheet), kText, kInk);
  const auto ends = std::minmax_element(sheet.merit.begin(), sheet.merit.end());
  const auto low = *ends.first, high = *ends.second;
  const double first = options.centers.front(), span = options.centers.back() - first;
  const auto place = [&](std::size_t i) {
    const double x = span > 0 ? (options.centers[i] - first) / span : 0.5,
                 y = high > low ? (sheet.merit[i] - low) / (high - low) : 0.5;
    return std::array<std::int64_t, 2>{x0 + std::lround(x * static_cast<double>(x1 - x0 - 80)) + 40,
                                       y1 - 8 - std::lround(y * static_cast<double>(kChart - 16))};
  };
  fill(image, place(options.marked)[0] - 1, y0, 3, kChart, kMark);
  for (const std::int64_t y : {y0, y1}) fill(image, x0, y, x1 - x0, 1, kGrid);
  for (std::size_t i = 0; i < sheet.merit.size(); ++i) {
    const auto p = place(i);
    fill(image, p[0] - 4, p[1] - 4, 9, 9, sheet.best == i ? kMark : kCurve);
    centred_text(image, p[0], y1 + 8, options.captions[i], i == options.marked ? kMark : kInk);
    if (i == 0) continue;
    const auto q = place(i - 1);
    for (std::int64_t x = q[0]; x <= p[0]; ++x) {
      const double f = p[0] > q[0] ? static_cast<double>(x - q[0]) / static_cast<double>(p[0] - q[0]) : 0;
      fill(image, x, q[1] + std::lround(f * static_cast<double>(p[1] - q[1])) - 1, 1, 3, kCurve);
    }
  }
}

Image draw(const CenterSheetOptions& options, const Slices& slices, const CenterSheet& sheet) {
  const auto count = static_cast<std::int64_t>(slices.values.size()), across = std::min(kAcross, count),
             down = (count + across - 1) / across, tile = slices.pixels() + kGap;
  Image image = blank(2 * kEdge + across * tile,
                      kEdge + kLine + down * (tile + kLine) + 2 * kLine + kChart + kEdge, kPaper);
  draw_text(image, kEdge, kEdge, fitted(options.title, static_cast<double>(image.width - 2 * kEdge), kText),
            kText, kInk);
  const auto [low, high] = window_of(slices, options.marked);
  for (std::int64_t k = 0; k < count; ++k) {
    const std::int64_t x0 = kEdge + k % across * tile, y0 = kEdge + kLine + k / across * (tile + kLine);
    const auto s = static_cast<std::size_t>(k);
    if (s == options.marked) fill(image, x0 - 4, y0 - 4, slices.pixels() + 8, slices.pixels() + 8, kMark);
    for (std::int64_t y = 0; y < slices.side; ++y)
      for (std::int64_t x = 0; x < slices.side; ++x) {
        const float v = slices.values[s][static_cast<std::size_t>(y * slices.side + x)];
        const float part = high > low ? std::clamp((v - low) / (high - low), 0.0f, 1.0f) : 0.5f;
        const auto grey = static_cast<std::uint8_t>(std::lround(255 * part));
        fill(image, x0 + x * slices.zoom, y0 + y * slices.zoom, slices.zoom, slices.zoom, {grey, grey, grey});
      }
    centred_text(image, x0 + slices.pixels() / 2, y0 + slices.pixels() + 8, options.captions[s],
                 s == options.marked ? kMark : kInk);
  }
  draw_chart(image, kEdge + kLine + down * (tile + kLine), options, sheet);
  return image;
}

// --- the sheet ---

void check(const ProjectionSet& scan, const CenterSheetOptions& options) {
  const ParallelGeometry& g = scan.geometry;
  if (options.row < 0 || options.row >= g.rows)
    throw InputError(fmt::format("`row` {} is none of 0 to {}", options.row, g.rows - 1));
  if (options.centers.size() < 3 || options.captions.size() != options.centers.size() ||
      options.marked >= options.centers.size() ||
      !std::is_sorted(options.centers.begin(), options.centers.end()))
    throw InputError("a sheet takes at least 3 centres, rising, with a caption each");
  for (const double c : {options.centers.front(), options.centers.back()})
    if (!(c > -0.5 && c < static_cast<double>(g.columns) - 0.5))
      throw InputError(fmt::format("a sheet that reaches column {:.2f} leaves the detector's columns 0 to {}",
                                   c, g.columns - 1));
}

// Height of the row in the plane through the axis.
double height_of(const ProjectionSet& scan, std::int64_t row) {
  if (!scan.cone) return 0;
  double middle = 0;
  for (const ViewMatrix& m : scan.cone->views)
    middle += cone_view(m).row / static_cast<double>(scan.cone->views.size());
  return (static_cast<double>(row) - middle) * scan.geometry.pitch_v;
}

// Of a view's magnitude along its row; of half a turn, that of a slice which is nowhere negative.
double mean_integral(const ProjectionSet& row) {
  double sum = 0;
  for (const float p : row.data) sum += std::abs(static_cast<double>(p));
  return sum * row.geometry.pitch_u / static_cast<double>(row.geometry.views() * row.geometry.rows);
}

struct Means {
  double magnitude = 0, square = 0;
};

// Over the disc that every slice covers.
Means means_of(const std::vector<float>& slice, std::int64_t side) {
  Means sum;
  double count = 0;
  const double middle = 0.5 * static_cast<double>(side - 1), radius = 0.95 * middle;
  for (std::int64_t y = 0; y < side; ++y)
    for (std::int64_t x = 0; x < side; ++x)
      if (std::hypot(static_cast<double>(x) - middle, static_cast<double>(y) - middle) <= radius) {
        const auto v = static_cast<double>(slice[static_cast<std::size_t>(y * side + x)]);
        sum.magnitude += std::abs(v);
        sum.square += v * v;
        ++count;
      }
  return {sum.magnitude / count, sum.square / count};
}

}  // namespace

CenterSheet center_sheet(Device& device, const ProjectionSet& scan, const CenterSheetOptions& options,
                         const Progress& progress) {
  check(scan, options);
  const ProjectionSet row = row_of(scan, options.row);
  CenterSheet sheet;
  sheet.joined = !scan.cone && is_half_acquisition(scan.geometry, options.centers[options.marked]);
  // Streaks of half a turn; of a full one the two halves blur each other.
  sheet.sharpness = !sheet.joined && arc_of(scan.geometry) > 1.5 * pi;
  const auto at = [&](double center) {
    return sheet.joined ? joined(row, center) : with_center(row, center);
  };
  ReconstructOptions reconstruction;
  reconstruction.field = options.field;
  reconstruction.field.center.reset();
  reconstruction.upsampling = 1;
  // The smallest of the discs that centres cover is in all of them.
  double diameter = INFINITY;
  for (const double c : {options.centers.front(), options.centers.back()}) {
    const Grid grid = make_grid(at(c), {});
    diameter = std::min(diameter, static_cast<double>(grid.cells[0]) * grid.spacing[0]);
  }
  constexpr std::int64_t most_cells = 359, fewest_cells = 8;
  const std::int64_t cells =
      std::clamp<std::int64_t>(std::lround(diameter / scan.geometry.pitch_u), fewest_cells, most_cells);
  GridOptions wanted;
  wanted.size = Index3{cells, cells, 1};
  wanted.spacing = diameter / static_cast<double>(cells);
  wanted.spacing_z = scan.geometry.pitch_v;
  wanted.origin = Vec3{-diameter / 2, -diameter / 2, height_of(scan, options.row)};
  constexpr std::int64_t fewest_pixels = 240;
  Slices slices{cells + 1, (fewest_pixels + cells) / (cells + 1), {}};
  for (std::size_t k = 0; k < options.centers.size(); ++k) {
    report(progress, "slices", static_cast<double>(k) / static_cast<double>(options.centers.size()));
    const ProjectionSet one = at(options.centers[k]);
    const Volume volume = reconstruct(device, one, make_grid(one, wanted), reconstruction);
    slices.values.emplace_back(volume.samples.begin(), volume.samples.begin() + slices.side * slices.side);
    if (sheet.joined) {
      sheet.merit.push_back(mismatch(row, options.centers[k]));
      continue;
    }
    const Means mean = means_of(slices.values.back(), slices.side);
    const double over = sheet.sharpness ? std::sqrt(mean.square) : mean_integral(one) / (diameter * diameter);
    sheet.merit.push_back(over > 0 ? mean.magnitude / over : 0);
  }
  const auto best = static_cast<std::size_t>(std::min_element(sheet.merit.begin(), sheet.merit.end()) -
                                             sheet.merit.begin());
  if (best > 0 && best + 1 < sheet.merit.size()) sheet.best = best;
  sheet.image = draw(options, slices, sheet);
  return sheet;
}

}  // namespace vdvr
