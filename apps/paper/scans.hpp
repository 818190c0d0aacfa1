// The paper's practical objects: a head in the place of its carp and beetle, with its recipe for a scan, and
// the tumours of its Shepp-Logan phantom as a picture shows them. Called by objects.cpp.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/paper/fields.hpp"

namespace vdvr::paper {

/// Scan and grid of the paper's carp: 142 views of 129 x 257 pixels that span the volume's largest extents,
/// noise of 0.05, median 5, blur (0.1, 4), binning 8; 128 x 128 x 256 cells. The volume is centred first.
/// Cost: 142 * 1032 * 2056 exact line integrals, twice. Memory: two copies of the volume.
TestScan carp_sized_scan(Volume volume, std::uint64_t max_memory_bytes, const Progress& progress = {});
/// The volume resampled trilinearly to 103 x 63 x 129 samples, the beetle's size, a unit apart, and scanned
/// band-limited by 190 views of 121 x 129 pixels; 102 x 62 x 128 cells.
TestScan beetle_sized_scan(const Volume& volume, const Progress& progress = {});

/// A tumour of density .2 in the slice z = 0 of Shepp-Logan.
struct Tumour {
  std::string name;
  double density = 0;  ///< of the function at its centre
  double peak = 0;     ///< largest value along lines in x across it, averaged over its middle in y
};
/// The three thin tumours and the thick one as a field shows them; `value` takes world points. Cost: about
/// 3,000 calls.
std::vector<Tumour> tumours(const Phantom& object, const std::function<double(const Vec3&)>& value);

}  // namespace vdvr::paper
