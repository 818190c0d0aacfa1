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

// Second difference along z of a column, from the nodes below, at and above.
#define ALONG(below, at, above) fma((VEC)(-2.0f), at, (below) + (above))
#define ALONG_AT(c, at) ALONG(READ((c)-1), at, READ((c) + 1))
#define FOURTH(a, b, c, d, e) fma((VEC)(6.0f), (c), fma((VEC)(-4.0f), (b) + (d), (a) + (e)))
// NaN would drop out of a maximum of floats. Bits of magnitudes rise as these do, and NaN's are the highest.
#define TAKE(largest, v) largest = max(largest, BITS(v) & counts);

// A work-group does a brick. A work-item walks along x, row by row and run of heights by run: what the next
// column reads of its neighbours it has already.
__kernel SHARED_COLUMN void fourth_differences(__global float* out, __global const float* gold,
                                               __global const float* margin, VdvrFourthDifferences s,
                                               SHARED_ROOM) {
  const int bx = (int)get_global_id(0) / VDVR_ALONG, by = (int)get_global_id(1), bz = (int)get_global_id(2);
  if (bx >= s.bricks_x || by >= s.bricks_y || bz >= s.bricks_z) return;
  const long to_x = s.stride, to_y = (long)s.nx * s.stride;
  const int runs = s.side_z / VDVR_LANES + 1, all = (s.side_y + 1) * runs;
  INT xx = (INT)(0), yy = xx, zz = xx, xy = xx, xz = xx, yz = xx;
  for (int i = OWN_PART; i < all; i += VDVR_ALONG) {
    const int row = i / runs, z = (i - row * runs) * VDVR_LANES;
    const INT lane = z + INDEX, height = lane + bz * s.side_z;
    const INT inside = select((INT)(0), (INT)(0x7fffffff),
                              (lane <= s.side_z) & (height >= s.first_z) & (height <= s.last_z));
    const size_t column = (size_t)(by * s.side_y + row + 2) * s.nx + bx * s.side_x + 2;
    __global const float* c = gold + column * s.stride + bz * s.side_z + z + 2;
    // Columns two and one before, here and one further; of the rows before and after, and second differences.
    VEC west2 = READ(c - 2 * to_x), west = READ(c - to_x), here = READ(c), east = READ(c + to_x);
    VEC before_west = READ(c - to_x - to_y), before = READ(c - to_y);
    VEC after_west = READ(c - to_x + to_y), after = READ(c + to_y);
    VEC below = READ(c - 1), above = READ(c + 1);
    VEC along_west = ALONG_AT(c - to_x, west), along = ALONG(below, here, above);
    for (int x = 0; x <= s.side_x; ++x, c += to_x) {
      const VEC east2 = READ(c + 2 * to_x), before_east = READ(c + to_x - to_y),
                after_east = READ(c + to_x + to_y), below_east = READ(c + to_x - 1),
                above_east = READ(c + to_x + 1), along_east = ALONG(below_east, east, above_east);
      SOON(c + 3 * to_y);
      const INT counts = margin[column + x] < s.lowest ? (INT)(0) : inside;
      TAKE(xx, FOURTH(west2, west, here, east, east2))
      TAKE(yy, FOURTH(READ(c - 2 * to_y), before, here, after, READ(c + 2 * to_y)))
      TAKE(zz, FOURTH(READ(c - 2), below, here, above, READ(c + 2)))
      TAKE(xy, fma((VEC)(4.0f), here,
                   fma((VEC)(-2.0f), west + east + before + after,
                       before_west + before_east + after_west + after_east)))
      TAKE(xz, fma((VEC)(-2.0f), along, along_west + along_east))
      TAKE(yz, fma((VEC)(-2.0f), along, ALONG_AT(c - to_y, before) + ALONG_AT(c + to_y, after)))
      west2 = west;
      west = here;
      here = east;
      east = east2;
      before_west = before;
      before = before_east;
      after_west = after;
      after = after_east;
      below = below_east;
      above = above_east;
      along_west = along;
      along = along_east;
    }
  }
  __global float* of_brick = out + (((size_t)bz * s.bricks_y + by) * s.bricks_x + bx) * 6;
#define PUT(i, v)                                                                                 \
  {                                                                                               \
    const INT finite = v <= (INT)(0x7f7fffff);                                                    \
    const float largest = LARGEST_OF_GROUP(LARGEST(select((VEC)(INFINITY), OF_BITS(v), finite))); \
    if (OWN_PART == 0) of_brick[i] = largest;                                                     \
  }
  PUT(0, xx)
  PUT(1, yy)
  PUT(2, zz)
  PUT(3, xy)
  PUT(4, xz)
  PUT(5, yz)
}
