// Which bricks share a vtkImageData.
#pragma once

#include <vector>

#include "vdvr/expert/export_vtk.hpp"

namespace vdvr {

/// What a block is worth, in points: where a box at its finest triple costs no more than `worth` beyond what
/// its parts cost, it is one block.
std::vector<VtkBlock> partition(const MixedVolume& volume, double worth);

}  // namespace vdvr
