// A tolerance as Python states it, and what it is held to.
#pragma once

#include <filesystem>
#include <mutex>
#include <optional>
#include <string>

#include "long_work.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/noise_forecast.hpp"

namespace vdvr::python {

/// Where a scan was read from, and how.
struct ScanSource {
  std::filesystem::path path;
  ScanOptions how;
};

struct Asked {
  Tolerance tolerance;
  std::optional<double> sigmas;  ///< of the scan's own noise, brick by brick; then `tolerance` says nothing
  NoiseOptions noise;            ///< in place of what the scan tells
  std::optional<ScanSource> source;  ///< none of arrays: their projections alone tell their noise
};

inline std::optional<ScanNoise> find_noise(const ProjectionSet& scan, const NoiseOptions& options,
                                           const std::optional<ScanSource>& source, std::string& why) {
  if (!source) return scan_noise(scan, options, {}, &why);
  const std::lock_guard turn(hdf5_turn());
  return read_scan_noise(source->path, source->how, scan, options, &why);
}

/// Beside a tolerance of another kind; no build fails for want of it.
inline std::optional<ScanNoise> noted_noise(const ProjectionSet& scan, const Asked& asked) {
  try {
    std::string why;
    return find_noise(scan, asked.noise, asked.source, why);
  } catch (const Error& e) {
    if (e.kind() == ErrorKind::interrupted) throw;
    return std::nullopt;
  }
}

/// Of a tolerance in sigma; throws InputError where the noise is neither stated nor found.
inline ScanNoise known_noise(const ProjectionSet& scan, const Asked& asked) {
  std::string why;
  if (auto noise = find_noise(scan, asked.noise, asked.source, why)) return std::move(*noise);
  throw InputError("epsilon in sigma needs the scan's noise, and none is known: " + why +
                   "; state it by photons= or sigma_p=, or give a tolerance such as '3%'");
}

}  // namespace vdvr::python
