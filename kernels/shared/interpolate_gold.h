// What kernels/certify/kept/interpolate.cl is told of the arrays it reads and writes: floats between
// neighbours along an axis, and where its own part begins. z is contiguous, and every column begins at a
// multiple of 16. Passed by value from host/certify/kept/interpolate_gold.cpp.
#ifndef VDVR_INTERPOLATE_GOLD_H
#define VDVR_INTERPOLATE_GOLD_H

#ifdef __OPENCL_VERSION__
typedef ulong vdvr_count;
#else
#include <cstdint>
typedef std::uint64_t vdvr_count;
#endif

// A rectangle of columns.
typedef struct {
  vdvr_count in_first, out_first;
  int columns_x, columns_y;
} VdvrColumns;

// Of rectangles of one launch.
typedef struct {
  vdvr_count in_x, in_y, out_x, out_y;  // from column to column
  int parts;
  int columns_x, columns_y;  // most of any part
  int terms;                 // input heights to a group of 16 outputs
  int groups;                // of 16 output heights
  int pad;
} VdvrAlongZ;

// Equal boxes, one behind the other.
typedef struct {
  vdvr_count in_first, out_first;
  vdvr_count in_box, out_box;                           // from box to box
  vdvr_count in_along, in_other, out_along, out_other;  // along the filter's axis, and across it
  int boxes;
  int others, z;  // columns across the axis, and heights, a multiple of 16
  int intervals;  // between input nodes, each with its outputs from its low node on
  int step;       // input nodes from one interval to the next
  int skipped;    // outputs before the first that is wanted
  int outputs;    // wanted
  int phases;     // outputs to an interval
} VdvrAcross;

#endif
