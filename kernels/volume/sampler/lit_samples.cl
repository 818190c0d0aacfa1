// Lit samples: every stored sample as float32, and behind all of them the field's gradients there, a word
// each (shared/lit_gradient.h): apart, since most samples that a ray takes are not lit. Beside each word
// stands the next one of its tile along y, so that one load has four corners of a cell. The gradient of a
// point is that of the brick that the point belongs to, whatever tile stores it: central differences over one
// base cell, as gradient_at has it.
//
// Between bricks of different levels the finer one has samples on the shared face that the coarser one lacks.
// close_gradients interpolates the gradients there from those that both have, edges before faces, so that
// light has no seam. Layouts: lit[value, gradient][base, then tiles by triple][z][y][x][this one, next along
// y; in the last row itself]. Called by: LitSamples in host/volume/sampler/lit_samples.cpp.
#ifndef VDVR_GRANULARITY
#error "VDVR_GRANULARITY (cells per brick and axis) must be defined"
#endif
#define VDVR_SAMPLER_BUFFER 1
#define VDVR_GRADIENT_ANALYTIC 0
#ifndef VDVR_UNIFORM
#define VDVR_UNIFORM 0
#endif
#include "device/raycast_settings.h"
#include "shared/mixed_sampler.h"
#include "device/packet.h"
#include "device/packet_sampler.h"
#include "shared/lit_params.h"

RAY_INLINE uint word_of(int x, int y, int z) {
  return (uint)(x & 1023) | (uint)(y & 1023) << 10 | (uint)(z & 1023) << 20;
}

// Word number i, of row y of its tile, at its own place and beside the one before it along y.
RAY_INLINE void put_word(__global uint* words, ulong i, int y, int size_x, int size_y, uint word) {
  words[2 * i] = word;
  if (y > 0) words[2 * (i - (ulong)size_x) + 1] = word;
  if (y == size_y - 1) words[2 * i + 1] = word;
}

// A gradient too long for its word keeps its direction: only that counts where a gradient is strong.
RAY_INLINE U stored_gradient(V3 g, float per_gradient) {
  const V x = g.x * per_gradient, y = g.y * per_gradient, z = g.z * per_gradient;
  const V xy = MOST(fabs(x), fabs(y)), xyz = MOST(xy, fabs(z)), most = MOST(xyz, (V)((float)LIT_LARGEST));
  const V fit = (float)LIT_LARGEST / most;
  const I a = TO_I(rint(x * fit)) & 1023, b = TO_I(rint(y * fit)) & 1023, c = TO_I(rint(z * fit)) & 1023;
  return AS_U(a | b << 10 | c << 20);
}

// --- samples of the base around which all is base: rows in the place of cells ---

// Samples of the base from number i on, as the sampler decodes them.
#if VDVR_LANES == 1
#define ROW_AT(TYPE, i) TO_V(((__global const TYPE*)field)[i])
#else
#define ROW_AT(TYPE, i) TO_V(PACKET(vload)(0, (__global const TYPE*)field + (i)))
#endif
RAY_INLINE V base_row(FIELD, const VdvrLitBlock* b, ulong i) {
  if (b->base_type == VDVR_F32) return ROW_AT(float, i);
  return (b->base_type == VDVR_U16 ? ROW_AT(ushort, i) : ROW_AT(uchar, i)) * b->base_scale + b->base_bias;
}

// As gradient_at has it along one axis at a sample: fractions are 0 or 1 there, and the lerps with them give
// their ends to the bit. `half_cell` is of a spacing; `width` what the difference spans, in cells.
RAY_INLINE V central(V before, V here, V after, float half_cell, float width) {
  const V lo = half_cell * before + (1.0f - half_cell) * here;
  const V hi = (1.0f - half_cell) * here + half_cell * after;
  return (hi - lo) / width;
}
RAY_INLINE float width_at(float c, int cells) {
  return min(c + GRADIENT_REACH, (float)cells) - max(c - GRADIENT_REACH, 0.0f);
}

// Whether the samples at c, which stand in the base from number `first` of their row on, are in the base as
// those beside them are, and these in the row.
RAY_INLINE int is_plain(BRICKS, VdvrGrid grid, const VdvrLitBlock* block, int first, V3 c) {
  if (block->tiles || first < 1 || first + VDVR_LANES >= block->size_x) return 0;
#if VDVR_UNIFORM
  return 1;
#else
  __global const int* bits = (__global const int*)bricks + 1;
  const I b = GATHER(I, bits, brick_index(grid, brick_at(grid, c)) * (Offset)(VDVR_BRICK_WORDS));
  return !ANY((b & 512) == 0);
#endif
}

// Their values and gradients.
RAY_INLINE V plain_samples(FIELD, VdvrGrid grid, const VdvrLitBlock* b, int first, int y, int z,
                           float3 cells_per_length, V3* gradient) {
  const ulong across = (ulong)b->size_x, plane = across * (ulong)b->size_y;
  const ulong at = (ulong)z * plane + (ulong)y * across + (ulong)first;
  const ulong back = y > 0 ? at - across : at, ahead = y < b->size_y - 1 ? at + across : at;
  const ulong below = z > 0 ? at - plane : at, above = z < b->size_z - 1 ? at + plane : at;
  const V here = base_row(field, b, at);
  const float half_x = GRADIENT_REACH / (float)(1 << VDVR_COARSE_X),
              half_y = GRADIENT_REACH / (float)(1 << VDVR_COARSE_Y),
              half_z = GRADIENT_REACH / (float)(1 << VDVR_COARSE_Z);
  const V dx = central(base_row(field, b, at - 1), here, base_row(field, b, at + 1), half_x, 1.0f);
  const V dy = central(base_row(field, b, back), here, base_row(field, b, ahead), half_y,
                       width_at((float)(y << VDVR_COARSE_Y), grid.cells_y));
  const V dz = central(base_row(field, b, below), here, base_row(field, b, above), half_z,
                       width_at((float)(z << VDVR_COARSE_Z), grid.cells_z));
  *gradient = v3(dx * cells_per_length.x, dy * cells_per_length.y, dz * cells_per_length.z);
  return here;
}

// Samples VDVR_LANES at a time along x: global id (x / lanes, z * size_y + y, tile).
__kernel PACKET_HINT void light_samples(FIELD, BRICKS, VdvrGrid grid,
                                        __global const uint* restrict tile_bricks, VdvrLitBlock block,
                                        __global uint* restrict lit) {
  const int first = (int)get_global_id(0) * VDVR_LANES, row = (int)get_global_id(1);
  const int tile = (int)get_global_id(2), z = row / block.size_y, y = row - z * block.size_y;
  if (first >= block.size_x || z >= block.size_z || tile >= max(block.tiles, 1)) return;
  I x;
#define NUMBER(n) LANE(x, n) = min(first + 0x##n, block.size_x - 1);
  EACH(NUMBER)
#undef NUMBER
  I3 own = {(I)(0), (I)(0), (I)(0)};
  if (block.tiles) {
    const int brick = (int)tile_bricks[tile], layer = brick / grid.bricks_x;
    own.x = (I)(brick - layer * grid.bricks_x);
    own.y = (I)(layer % grid.bricks_y);
    own.z = (I)(layer / grid.bricks_y);
  }
  // Tiles go on beyond the grid, where nothing reads them.
  const V3 c = clamp_to_grid(
      v3(TO_V(own.x * VDVR_GRANULARITY) + TO_V(x) / vdvr_per_cell(block.level_x, VDVR_COARSE_X),
         TO_V(own.y * VDVR_GRANULARITY) + (float)y / vdvr_per_cell(block.level_y, VDVR_COARSE_Y),
         TO_V(own.z * VDVR_GRANULARITY) + (float)z / vdvr_per_cell(block.level_z, VDVR_COARSE_Z)),
      grid);
  const float3 cells_per_length =
      (float3)(block.cells_per_length_x, block.cells_per_length_y, block.cells_per_length_z);
  V3 gradient;
  V value;
  if (is_plain(bricks, grid, &block, first, c)) {
    value = plain_samples(field, grid, &block, first, y, z, cells_per_length, &gradient);
  } else {
    const OpenBrick around = open_brick(bricks, grid, brick_at(grid, c));
    const Sampled there = sample_open(field, &around, grid, c);
    gradient = gradient_at(field, bricks, grid, &around, &there, c, cells_per_length, NOT((I)(0)));
#if VDVR_UNIFORM
    value = there.value;
#else
    // The sample as its own tile has it.
    const OpenBrick stored = block.tiles
                                 ? open_brick(bricks, grid, own)
                                 : open_base(grid, block.base_type, block.base_scale, block.base_bias);
    value = sample_open(field, &stored, grid, c).value;
#endif
  }
  const U words = stored_gradient(gradient, block.per_gradient);
  const ulong place =
      block.first +
      (((ulong)tile * (ulong)block.size_z + (ulong)z) * (ulong)block.size_y + (ulong)y) * (ulong)block.size_x;
#define PUT(n)                                                                                  \
  if (first + 0x##n < block.size_x) {                                                           \
    const ulong i = place + (ulong)(first + 0x##n);                                             \
    put_word(lit, i, y, block.size_x, block.size_y, as_uint(LANE(value, n)));                   \
    put_word(lit + 2 * (ulong)block.samples, i, y, block.size_x, block.size_y, LANE(words, n)); \
  }
  EACH(PUT)
#undef PUT
}

// --- closing: one tile a work-item ---

typedef struct {
  __global uint* gradients;
  int level[3], last[3], stride[3];  // x, y, z; index of the last sample
  int brick[3];
} LitTile;

RAY_INLINE float3 gradient_in(const LitTile* t, int at) {
  const int w = (int)t->gradients[2 * at];
  return (float3)((float)LIT_X(w), (float)LIT_Y(w), (float)LIT_Z(w)) * 0x1p-22f;
}
RAY_INLINE void put_gradient(const LitTile* t, int at, float3 g) {
  const int rows = t->last[1] + 1;
  put_word(t->gradients, (ulong)at, at / t->stride[1] % rows, t->stride[1], rows,
           word_of((int)rint(g.x), (int)rint(g.y), (int)rint(g.z)));
}
RAY_INLINE float3 between3(float3 a, float3 b, float t) { return (1.0f - t) * a + t * b; }

// The lowest level along `axis` of the bricks around an entity: the tile's own and those beside it by
// `away` along two axes (0 where the entity does not lie on that side's face).
RAY_INLINE int lowest_level(BRICKS, VdvrGrid grid, const LitTile* t, int axis, int u, int away_u, int v,
                            int away_v) {
  const int count[3] = {grid.bricks_x, grid.bricks_y, grid.bricks_z};
  int lowest = t->level[axis];
  for (int k = 1; k < 4; ++k) {
    int at[3] = {t->brick[0], t->brick[1], t->brick[2]};
    if (k & 1) at[u] += away_u;
    if (k & 2) at[v] += away_v;
    if (at[u] < 0 || at[u] >= count[u] || at[v] < 0 || at[v] >= count[v]) continue;
    const ulong n = ((ulong)at[2] * (ulong)count[1] + (ulong)at[1]) * (ulong)count[0] + (ulong)at[0];
    const int bits = (int)bricks[n * VDVR_BRICK_WORDS + 1];
    lowest = min(lowest, bits >> (3 * axis) & 7);
  }
  return lowest;
}

// The four edges along `axis`.
RAY_INLINE void close_edges(BRICKS, VdvrGrid grid, const LitTile* t, int axis) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3, w = t->stride[axis];
  for (int corner = 0; corner < 4; ++corner) {
    const int far_u = corner & 1, far_v = corner >> 1;
    const int m = lowest_level(bricks, grid, t, axis, u, far_u ? 1 : -1, v, far_v ? 1 : -1);
    const int run = 1 << (t->level[axis] - m), last = t->last[axis];
    const int edge = far_u * t->last[u] * t->stride[u] + far_v * t->last[v] * t->stride[v];
    for (int i = 0; i < last; i += run) {
      const float3 a = gradient_in(t, edge + i * w), b = gradient_in(t, edge + (i + run) * w);
      for (int k = 1; k < run; ++k)
        put_gradient(t, edge + (i + k) * w, between3(a, b, (float)k / (float)run));
    }
  }
}

// The two faces across `axis`, without their edges.
RAY_INLINE void close_faces(BRICKS, VdvrGrid grid, const LitTile* t, int axis) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3, wu = t->stride[u], wv = t->stride[v];
  const int last_u = t->last[u], last_v = t->last[v];
  for (int far = 0; far < 2; ++far) {
    const int away = far ? 1 : -1;
    const int run_u = 1 << (t->level[u] - lowest_level(bricks, grid, t, u, axis, away, v, 0));
    const int run_v = 1 << (t->level[v] - lowest_level(bricks, grid, t, v, axis, away, u, 0));
    if (run_u == 1 && run_v == 1) continue;
    const int face = far * t->last[axis] * t->stride[axis];
    for (int j = 1; j < last_v; ++j)
      for (int i = 1; i < last_u; ++i) {
        const int di = i % run_u, dj = j % run_v;
        if (di == 0 && dj == 0) continue;
        // Samples that both bricks have; where a fraction is 0 the second is the first.
        const int at = face + (i - di) * wu + (j - dj) * wv;
        const int next_u = di ? run_u * wu : 0, next_v = dj ? run_v * wv : 0;
        const float fu = (float)di / (float)run_u, fv = (float)dj / (float)run_v;
        put_gradient(
            t, face + i * wu + j * wv,
            between3(between3(gradient_in(t, at), gradient_in(t, at + next_u), fu),
                     between3(gradient_in(t, at + next_v), gradient_in(t, at + next_u + next_v), fu), fv));
      }
  }
}

__kernel void close_gradients(BRICKS, VdvrGrid grid, __global const uint* restrict tile_bricks,
                              VdvrLitBlock block, __global uint* restrict lit) {
  const int tile = (int)get_global_id(0);
  if (tile >= block.tiles) return;
  const int brick = (int)tile_bricks[tile], layer = brick / grid.bricks_x, size = block.size_x * block.size_y;
  const LitTile t = {
      lit + 2 * ((ulong)block.samples + block.first + (ulong)tile * (ulong)(size * block.size_z)),
      {block.level_x, block.level_y, block.level_z},
      {block.size_x - 1, block.size_y - 1, block.size_z - 1},
      {1, block.size_x, size},
      {brick - layer * grid.bricks_x, layer % grid.bricks_y, layer / grid.bricks_y}};
  for (int axis = 0; axis < 3; ++axis) close_edges(bricks, grid, &t, axis);
  for (int axis = 0; axis < 3; ++axis) close_faces(bricks, grid, &t, axis);
}
