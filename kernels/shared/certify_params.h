// What the kernels of kernels/picture/pixel need besides a frame's (raycast_params.h). Filled by
// host/picture/pixel/pixel_bounds.cpp; compiled by both sides.
#ifndef VDVR_CERTIFY_PARAMS_H
#define VDVR_CERTIFY_PARAMS_H

#define VDVR_KERNEL_CERTIFY 8
#define VDVR_KERNEL_CERTIFY_FAST 9

// How far bins are taken outward, in bins: more than fp32 errs by in a place below 2^14, thrice 2^-24 of it.
#define VDVR_BIN_MARGIN 0.00390625f
// Into how many parts a piece is cut at most.
#define VDVR_MOST_PARTS 64
#define VDVR_UNIT 5.9604644775390625e-8f
// What cutting a piece makes of a part's coefficients, of the largest step between two of the piece's: 144 u.
#define VDVR_CUT_ROUNDING (144 * VDVR_UNIT)
// What fp32 makes of a step, in u of the share that its part takes of a colour (docs/pixel-bounds.md, theorem
// 6): of box steps and joint steps, and of the two knots of the fast form.
#define VDVR_STEP_ROUNDING 20
#define VDVR_FAST_ROUNDING 44
// What fp32 makes of H0, in u of the part's largest extinction times a colour: with it H0 is a bound.
#define VDVR_JOINT_ROUNDING 32
// Stretches of the transfer function that a joint step looks at one by one, less one.
#define VDVR_MOST_BENDS 3
// Vectors of numbers that the list of pieces holds for each: b0 to b3, length, e; with light its two.
#define VDVR_PIECE_NUMBERS 6
#define VDVR_LIT_PIECE_NUMBERS 8
// Of a pixel's flags.
#define VDVR_PIXEL_UNTESTED 1
#define VDVR_PIXEL_ENDED 2

// Scalars only. 128 bytes.
typedef struct {
  float range_lo, range_scale;  // bin = (value - lo) * scale
  int bins;
  int or_clear;                // beside the values of a part there may be others, which show nothing
  int first_edge, first_bend;  // rows of the table of ranges (host/picture/pixel/range_table.hpp)
  // By what extinctions there are off; H0 then, and for each unit of extinction of the part's largest.
  float extinction_error, joint_error, joint_rounding;
  float parts_per_spread;  // 3 / (2 kappa): parts = this times the largest step of coefficients over e
  float deep;              // log2(1 / theta)
  float theta;
  float slack;     // what fp32 makes of a coefficient
  float reach[3];  // what fp32 makes of a position on a ray, cells
  // What a colour is off by in fp32: the one behind all; for each part the sum, and of the share that the
  // part takes what makes it.
  float first_error, sum_error, share_error;
  float colour_lo[3], colour_hi[3];  // of all that may show, light included
  int first_row, rows;               // of the picture, in this launch
  int first_column, columns;
  int capacity;        // pieces that the list of a packet holds
  int items_x, items;  // work-items of the launch: along x, and in all
} VdvrCertify;

#endif
