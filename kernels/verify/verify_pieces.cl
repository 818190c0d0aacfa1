// What `verify` finds on gold, apart from everything build uses but the sampler header: |V - F| at the nodes
// of every tested brick, fourth differences of F, and per gold cell the bound on |V - F|
// (docs/error-bounds.md, "What verify does"). F is made by verify_nodes.cl.
// A piece is a cube of `cells` gold cells: a brick, or a part of one. Places of pieces count pieces from the
// grid's first; `rate` gold cells to a cell of the grid.
// Layouts: float field[block][y + 2][x + 2][z_padded] with node z at z + 2, two nodes of halo on every side;
// float error[item][y][x][error_padded], one item per tested piece; int4 items[item] = piece x, y, z and its
// block; int4 first[block] = the block's first piece; uchar tested[block][cell y][cell x]: columns of gold
// cells that can hold a covered point. Called by host/verify/verify_pieces.cpp.
#include "device/lanes.h"
#include "device/powers.h"
#include "device/shared_column.h"
#include "shared/mixed_sampler.h"
#include "shared/verify_pieces.h"

#define RADIUS 2

// --- |V - F| at nodes ---

static inline __global const float* field_column(__global const float* field, int4 item, int4 first, int x,
                                                 int y, int cells, int nx, int ny, int z_padded) {
  const int bx = (item.x - first.x) * cells + x + RADIUS, by = (item.y - first.y) * cells + y + RADIUS;
  return field + (((size_t)item.w * ny + by) * nx + bx) * z_padded + (item.z - first.z) * cells + RADIUS;
}

// The last node of a piece along an axis where the grid has `all` gold cells.
static inline int last_node(int piece, int cells, int all) { return min(cells, all - piece * cells); }

// One work-item does s.each nodes of a column; nodes, or runs of them, follow one another along z.
__kernel void verify_errors(__global float* error, __global const float* field, __global const uchar* samples,
                            __global const uint* bricks, VdvrGrid grid, __global const int4* items,
                            __global const int4* first, VdvrPieces s) {
  const int g = grid.granularity, per_brick = g * s.rate, side = s.cells + 1;
  const int from = (int)get_global_id(0) * s.each, in_piece = (int)get_global_id(1), y = in_piece / side,
            x = in_piece - y * side, i = (int)get_global_id(2);
  if (y >= side || i >= s.count) return;
  const int4 item = items[i];
  if (x > last_node(item.x, s.cells, grid.cells_x * s.rate) ||
      y > last_node(item.y, s.cells, grid.cells_y * s.rate))
    return;
  const int last_z = min(last_node(item.z, s.cells, grid.cells_z * s.rate), from + s.each - 1);
  if (from > last_z) return;
  const int bx = item.x * s.cells / per_brick, by = item.y * s.cells / per_brick,
            bz = item.z * s.cells / per_brick;
  const int from_x = item.x * s.cells - bx * per_brick, from_y = item.y * s.cells - by * per_brick,
            from_z = item.z * s.cells - bz * per_brick;
  const VdvrBrick b = vdvr_brick(bricks, grid, ((ulong)bz * grid.bricks_y + by) * grid.bricks_x + bx);
  // Gold nodes are dyadic fractions of a cell: these cell coordinates are exact.
  const float to_cells = inverse_of_power(s.rate);
  const VdvrLocal lx = vdvr_local((float)(bx * g) + (float)(from_x + x) * to_cells, bx, b.level_x, g,
                                  grid.cells_x, grid.coarse_x),
                  ly = vdvr_local((float)(by * g) + (float)(from_y + y) * to_cells, by, b.level_y, g,
                                  grid.cells_y, grid.coarse_y);
  __global const float* f = field_column(field, item, first[item.w], x, y, s.cells, s.nx, s.ny, s.z_padded);
  __global float* out = error + (((size_t)i * side + y) * side + x) * s.error_padded;
  // vdvr_trilinear, its two faces kept for all nodes between them.
  const int per_interval = (s.rate << grid.coarse_z) >> b.level_z;
  const int intervals = min(g, grid.cells_z - bz * g) * s.rate / per_interval;
  const float step = inverse_of_power(per_interval);
  int index = min((from_z + from) / per_interval, intervals - 1);
  float low = vdvr_sample_in_plane(samples, b, lx, ly, index);
  for (int k = from; k <= last_z; ++index) {
    const float high = vdvr_sample_in_plane(samples, b, lx, ly, index + 1);
    // A node between two intervals belongs to the second; the brick's last node to its last interval.
    const int begin = index * per_interval - from_z,
              end = min(last_z + 1, begin + per_interval + (index + 1 == intervals ? 1 : 0));
    for (; k < end; ++k) {
      const float e = vdvr_lerp(low, high, (float)(k - begin) * step) - f[k];
      out[k] = fabs(e) <= FLT_MAX ? e : INFINITY;  // NaN must not pass a maximum unseen
    }
    low = high;
  }
}

// --- fourth differences ---

static inline VEC second(__global const float* p, int stride) {
  const VEC c = READ(p);
  return (READ(p - stride) - c) + (READ(p + stride) - c);
}
static inline VEC fourth(__global const float* p, int stride) {
  const VEC c = READ(p), low = READ(p - stride), high = READ(p + stride);
  return ((READ(p - 2 * stride) - low) + (READ(p + 2 * stride) - high)) - 3.0f * ((low - c) + (high - c));
}
static inline VEC mixed(__global const float* p, int a, int b) {
  const VEC c = second(p, a);
  return (second(p - b, a) - c) + (second(p + b, a) - c);
}

// Per tested piece and row of nodes: the largest |fourth difference| xx, yy, zz, xy, xz, yz over the corners
// of its tested cells. float8 out[item][y].
// A work-group does a row.
__kernel SHARED_COLUMN void verify_fourth(__global float8* out, __global const float* field,
                                          __global const uchar* tested, VdvrGrid grid,
                                          __global const int4* items, __global const int4* first,
                                          VdvrPieces s, SHARED_ROOM) {
  const int side = s.cells + 1;
  const int y = (int)get_global_id(1), i = (int)get_global_id(2);
  if (y >= side || i >= s.count) return;
  const int4 item = items[i];
  const int4 begin = first[item.w];
  const int last_x = last_node(item.x, s.cells, grid.cells_x * s.rate),
            last_y = last_node(item.y, s.cells, grid.cells_y * s.rate),
            last_z = last_node(item.z, s.cells, grid.cells_z * s.rate);
  const int mask_x = s.nx - 1 - 2 * RADIUS, mask_y = s.ny - 1 - 2 * RADIUS;
  __global const uchar* mask = tested + ((size_t)item.w * mask_y + (item.y - begin.y) * s.cells) * mask_x +
                               (item.x - begin.x) * s.cells;
  const VEC none = (VEC)(0.0f);
  VEC xx = none, yy = none, zz = none, xy = none, xz = none, yz = none;
  const int row = s.nx * s.z_padded;
  const int runs = last_z / VDVR_LANES + 1, all = y <= last_y ? (last_x + 1) * runs : 0;
  for (int n = OWN_PART; n < all; n += VDVR_ALONG) {
    const int x = n / runs, z = (n - x * runs) * VDVR_LANES;
    bool is_corner = false;
    for (int dy = -1; dy <= 0; ++dy)
      for (int dx = -1; dx <= 0; ++dx)
        if (x + dx >= 0 && x + dx < last_x && y + dy >= 0 && y + dy < last_y)
          is_corner = is_corner || mask[(y + dy) * mask_x + x + dx];
    if (!is_corner) continue;
    __global const float* p = field_column(field, item, begin, x, y, s.cells, s.nx, s.ny, s.z_padded) + z;
    const INT outside = z + INDEX > last_z;
    xx = fmax(xx, select(fabs(fourth(p, s.z_padded)), none, outside));
    yy = fmax(yy, select(fabs(fourth(p, row)), none, outside));
    zz = fmax(zz, select(fabs(fourth(p, 1)), none, outside));
    xy = fmax(xy, select(fabs(mixed(p, s.z_padded, row)), none, outside));
    xz = fmax(xz, select(fabs(mixed(p, s.z_padded, 1)), none, outside));
    yz = fmax(yz, select(fabs(mixed(p, row, 1)), none, outside));
  }
  const float8 own =
      (float8)(LARGEST(xx), LARGEST(yy), LARGEST(zz), LARGEST(xy), LARGEST(xz), LARGEST(yz), 0.0f, 0.0f);
  float8 largest = own;
#define MEET_AT(lane) largest.lane = LARGEST_OF_GROUP(own.lane)
  MEET_AT(s0);
  MEET_AT(s1);
  MEET_AT(s2);
  MEET_AT(s3);
  MEET_AT(s4);
  MEET_AT(s5);
  if (OWN_PART == 0) out[(size_t)i * side + y] = largest;
}

// --- cells ---

// h^2 times the second derivative: the second difference less `correction` twelfths of the fourth.
static inline VEC curvature(__global const float* p, int stride, float correction) {
  const VEC c = READ(p), low = READ(p - stride), high = READ(p + stride);
  const VEC outer = (READ(p - 2 * stride) - low) + (READ(p + 2 * stride) - high),
            inner = (low - c) + (high - c);
  return inner + (3.0f * inner - outer) * (correction * (1.0f / 12.0f));
}
#define FOR_CORNERS(DO) \
  DO(0, 0, 0) DO(1, 0, 0) DO(0, 1, 0) DO(1, 1, 0) DO(0, 0, 1) DO(1, 0, 1) DO(0, 1, 1) DO(1, 1, 1)
#define CORNER(dx, dy, dz)                                                                       \
  {                                                                                              \
    __global const float* p = at + (dy)*row + (dx)*s.z_padded + (dz);                            \
    const VEC cx = curvature(p, s.z_padded, s.correction), cy = curvature(p, row, s.correction), \
              cz = curvature(p, 1, s.correction);                                                \
    px = fmax(px, cx);                                                                           \
    mx = fmin(mx, cx);                                                                           \
    py = fmax(py, cy);                                                                           \
    my = fmin(my, cy);                                                                           \
    pz = fmax(pz, cz);                                                                           \
    mz = fmin(mz, cz);                                                                           \
    const VEC v = READ(p);                                                                       \
    low = fmin(low, v);                                                                          \
    high = fmax(high, v);                                                                        \
    const VEC ec = READ(err + ((dy)*side + (dx)) * s.error_padded + (dz));                       \
    highest = fmax(highest, ec);                                                                 \
    lowest = fmin(lowest, ec);                                                                   \
  }

// What counts where F is in the window, whatever it errs by: elsewhere nothing is promised, and cells reach
// out of it.
#define IN_WINDOW(dx, dy, dz)                                                                 \
  {                                                                                           \
    const VEC v = READ(at + (dy)*row + (dx)*s.z_padded + (dz)),                               \
              ec = fabs(READ(err + ((dy)*side + (dx)) * s.error_padded + (dz)));              \
    const INT is_in = (v - widening[i] >= s.window_low) & (v + widening[i] <= s.window_high); \
    e = fmax(e, select((VEC)(0.0f), ec, is_in));                                              \
  }

// Per column of gold cells of a tested piece: int4 {largest bound of |V - F| less the piece's constant, the
// largest |V - F| at a corner of a cell whose corners are covered, both as float bits; the cell that has the
// former, or -1; 0} and which cells were tested, 16 bits to a word: int4 out[item][y][x], uint
// cells_tested[item][y][x][words]. `widening`: per item what the range of a cell is widened by beside its own
// T, at least what F errs at a node (for the window only). cells_tested begins with zeros. A work-group does
// a column.
__kernel SHARED_COLUMN void verify_cells(__global int4* out, __global uint* cells_tested,
                                         __global const float* error, __global const float* field,
                                         __global const uchar* tested, VdvrGrid grid,
                                         __global const int4* items, __global const int4* first,
                                         __global const float* widening, VdvrPieces s, SHARED_ROOM) {
  const int side = s.cells + 1;
  const int in_piece = (int)get_global_id(1), y = in_piece / s.cells, x = in_piece - y * s.cells,
            i = (int)get_global_id(2);
  if (y >= s.cells || i >= s.count) return;
  const int4 item = items[i];
  const int4 begin = first[item.w];
  const size_t column = ((size_t)i * s.cells + y) * s.cells + x;
  const int mask_x = s.nx - 1 - 2 * RADIUS, mask_y = s.ny - 1 - 2 * RADIUS;
  const uchar flag = tested[((size_t)item.w * mask_y + (item.y - begin.y) * s.cells + y) * mask_x +
                            (item.x - begin.x) * s.cells + x];
  const bool inside = x < last_node(item.x, s.cells, grid.cells_x * s.rate) &&
                      y < last_node(item.y, s.cells, grid.cells_y * s.rate) && flag > 0;
  // Cells of the block's z range [s.z_first, s.z_last] meet the covered heights.
  const int z_begin = (item.z - begin.z) * s.cells,
            end = min(last_node(item.z, s.cells, grid.cells_z * s.rate), s.z_last + 1 - z_begin);
  float best = -1.0f, worst_error = 0.0f;
  int best_z = -1;
  const int row = s.nx * s.z_padded;
  for (int z = OWN_PART * VDVR_LANES; z < s.words * 16; z += VDVR_ALONG * VDVR_LANES) {
    uint bits = 0;
    if (inside && z < end) {
      __global const float* at = field_column(field, item, begin, x, y, s.cells, s.nx, s.ny, s.z_padded) + z;
      __global const float* err = error + (((size_t)i * side + y) * side + x) * s.error_padded + z;
      VEC px = (VEC)(0.0f), py = px, pz = px, mx = px, my = px, mz = px;
      VEC low = (VEC)(INFINITY), high = -low, lowest = low, highest = high;
      FOR_CORNERS(CORNER)
      // Where F is convex its interpolant lies above it, where it is concave below.
      const VEC over = 0.125f * (px + py + pz), under = -0.125f * (mx + my + mz);
      const INT k = z + INDEX;
      INT counts = (k < end) & (k + z_begin >= s.z_first);
      if (s.windowed) {
        counts &=
            NOT((low - over - widening[i] > s.window_high) | (high + under + widening[i] < s.window_low));
      }
      VEC total = fmax(highest + over, under - lowest), e = fmax(highest, -lowest);
      total = select((VEC)(INFINITY), total, total <= FLT_MAX);
      total = select((VEC)(-1.0f), total, counts);
      // A node that is not covered is promised nothing.
      const INT covered = counts & (k + z_begin >= s.in_first) & (k + z_begin <= s.in_last);
      if (s.windowed) {
        e = (VEC)(0.0f);
        FOR_CORNERS(IN_WINDOW)
      }
      if (flag == 2) worst_error = fmax(worst_error, LARGEST(select((VEC)(0.0f), e, covered)));
      const float largest = LARGEST(total);
#define MARK(lane) bits |= LANE(counts, lane) ? 1u << 0x##lane : 0u;
      FOR_LANES(MARK)
      if (largest > best) {
        best = largest;
        best_z = -1;
#define FIND(lane) best_z = best_z < 0 && LANE(total, lane) == largest ? z + 0x##lane : best_z;
        FOR_LANES(FIND)
      }
    }
    volatile __global uint* word = cells_tested + column * s.words + z / 16;
#if VDVR_LANES == 16
    *word = bits;
#else
    if (bits) atomic_or(word, bits << z % 16);
#endif
  }
  const float best_of_all = LARGEST_OF_GROUP(best), worst_of_all = LARGEST_OF_GROUP(worst_error);
  // Of equals the lowest.
  const int place = LEAST_OF_GROUP(best_z >= 0 && best == best_of_all ? best_z : INT_MAX);
  if (OWN_PART == 0)
    out[column] = (int4)(as_int(best_of_all), as_int(worst_of_all), place == INT_MAX ? -1 : place, 0);
}
