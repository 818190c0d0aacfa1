// How `verify` makes F, apart from everything that build uses: back-projection of nodes by six points of
// Lagrange in u, a product along z to the heights of gold, and twelve points of Lagrange, or more, across z
// (docs/error-bounds.md, "What verify does", step 1).
// Layouts: float table[view][fine column][16], 16 rows or heights; float nodes[wanted
// tile][y][x][rows_padded]; int slots[tile y][tile x]: which wanted tile that is, 0 where it is none; float
// gold[block][y][x][16 * groups]. Called by host/verify/witness/nodes.cpp.
#include "device/lanes.h"
#include "shared/verify_nodes.h"

// --- back-projection ---

// Lane i of a float8 belongs to the node x + i.
#define FOR_TILE(M) M(0, s0) M(1, s1) M(2, s2) M(3, s3) M(4, s4) M(5, s5) M(6, s6) M(7, s7)
#define BEGIN(i, lane) VEC total##i = (VEC)(0.0f), lost##i = total##i;
#define CLEAR(i, lane) VEC sum##i = (VEC)(0.0f);
#define ADD(i, lane)                                \
  {                                                 \
    __global const float* q = plane + at.lane * 16; \
    VEC v = w0.lane * READ(q);                      \
    v = fma((VEC)(w1.lane), READ(q + 16), v);       \
    v = fma((VEC)(w2.lane), READ(q + 32), v);       \
    v = fma((VEC)(w3.lane), READ(q + 48), v);       \
    v = fma((VEC)(w4.lane), READ(q + 64), v);       \
    v = fma((VEC)(w5.lane), READ(q + 80), v);       \
    sum##i += v;                                    \
  }
// What is rounded off when a run's sum is added is found exactly (Knuth), and added at the end.
#define FOLD(i, lane)                                          \
  {                                                            \
    const VEC next = total##i + sum##i, own = next - total##i; \
    lost##i += (total##i - (next - own)) + (sum##i - own);     \
    total##i = next;                                           \
  }
#define PUT(i, lane)                                         \
  {                                                          \
    __global float* to = target + (size_t)i * s.rows_padded; \
    const VEC value = total##i + lost##i;                    \
    WRITE(accumulate ? READ(to) + value : value, to);        \
  }

// Adds the table's views at VDVR_LANES of its 16 rows. steps: per tile and view of the scan {columns per node
// along x, along y, the tile's first node less a whole number of columns, that whole number}.
__kernel void verify_nodes(__global float* nodes, __global const float* table, __global const float4* steps,
                           VdvrVerifyRows s) {
  const int row = (int)get_global_id(0) * VDVR_LANES, y = (int)get_global_id(1), tile = (int)get_global_id(2);
  if (row >= 16 || y >= VDVR_VERIFY_TILE || tile >= s.tiles) return;
  // Copies, which no store can be taken to change.
  const int accumulate = s.accumulate, views = s.views, columns = s.columns;
  __global float* target =
      nodes + ((size_t)tile * VDVR_VERIFY_TILE + y) * VDVR_VERIFY_TILE * s.rows_padded + s.first_row + row;
  __global const float4* view = steps + (size_t)tile * s.all_views + s.first_view;
  __global const float* plane = table + row;
  const float8 along = (float8)(0, 1, 2, 3, 4, 5, 6, 7);
  FOR_TILE(BEGIN)
  for (int first = 0; first < views; first += VDVR_VERIFY_VIEWS) {
    const int end = min(views, first + VDVR_VERIFY_VIEWS);
    FOR_TILE(CLEAR)
    for (int k = first; k < end; ++k, plane += (size_t)columns * 16) {
      const float4 step = view[k];
      // s > 0 in the tile by the host's choice of the whole number: truncation is floor.
      const float8 p = fma((float8)(step.x), along, (float8)(fma(step.y, (float)y, step.z)));
      const int8 below = convert_int8(p);
      const float8 f = p - convert_float8(below);
      // Lagrange weights on the nodes -2 .. 3.
      const float8 a = f + 2.0f, b = f + 1.0f, c = f - 1.0f, d = f - 2.0f, e = f - 3.0f;
      const float8 bf = b * f, de = d * e, abf = a * bf, cde = c * de;
      const float8 w0 = bf * cde * (-1.0f / 120.0f), w1 = a * f * cde * (1.0f / 24.0f),
                   w2 = a * b * cde * (-1.0f / 12.0f), w3 = abf * de * (1.0f / 12.0f),
                   w4 = abf * c * e * (-1.0f / 24.0f), w5 = abf * c * d * (1.0f / 120.0f);
      const int8 at = clamp((int)step.w + below, (int8)2, (int8)(columns - 4)) - 2;
      FOR_TILE(ADD)
    }
    FOR_TILE(FOLD)
  }
  FOR_TILE(PUT)
}

// --- along z ---

#define FROM(i, lane)                                                                                   \
  const int x##i = clamp(place.x + x + i, 0, s.tiles_x * VDVR_VERIFY_TILE - 1),                         \
            node##i =                                                                                   \
                (tile_row[x##i / VDVR_VERIFY_TILE] * VDVR_VERIFY_TILE + in_tile_y) * VDVR_VERIFY_TILE + \
                x##i % VDVR_VERIFY_TILE;                                                                \
  __global const float* from##i = nodes + (size_t)node##i * s.rows_padded + rows.x;
#define MULTIPLY(i, lane) sum##i = fma(w, (VEC)(from##i[r]), sum##i);
#define PUT_HEIGHTS(i, lane) \
  if (x + i < s.nx) WRITE(total##i + lost##i, to + (size_t)i * s.groups * 16);

// matrix: per group of 16 heights its weights [row][16], from the row bands[group] = {first row, rows, where
// its weights begin in units of 16}. places: the blocks' first nodes x, y in the part.
__kernel void verify_heights(__global float* gold, __global const float* nodes, __global const float* matrix,
                             __global const int4* bands, __global const int2* places,
                             __global const int* slots, VdvrVerifyHeights s) {
  const int height = (int)get_global_id(0) * VDVR_LANES, group = height / 16, lane = height - group * 16,
            x = (int)get_global_id(1) * 8;
  const int block = (int)get_global_id(2) / s.ny, block_y = (int)get_global_id(2) - block * s.ny;
  if (group >= s.groups || x >= s.nx || block >= s.blocks) return;
  const int2 place = places[block];
  const int4 rows = bands[group];
  const int y = clamp(place.y + block_y, 0, s.tiles_y * VDVR_VERIFY_TILE - 1),
            in_tile_y = y % VDVR_VERIFY_TILE;
  __global const int* tile_row = slots + (size_t)(y / VDVR_VERIFY_TILE) * s.tiles_x;
  __global float* to = gold + ((((size_t)block * s.ny + block_y) * s.nx + x) * s.groups + group) * 16 + lane;
  __global const float* weights = matrix + (size_t)rows.z * 16 + lane;
  FOR_TILE(FROM)
  FOR_TILE(BEGIN)
  for (int first = 0; first < rows.y; first += VDVR_VERIFY_ROWS) {
    const int end = min(rows.y, first + VDVR_VERIFY_ROWS);
    FOR_TILE(CLEAR)
    for (int r = first; r < end; ++r) {
      const VEC w = READ(weights + (size_t)r * 16);
      FOR_TILE(MULTIPLY)
    }
    FOR_TILE(FOLD)
  }
  FOR_TILE(PUT_HEIGHTS)
}

// --- across z ---

// Along one axis of in[outer][before][inner]: out[outer][after][inner]. weights[phase][points] are of the
// nodes around; phases[block][axis]: how far the first value lies behind the node in the middle of the first.
__kernel void verify_between(__global float* out, __global const float* in, __global const float* weights,
                             __global const int* phases, VdvrVerifyBetween s) {
  const int n = (int)get_global_id(0) * VDVR_LANES, i = n / 16, lane = n - i * 16,
            place = (int)get_global_id(1), o = (int)get_global_id(2);
  if (i >= s.inner || place >= s.after || o >= s.outer) return;
  const int at = phases[2 * (o / (s.outer / s.blocks)) + s.axis] + place * s.by, first = at / s.factor,
            phase = at - first * s.factor, points = s.points;
  __global const float* from = in + ((size_t)o * s.before * s.inner + i) * 16 + lane;
  VEC v;
  if (phase == 0) {
    v = READ(from + (size_t)(first + points / 2 - 1) * s.inner * 16);
  } else {
    __global const float* w = weights + phase * points;
    __global const float* p = from + (size_t)first * s.inner * 16;
    v = w[0] * READ(p);
    for (int n = 1; n < points; ++n) v = fma((VEC)(w[n]), READ(p + (size_t)n * s.inner * 16), v);
  }
  WRITE(v, out + (((size_t)o * s.after + place) * s.inner + i) * 16 + lane);
}
