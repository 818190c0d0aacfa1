// The largest fourth differences of gold on closed bricks: along x, y, z, then xy, xz, yz
// (docs/error-bounds.md, section 5). Layouts: float gold[y][x][stride] with two nodes around the bricks on
// every side; float margin[y][x]; float out[brick z][y][x][6]. Called by
// host/certify/kept/brick_remainder.cpp.
#include "device/lanes.h"
#include "device/shared_column.h"
#include "shared/fourth_differences.h"

#if VDVR_LANES > 8
#error "six largest values and what they are of are as many registers: eight lanes at most"
#endif

#define AT(c) READ(c)
// Second difference along z of a column.
#define ALONG(c) fma((VEC)(-2.0f), READ(c), READ((c)-1) + READ((c) + 1))
#define FOURTH(a, b, c, d, e) fma((VEC)(6.0f), (c), fma((VEC)(-4.0f), (b) + (d), (a) + (e)))
// NaN would drop out of a maximum.
#define TAKE(largest, v)                                                                                  \
  {                                                                                                       \
    const VEC size = fabs(v);                                                                             \
    largest = fmax(largest, select((VEC)(0.0f), select((VEC)(INFINITY), size, size <= FLT_MAX), inside)); \
  }

// A work-group does a brick.
__kernel SHARED_COLUMN void fourth_differences(__global float* out, __global const float* gold,
                                               __global const float* margin, VdvrFourthDifferences s,
                                               SHARED_ROOM) {
  const int bx = (int)get_global_id(0) / VDVR_ALONG, by = (int)get_global_id(1), bz = (int)get_global_id(2);
  if (bx >= s.bricks_x || by >= s.bricks_y || bz >= s.bricks_z) return;
  const long to_x = s.stride, to_y = (long)s.nx * s.stride;
  const int side_x = s.side_x + 1, runs = s.side_z / VDVR_LANES + 1, all = (s.side_y + 1) * side_x * runs;
  VEC xx = (VEC)(0.0f), yy = xx, zz = xx, xy = xx, xz = xx, yz = xx;
  for (int i = OWN_PART; i < all; i += VDVR_ALONG) {
    const int in_brick = i / runs, z = (i - in_brick * runs) * VDVR_LANES, row = in_brick / side_x;
    const size_t column =
        (size_t)(by * s.side_y + row + 2) * s.nx + bx * s.side_x + in_brick - row * side_x + 2;
    if (margin[column] < s.lowest) continue;
    const INT lane = z + INDEX, height = lane + bz * s.side_z;
    const INT inside = (lane <= s.side_z) & (height >= s.first_z) & (height <= s.last_z);
    __global const float* c = gold + column * s.stride + bz * s.side_z + z + 2;
    const VEC v = AT(c);
    TAKE(xx, FOURTH(AT(c - 2 * to_x), AT(c - to_x), v, AT(c + to_x), AT(c + 2 * to_x)))
    TAKE(yy, FOURTH(AT(c - 2 * to_y), AT(c - to_y), v, AT(c + to_y), AT(c + 2 * to_y)))
    TAKE(zz, FOURTH(AT(c - 2), AT(c - 1), v, AT(c + 1), AT(c + 2)))
    TAKE(xy, fma((VEC)(4.0f), v,
                 fma((VEC)(-2.0f), AT(c - to_x) + AT(c + to_x) + AT(c - to_y) + AT(c + to_y),
                     AT(c - to_x - to_y) + AT(c + to_x - to_y) + AT(c - to_x + to_y) + AT(c + to_x + to_y))))
    const VEC here = ALONG(c);
    TAKE(xz, fma((VEC)(-2.0f), here, ALONG(c - to_x) + ALONG(c + to_x)))
    TAKE(yz, fma((VEC)(-2.0f), here, ALONG(c - to_y) + ALONG(c + to_y)))
  }
  __global float* of_brick = out + (((size_t)bz * s.bricks_y + by) * s.bricks_x + bx) * 6;
#define PUT(i, v)                                       \
  {                                                     \
    const float largest = LARGEST_OF_GROUP(LARGEST(v)); \
    if (OWN_PART == 0) of_brick[i] = largest;           \
  }
  PUT(0, xx)
  PUT(1, yy)
  PUT(2, zz)
  PUT(3, xy)
  PUT(4, xz)
  PUT(5, yz)
}
