// Points of a cone-beam field, and a view of them. Passed from host/field/fdk/cone_points.cpp to
// cone_points.cl.
#ifndef VDVR_CONE_POINTS_H
#define VDVR_CONE_POINTS_H

// Taps on the table along either axis.
#define VDVR_POINT_TAPS 16

// 48 bytes. Times (x, y, z, 1): column and row of the table, from its middle on, times lambda; and lambda.
typedef struct {
  float u[4], v[4], lambda[4];
} VdvrPointView;

// 40 bytes.
typedef struct {
  int points, views;
  int columns, rows, row_stride;  // of the table, at 2 to a pixel
  int middle_u, middle_v;         // where places are counted from
  int steps;                      // sets of taps from one entry of the table to the next
  int adds;                       // to what is there
  int reserved;
} VdvrConePoints;

#endif
