// What one frame's kernels need besides the field. Filled by host/picture/render/raycast.cpp, read by
// raycast.cl; compiled by both sides. "cells" are base-cell coordinates per axis; "lengths" are multiples of
// the smallest base spacing.
#ifndef VDVR_RAYCAST_PARAMS_H
#define VDVR_RAYCAST_PARAMS_H

// The kernels of raycast.cl and d2vr.cl, of which a program holds the one that VDVR_KERNEL says: most users
// draw in one mode, and some compilers take seconds for each kernel, wanted or not.
#define VDVR_KERNEL_DVR 1
#define VDVR_KERNEL_PREINTEGRATED 2
#define VDVR_KERNEL_LEVEL 3
#define VDVR_KERNEL_ISO 4
#define VDVR_KERNEL_MIP 5
#define VDVR_KERNEL_SLICE 6
#define VDVR_KERNEL_POINTS 7
#define VDVR_KERNEL_ADAPTIVE 8
#define VDVR_KERNEL_INTEGRAL 9

// A step adapted to the picture has 2^l parts, l below this.
#define VDVR_ADAPTED_LEVELS 5
// What a part may change of a pixel, full opacity and full colour being 1, before there are twice as many.
#ifndef VDVR_PART_CHANGE
#define VDVR_PART_CHANGE 0.03125f
#endif

#define VDVR_SURFACES 8

// With VDVR_BASE_FIRST a byte of the guide says of a brick: 0 a tile of its own, below this the distance to
// the nearest brick that is not like it (reads the base, and may show something), from this on it shows
// nothing, and how far it is to one that does is added.
#define VDVR_GUIDE_EMPTY 128

// Of a slice's pixels outside the grid.
#define VDVR_GREY_OUTSIDE 0.02f

// An iso-surface; `opacity` of the surface itself.
typedef struct {
  float value, opacity, rgb[3];
} VdvrSurface;

#define VDVR_LIGHTS 8

// Scalars only: no alignment that two compilers could read differently. 464 bytes.
typedef struct {
  float eye_x, eye_y, eye_z;              // cells
  float forward_x, forward_y, forward_z;  // unit vector, world axes
  float right_x, right_y,
      right_z;             // world axes, times the tangent of the half view angle and the aspect ratio
  float up_x, up_y, up_z;  // world axes, times the tangent of the half view angle
  float cells_per_length_x, cells_per_length_y, cells_per_length_z;
  float step, inverse_step;  // lengths
  float length_unit;         // world units per length
  float table_lo, table_scale;
  int table_size;
  float shown_from, shown_to;  // places in the table, [from, to), of values that may show something
  float termination;
  float gradient_full;  // gradient, density per length, from which on a sample is fully shaded
  float slack;          // rounding allowance of the sampler on a brick's range
  float background_top[3], background_bottom[3];
  int width, height;
  int pixel_x, pixel_y;  // the first one that is drawn
  int shading;
  int skip;
  int surfaces;  // in order of their values
  VdvrSurface surface[VDVR_SURFACES];
  int head_light;  // a light at the eye; asked only where there are others
  int lights;
  float light[VDVR_LIGHTS][3];  // unit vectors towards them, world axes
  float light_share;            // of each in the light that is not ambient
  // What is drawn: a box in cells, within the grid, and an upright cylinder. Its centre in cells, and radii
  // per cell, 0 where there is none.
  float clip_low[3], clip_high[3];
  float cylinder_x, cylinder_y, cylinder_per_x, cylinder_per_y;
} VdvrRaycast;

// A slice: cell coordinate of pixel (x, y) is first + x * dx along axis `across`, first + y * dy along axis
// `down`.
typedef struct {
  float first[3];  // cells, of pixel (0, 0)
  float step_across, step_down;
  int across, down;  // axes: 0 x, 1 y, 2 z
  float window_lo, window_scale;
  int width, height;
  int pixel_x, pixel_y;  // the first one that is drawn
} VdvrSlice;

#endif
