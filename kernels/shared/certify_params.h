// What the kernels of kernels/pixel need besides a frame's (raycast_params.h). Filled by
// host/pixel/pixel_bounds.cpp; compiled by both sides.
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
// 6): of the box step, of the chord step, and of the two knots of the fast form.
#define VDVR_BOX_ROUNDING 20
#define VDVR_CHORD_ROUNDING 28
#define VDVR_FAST_ROUNDING 44
// Vectors of numbers that the list of pieces holds for each: b0 to b3, length, e; with light its two.
#define VDVR_PIECE_NUMBERS 6
#define VDVR_LIT_PIECE_NUMBERS 8
// Of a pixel's flags.
#define VDVR_PIXEL_UNTESTED 1
#define VDVR_PIXEL_ENDED 2

// Scalars only. 96 bytes.
typedef struct {
  float range_lo, range_scale;  // bin = (value - lo) * scale
  int bins;
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
  int capacity;  // pieces that the list of a packet holds
} VdvrCertify;

#endif
