// The paper's test scans, and every field that its figures compare, on the samples of one grid: the function
// itself, F, D2VR and stored volumes. Called by cases.cpp and the sections of the report.
#pragma once

#include <vector>

#include "vdvr/expert/d2vr.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/reconstruct.hpp"
#include "vdvr/expert/simulate.hpp"

namespace vdvr::paper {

struct TestScan {
  Phantom object;
  ProjectionSet scan;
  Grid grid;  ///< base cells
};

/// Marschner-Lobb in the paper's set-up (docs/phantoms.md): 65 x 65 detector, cube of half side 32 / sqrt 2
/// pixels in 64^3 cells. Its values lie in [0, 1].
TestScan marschner_lobb_scan(int angles, const Progress& progress = {});
/// Shepp-Logan with the thin tumours: 129 x 129 detector, 202 views, 128^3 cells of a pixel; with `tumours`
/// only the cells around the four tumours of density .2.
TestScan shepp_logan_scan(bool tumours, const Progress& progress = {});

/// `samples` points spread evenly over the box, wholly within `part` of it in x and y and over all z: the
/// middles of as many equal boxes, so that none lies on the base grid's own planes unless the numbers divide.
Grid lattice(const Grid& grid, const Index3& samples, double part = 7.0 / 8);
/// One plane across z, `side` x `side` points, as two planes of samples a thousandth of a cell apart, because
/// a grid has at least one cell; the plane is the first.
Grid slice_lattice(const Grid& grid, std::int64_t side, double z, double part = 7.0 / 8);

/// Each gives the samples [z][y][x] of `at`.
std::vector<float> function_on(const Phantom& object, const Grid& at);
/// F by cubic interpolation of 16x upsampled projections: its own error is far below what is measured
/// (docs/error-bounds.md).
std::vector<float> field_on(Device& device, const ProjectionSet& scan, const Grid& at,
                            const Progress& progress = {});
/// As the paper makes its own: 8x, linear.
std::vector<float> paper_field_on(Device& device, const ProjectionSet& scan, const Grid& at,
                                  const Progress& progress = {});
std::vector<float> d2vr_on(const D2vrField& field, const Grid& at, const Progress& progress = {});
/// By the sampler that draws it.
std::vector<float> stored_on(const MixedVolume& volume, const Grid& at, const Progress& progress = {});

/// F on the base grid, from 8x upsampled projections as the paper makes its uniform volumes.
Volume uniform_volume(Device& device, const ProjectionSet& scan, const Grid& grid,
                      const Progress& progress = {});

}  // namespace vdvr::paper
