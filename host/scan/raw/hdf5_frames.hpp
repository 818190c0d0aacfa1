// Datasets of HDF5 files as frames: [angle][v][u], or [v][angle][u] where an `axes` attribute puts the angle
// second (sinogram order).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "host/files/hdf5/hdf5_reader.hpp"
#include "host/scan/raw/raw_scan.hpp"
#include "vdvr/expert/scan_options.hpp"

namespace vdvr::io {

/// What a reader of HDF5 scans is asked for.
struct Hdf5Wanted {
  std::string entry;         ///< the group that holds the scan; empty: the only one
  std::optional<Beam> beam;  ///< cone: of NXtomo, by its distances; parallel: stated, whatever these say
  bool own_angles = true;    ///< false: the file's are not looked at; these are taken
  std::vector<double> angles_deg;
  std::optional<AngleUnit> angle_unit;  ///< of the file's own, whatever it says
  std::string beam_current{};           ///< as InputStatement's
};

struct FrameStack {
  std::shared_ptr<const hdf5::Dataset> data;
  int axis = 0;  ///< of the frames
  std::int64_t count = 0, rows = 0, columns = 0;
};

/// A dataset as frames; a two-dimensional one is a single frame. Throws FileError.
FrameStack open_frames(const hdf5::Reader& file, const std::string& object, int fallback_axis);
/// All of a stack. No list is made: a damaged header may claim any number of them.
Frames all_frames(const FrameStack& stack, const std::string& what);
/// Some of a stack's frames, by number, read in runs of neighbours.
Frames frames_of(const FrameStack& stack, std::vector<std::int64_t> numbers, const std::string& what);
/// The beam's current in each of `frames` frames: of the dataset that is `wanted`, else of the `usual` one
/// where the file has it. Empty where there is none, and where one number is all it says. Throws FileError.
std::vector<double> read_currents(const hdf5::Reader& file, const std::string& wanted,
                                  const std::string& usual, std::int64_t frames, const char* order,
                                  std::string& name);
void require_same_detector(const FrameStack& a, const FrameStack& b);

/// How many numbers a list holds; looked at before it is read, since a damaged header may claim any.
std::int64_t count_of(const hdf5::Dataset& data);
/// Angles in degrees, of the unit that is `stated`, else by the dataset's units; degrees where it has none,
/// as both formats prescribe. `counts`: how many there may be. Throws FileError.
std::vector<double> read_angles(const hdf5::Reader& file, const std::string& object,
                                const std::vector<std::int64_t>& counts, const FrameStack& frames,
                                std::optional<AngleUnit> stated);

}  // namespace vdvr::io
