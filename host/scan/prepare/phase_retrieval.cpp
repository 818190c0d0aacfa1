#include "host/scan/prepare/phase_retrieval.hpp"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <numbers>

#include "host/files/io/length_unit.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

using Complex = std::complex<double>;

std::int64_t padded(std::int64_t n) {
  return static_cast<std::int64_t>(std::bit_ceil(2 * static_cast<std::uint64_t>(n)));
}

// Which pixel of 0 .. n - 1 place i of `length` shows: the view, its mirror image after it, and from the
// other end its mirror image before it. The two meet half of the padding away from the view.
std::int64_t source_of(std::int64_t i, std::int64_t n, std::int64_t length) {
  return mirrored(i < n + (length - n) / 2 ? i : i - length, n);
}

// |k|^2 of one axis at bin b of `length`.
double squared_frequency(std::int64_t b, std::int64_t length, double pitch) {
  const std::int64_t signed_bin = b <= length / 2 ? b : b - length;
  const double k =
      2 * std::numbers::pi * static_cast<double>(signed_bin) / (static_cast<double>(length) * pitch);
  return k * k;
}

}  // namespace

double paganin_area_mm2(const PhaseRetrieval& phase) {
  constexpr double wavelength_mm_kev = 1.23984198e-6;  // h c, in mm keV
  const double wavelength = wavelength_mm_kev / phase.energy_kev;
  return phase.distance_mm * wavelength * phase.delta_beta / (4 * std::numbers::pi);
}

double millimetres_of(const std::string& unit) {
  if (const auto exponent = metres_exponent(unit)) return power_of_ten(*exponent + 3);
  throw InputError(fmt::format(
      "phase: the pitch is in '{}', whose length is not known; give 'pitch' and 'unit' (m, cm, mm, um or nm) "
      "in a scan.json",
      unit));
}

PaganinFilter::PaganinFilter(std::int64_t columns, std::int64_t rows, double pitch_u, double pitch_v,
                             double area)
    : columns_(padded(columns)),
      rows_(padded(rows)),
      pitch_u_(pitch_u),
      pitch_v_(pitch_v),
      area_(area),
      across_(columns_),
      along_(rows_) {
  if (columns_ > (std::int64_t{1} << 31) / rows_)
    throw InputError(fmt::format("phase: views of {} x {} are too large", columns, rows));
}

std::uint64_t PaganinFilter::bytes() const {
  return static_cast<std::uint64_t>(columns_ * rows_ + rows_) * sizeof(Complex);
}

void PaganinFilter::apply(View& view) const {
  std::vector<Complex> all(static_cast<std::size_t>(columns_ * rows_)), line(static_cast<std::size_t>(rows_));
  const auto row = [&](std::int64_t j) {
    return std::span<Complex>(all.data() + j * columns_, static_cast<std::size_t>(columns_));
  };
  for (std::int64_t j = 0; j < rows_; ++j) {
    const std::int64_t v = source_of(j, view.rows, rows_);
    for (std::int64_t i = 0; i < columns_; ++i)
      row(j)[static_cast<std::size_t>(i)] = std::exp(-view.at(source_of(i, view.columns, columns_), v));
    across_.forward(row(j));
  }
  const double scale = 1 / (static_cast<double>(columns_) * static_cast<double>(rows_));
  for (std::int64_t i = 0; i < columns_; ++i) {
    const double kk = squared_frequency(across_.bin_at(i), columns_, pitch_u_);
    for (std::int64_t j = 0; j < rows_; ++j)
      line[static_cast<std::size_t>(j)] = all[static_cast<std::size_t>(j * columns_ + i)];
    along_.forward(line);
    for (std::int64_t j = 0; j < rows_; ++j)
      line[static_cast<std::size_t>(j)] *=
          scale / (1 + area_ * (kk + squared_frequency(along_.bin_at(j), rows_, pitch_v_)));
    along_.inverse(line);
    for (std::int64_t j = 0; j < view.rows; ++j)
      all[static_cast<std::size_t>(j * columns_ + i)] = line[static_cast<std::size_t>(j)];
  }
  for (std::int64_t j = 0; j < view.rows; ++j) {
    across_.inverse(row(j));
    for (std::int64_t i = 0; i < view.columns; ++i)
      view.at(i, j) = -std::log(row(j)[static_cast<std::size_t>(i)].real());
  }
}

}  // namespace vdvr
