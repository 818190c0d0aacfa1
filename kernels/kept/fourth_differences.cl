// The largest fourth differences of gold on closed bricks: along x, y, z, then xy, xz, yz
// (docs/error-bounds.md, section 5). Layouts: float gold[y][x][stride] with two nodes around the bricks on
// every side; float margin[y][x]; float out[brick z][y][x][6]. Called by host/kept/brick_remainder.cpp.
#include "shared/fourth_differences.h"

#define AT(c) vload8(0, c)
// Second difference along z of a column.
#define ALONG(c) fma((float8)(-2.0f), vload8(0, c), vload8(0, (c)-1) + vload8(0, (c) + 1))
#define FOURTH(a, b, c, d, e) fma((float8)(6.0f), (c), fma((float8)(-4.0f), (b) + (d), (a) + (e)))
// NaN would drop out of a maximum.
#define TAKE(largest, v)                                                                                  \
  {                                                                                                       \
    const float8 size = fabs(v);                                                                          \
    largest =                                                                                             \
        fmax(largest, select((float8)(0.0f), select((float8)(INFINITY), size, size <= FLT_MAX), inside)); \
  }

inline float largest_of(float8 v) {
  const float4 a = fmax(v.lo, v.hi);
  const float2 b = fmax(a.lo, a.hi);
  return fmax(b.x, b.y);
}

__kernel void fourth_differences(__global float* out, __global const float* gold,
                                 __global const float* margin, VdvrFourthDifferences s) {
  const int bx = (int)get_global_id(0), by = (int)get_global_id(1), bz = (int)get_global_id(2);
  if (bx >= s.bricks_x || by >= s.bricks_y || bz >= s.bricks_z) return;
  const long to_x = s.stride, to_y = (long)s.nx * s.stride;
  float8 xx = (float8)(0.0f), yy = xx, zz = xx, xy = xx, xz = xx, yz = xx;
  for (int y = by * s.side_y; y <= (by + 1) * s.side_y; ++y)
    for (int x = bx * s.side_x; x <= (bx + 1) * s.side_x; ++x) {
      const size_t column = (size_t)(y + 2) * s.nx + x + 2;
      if (margin[column] < s.lowest) continue;
      for (int z = 0; z <= s.side_z; z += 8) {
        const int8 lane = z + (int8)(0, 1, 2, 3, 4, 5, 6, 7), height = lane + bz * s.side_z;
        const int8 inside = lane <= s.side_z && height >= s.first_z && height <= s.last_z;
        __global const float* c = gold + column * s.stride + bz * s.side_z + z + 2;
        const float8 v = AT(c);
        TAKE(xx, FOURTH(AT(c - 2 * to_x), AT(c - to_x), v, AT(c + to_x), AT(c + 2 * to_x)))
        TAKE(yy, FOURTH(AT(c - 2 * to_y), AT(c - to_y), v, AT(c + to_y), AT(c + 2 * to_y)))
        TAKE(zz, FOURTH(AT(c - 2), AT(c - 1), v, AT(c + 1), AT(c + 2)))
        TAKE(xy,
             fma((float8)(4.0f), v,
                 fma((float8)(-2.0f), AT(c - to_x) + AT(c + to_x) + AT(c - to_y) + AT(c + to_y),
                     AT(c - to_x - to_y) + AT(c + to_x - to_y) + AT(c - to_x + to_y) + AT(c + to_x + to_y))))
        const float8 here = ALONG(c);
        TAKE(xz, fma((float8)(-2.0f), here, ALONG(c - to_x) + ALONG(c + to_x)))
        TAKE(yz, fma((float8)(-2.0f), here, ALONG(c - to_y) + ALONG(c + to_y)))
      }
    }
  __global float* of_brick = out + (((size_t)bz * s.bricks_y + by) * s.bricks_x + bx) * 6;
  of_brick[0] = largest_of(xx);
  of_brick[1] = largest_of(yy);
  of_brick[2] = largest_of(zz);
  of_brick[3] = largest_of(xy);
  of_brick[4] = largest_of(xz);
  of_brick[5] = largest_of(yz);
}
