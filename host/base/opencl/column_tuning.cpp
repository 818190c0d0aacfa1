// The recorded table of launch parameters: of CPUs and of GPUs, the fastest candidate that
// bench/back_project_bench timed (docs/performance.md, "How to measure").
#include "host/base/opencl/column_tuning.hpp"

namespace vdvr {
namespace {

// CPUs: vectors of z per work-item, and eight columns that share positions; two vectors share the weights,
// and 32 x 32 columns what caches hold of a run of views. Measured with PoCL 3.1 on AVX-512. GPUs:
// neighbouring work-items take neighbouring z, so that loads coalesce, and their FFTs outrun a dense product.
// An NVIDIA H200 (driver 580.159) makes 634 G updates a second with a column a work-item and groups of {32,
// 4, 2}, 845 with this row, 870 with two vectors each.
const ColumnTuning recorded[] = {
    {.lanes = 16, .tile = 8, .vectors = 2, .tiles = 8, .local = {1, 1, 1}, .product_columns = 2048},
    {.lanes = 1, .tile = 8, .vectors = 1, .tiles = 1, .local = {16, 4, 4}, .product_columns = 0},
};

}  // namespace

bool carries_lanes(const DeviceInfo& device) { return device.is_cpu && device.platform != "rusticl"; }

ColumnTuning column_tuning(const DeviceInfo& device) { return recorded[carries_lanes(device) ? 0 : 1]; }

}  // namespace vdvr
