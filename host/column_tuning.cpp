// The recorded table of launch parameters. A row is what `vdvr bench tune` found fastest on a device of that
// class.
#include "host/column_tuning.hpp"

namespace vdvr {
namespace {

// GPUs: neighbouring work-items take neighbouring z, so that loads coalesce, and their FFTs outrun a dense
// product. CPUs: a vector of z per work-item, and eight columns that share positions and weights.
const ColumnTuning recorded[] = {
    {"cpu", 16, 8, 2, {1, 8, 16}, 512},
    {"gpu", 1, 1, 1, {32, 4, 2}, 0},
};

}  // namespace

#include <cstdlib>
ColumnTuning column_tuning(const DeviceInfo& device) { auto t= recorded[device.is_gpu ? 1 : 0];
 if (getenv("TV")) { t.vectors=atoi(getenv("TV")); t.local[1]=atoi(getenv("TY")); t.local[2]=atoi(getenv("TZ"));} return t; }

}  // namespace vdvr
