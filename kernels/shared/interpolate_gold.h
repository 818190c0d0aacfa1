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

// Equal boxes, one behind the other. An interval lies between kept columns; along an axis where gold is no
// denser than these, it is one node of gold.
typedef struct {
  vdvr_count in_box, out_first, out_box;  // from box to box
  vdvr_count in_x, in_y, out_x, out_y;    // from column to column
  int boxes, z;                           // heights, a multiple of 16
  int kept_x, intervals_x;                // of a box
  int chunk, chunks, columns;             // intervals along x of a work-item; these of a row; its room
  int step_x, step_y;                     // kept columns from one interval to the next
  int skipped_x, skipped_y;               // outputs before the first that is wanted
  int outputs_x, outputs_y;               // wanted
  int phases_x, phases_y;                 // outputs to an interval
  int pad;
} VdvrAcross;

#endif
