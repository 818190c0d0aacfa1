// Scans from files: Data Exchange and NXtomo HDF5, a folder with scan.json, an MHA/NRRD stack with an angles
// file; and projections written as Data Exchange (docs/inputs.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "vdvr/api.hpp"
#include "vdvr/expert/line_noise.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"
#include "vdvr/expert/scan_options.hpp"
#include "vdvr/expert/understood.hpp"

namespace vdvr {

/// Line integrals: flats and darks averaged, -log with a floor, dead pixels replaced by their neighbours'
/// median and counted, optional air background taken off, then `preparation`, which the report keeps. Centre:
/// option, else file, else found from opposite views, else (U-1)/2. With cone beam: option, else file, else
/// (U-1)/2. Throws FileError or InputError (NaN, zero flats, wrong counts of angles, truncated files, ...).
/// `understood` is filled unless it is null.
VDVR_API ProjectionSet read_scan(const std::filesystem::path& path, const ScanOptions& options = {},
                                 const Progress& progress = {}, Understood* understood = nullptr);

/// The noise of a scan's line integrals by its repeated flats and darks, pixel by pixel (photon transfer:
/// Janesick, SPIE Press 2007), of binned ones where `preparation` bins. Nothing of line integrals, of fewer
/// than five flats, or where flats do not vary. Throws what read_scan() throws of these. Cost: flats are read
/// three times, darks twice, projections not at all.
VDVR_API std::optional<LineIntegralNoise> read_line_noise(const std::filesystem::path& path,
                                                          const ScanOptions& options = {});

/// /exchange/data float32 [angle][v][u] with description = "line integrals", pitch_u, pitch_v, center, unit,
/// axis_roll where the axis leans;
/// theta in degrees. Written whole or not at all.
VDVR_API void write_data_exchange(const std::filesystem::path& path, const ProjectionSet& scan);

/// The counts of a detector for a scan whose line integrals are exact.
struct PhotonCounts {
  double photons = 0;      ///< of a pixel in the open beam, up to 1e9
  std::uint64_t seed = 1;  ///< of Poisson's variates; the same on every machine
  std::int64_t flats = 10, darks = 10;
  int offset = 100;  ///< what the dark counts
  /// Runs of `flats` flats: the first before all projections, the last behind them, others evenly between.
  /// Two and more are written with their places, /exchange/data_white_at.
  std::int64_t flat_runs = 1;
  /// From the first to the last frame the open beam's ends rise and fall by this share: it is photons * (1 +
  /// drift * time * x), x from -1 to 1 across the columns. Below 1.
  double flat_drift = 0;
  /// The share of its current that the beam loses from the first to the last frame; where it is not 0, the
  /// currents are written, /exchange/beam_current. Below 1.
  double beam_decay = 0;
};

/// Counts as Data Exchange: /exchange/data [angle][v][u] is offset + Poisson(photons e^-p), data_white offset
/// + Poisson(photons), data_dark the offset; uint16, or uint32 where they need it. Written whole or not at
/// all. Throws InputError for photons out of range.
VDVR_API void write_photon_counts(const std::filesystem::path& path, const ProjectionSet& scan,
                                  const PhotonCounts& counts);

}  // namespace vdvr
