// The field of mixed_sampler.h (VDVR_SAMPLER_BUFFER) or mixed_image.h (VDVR_SAMPLER_IMAGE3D) at the points of
// a packet, and its gradient. Lane by lane the bits of sample_at, to which
// tests/device/one_sampler_test.cpp holds it: the same operations on the same operands; what is shared
// between lanes is only which brick records are open. Included by raycast.cl.
//
// In packets of several lanes offsets are 32-bit: the launcher takes them only where every offset fits.
//
// VDVR_LIT: the buffer holds lit samples (host/volume/sampler/lit_samples.hpp), float32, each beside the next
// one along y, and behind them all the gradients there, so that light costs no further samples.
#ifndef VDVR_PACKET_SAMPLER_H
#define VDVR_PACKET_SAMPLER_H
#ifndef VDVR_LIT
#define VDVR_LIT 0
#endif
// As VdvrGrid has them.
#ifndef VDVR_COARSE_X
#define VDVR_COARSE_X 0
#define VDVR_COARSE_Y 0
#define VDVR_COARSE_Z 0
#endif
#if VDVR_LIT && (defined(VDVR_SAMPLER_IMAGE3D) || VDVR_SAMPLE_TYPES != 1)
#error "lit samples are float32 in a buffer"
#endif

// 1: where all lanes' bricks read the base, none of their records is read.
#ifndef VDVR_BASE_FIRST
#define VDVR_BASE_FIRST 0
#endif
#if VDVR_BASE_FIRST && !VDVR_LIT
#error "only lit samples have a base that can be read without its record"
#endif

#include "shared/lit_gradient.h"

// One image per sample type; the launcher binds any to those that do not occur. THE_FIELD hands it on.
#ifdef VDVR_SAMPLER_IMAGE3D
#define FIELD __read_only image3d_t field_f32, __read_only image3d_t field_u16, __read_only image3d_t field_u8
#define THE_FIELD field_f32, field_u16, field_u8
#if VDVR_LANES != 1
#error "the texture unit takes one ray at a time: VDVR_LANES must be 1"
#endif
#else
#define FIELD __global const uchar* restrict field
#define THE_FIELD field
#endif
#define BRICKS __global const uint* restrict bricks

#define GRADIENT_REACH 0.5f

// The bricks that the lanes are in; a cell coordinate c belongs to one iff low <= c < high.
typedef struct {
  I3 at;
  V3 low, high;
#ifdef VDVR_SAMPLER_IMAGE3D
  VdvrBrick record;
#elif !VDVR_UNIFORM
  V3 scale;  // samples per cell
  I3 reach;  // samples per half a cell, 0 where a cell has no more than one
  I3 top;    // index of the last cell of samples
  // What a brick's addresses reach: its own samples, or where the bricks around read the base too, all of the
  // base. Indices count from the brick's first sample.
  I3 first, last;
  I base_around, type;
  Offset place, stride_y, stride_z;
  V value_scale, bias;
  int apart;  // samples from a plane to the next one, where that is the same in all lanes; else 0
#endif
} OpenBrick;

#include "device/packet_bricks.h"

#if !VDVR_UNIFORM && defined(VDVR_SAMPLER_BUFFER)
// The reach of one axis of a brick that starts at cell `low`.
RAY_INLINE void open_axis(OpenBrick* b, I level, I low, int cells, int coarse, V* scale, I* reach, I* top,
                          I* first, I* last) {
  const I width = LEAST(cells - low, (I)(VDVR_GRANULARITY));
  *scale = TO_V((I)(1) << level) * (1.0f / (float)(1 << coarse));
  *reach = ((I)(1) << level) >> (1 + coarse);
  *top = ((width << level) >> coarse) - 1;
  *first = PICK(b->base_around, -(low >> coarse), (I)(0));
  *last = PICK(b->base_around, (cells - low) >> coarse, *top + 1);
}
#endif

RAY_INLINE OpenBrick open_brick(BRICKS, VdvrGrid grid, I3 at) {
  OpenBrick b = boxed_brick(grid, at);
#ifdef VDVR_SAMPLER_IMAGE3D
  b.record = vdvr_brick(bricks, grid, brick_index(grid, at));
#elif !VDVR_UNIFORM
  const I3 low = {at.x * VDVR_GRANULARITY, at.y * VDVR_GRANULARITY, at.z * VDVR_GRANULARITY};
  // vdvr_record, lane by lane.
  const Offset word = brick_index(grid, at) * VDVR_BRICK_WORDS;
  __global const int* words = (__global const int*)bricks;
  const I bits = GATHER(I, words + 1, word);
  const I lx = bits & 7, ly = bits >> 3 & 7, lz = bits >> 6 & 7;
  const I in_base = (bits & 511) == 0;
#if VDVR_LANES == 1
  b.place = (ulong)(VDVR_RECORDS == VDVR_RECORDS_COMPACT ? 0u : (uint)bits >> 17) << 32 | bricks[word];
#else
  b.place = GATHER(I, words, word);
#endif
  b.stride_y =
      TO_OFFSET((PICK(in_base, (I)(grid.cells_x), (I)(VDVR_GRANULARITY) << lx) >> VDVR_COARSE_X) + 1);
  b.stride_z =
      b.stride_y *
      TO_OFFSET((PICK(in_base, (I)(grid.cells_y), (I)(VDVR_GRANULARITY) << ly) >> VDVR_COARSE_Y) + 1);
#if VDVR_LANES == 1
  b.apart = 0;
#else
  b.apart = ANY(b.stride_z != LANE(b.stride_z, 0)) ? 0 : LANE(b.stride_z, 0);
#endif
  b.base_around = (bits & 512) != 0;
  open_axis(&b, lx, low.x, grid.cells_x, VDVR_COARSE_X, &b.scale.x, &b.reach.x, &b.top.x, &b.first.x,
            &b.last.x);
  open_axis(&b, ly, low.y, grid.cells_y, VDVR_COARSE_Y, &b.scale.y, &b.reach.y, &b.top.y, &b.first.y,
            &b.last.y);
  open_axis(&b, lz, low.z, grid.cells_z, VDVR_COARSE_Z, &b.scale.z, &b.reach.z, &b.top.z, &b.first.z,
            &b.last.z);
  b.type = bits >> 10 & 3;
  const I shift = bits >> 12 & 31;
#if VDVR_RECORDS == VDVR_RECORDS_COMPACT
  const I offset = (bits >> 17) << shift;
#elif VDVR_RECORDS == VDVR_RECORDS_WIDE
  const I offset = GATHER(I, words + 2, word);
#else
  const I offset = (I)(0);
#endif
  b.value_scale = grid.step * TO_V((I)(1) << shift);
  b.bias = grid.step * TO_V(offset);
#endif
  return b;
}

#if !VDVR_UNIFORM && defined(VDVR_SAMPLER_BUFFER)
// All of the base as one brick.
RAY_INLINE OpenBrick open_base(VdvrGrid grid, int type, float scale, float bias) {
  const I none = (I)(0);
  const V zero = (V)(0.0f);
  const int nx = grid.cells_x >> VDVR_COARSE_X, ny = grid.cells_y >> VDVR_COARSE_Y,
            nz = grid.cells_z >> VDVR_COARSE_Z;
  OpenBrick b = no_brick();
  b.low = v3(zero, zero, zero);
  b.scale = v3((V)(1.0f / (float)(1 << VDVR_COARSE_X)), (V)(1.0f / (float)(1 << VDVR_COARSE_Y)),
               (V)(1.0f / (float)(1 << VDVR_COARSE_Z)));
  b.reach.x = b.reach.y = b.reach.z = none;
  b.top.x = (I)(nx - 1);
  b.top.y = (I)(ny - 1);
  b.top.z = (I)(nz - 1);
  b.place = (Offset)(0);
  b.stride_y = (Offset)(nx + 1);
  b.stride_z = b.stride_y * (Offset)(ny + 1);
  b.type = (I)(type);
  b.value_scale = (V)(scale);
  b.bias = (V)(bias);
  b.apart = VDVR_LANES > 1 ? (nx + 1) * (ny + 1) : 0;
  return b;
}
#endif

#if VDVR_BASE_FIRST && !VDVR_UNIFORM
// As open_brick, but that bricks which read the base have all of it, so that a lane may go on into the next.
RAY_INLINE OpenBrick open_whole_base(BRICKS, VdvrGrid grid, I3 at) {
  OpenBrick b = open_brick(bricks, grid, at);
  const OpenBrick base = open_base(grid, VDVR_F32, 0.0f, 0.0f);
  const I tiled = (b.scale.x != base.scale.x) | (b.scale.y != base.scale.y) | (b.scale.z != base.scale.z);
  b.low = v3(PICK(tiled, b.low.x, base.low.x), PICK(tiled, b.low.y, base.low.y),
             PICK(tiled, b.low.z, base.low.z));
  b.place = PICK(tiled, b.place, base.place);
  b.top.x = PICK(tiled, b.top.x, base.top.x);
  b.top.y = PICK(tiled, b.top.y, base.top.y);
  b.top.z = PICK(tiled, b.top.z, base.top.z);
  return b;
}
#endif

// --- buffer: cells and their corners ---
#ifdef VDVR_SAMPLER_BUFFER

// The number of a sample in each lane: `lane` + `all`. What is the same in all lanes is kept apart because it
// costs nothing in an address.
typedef struct {
  Offset lane;
  int all;
} Place;
RAY_INLINE Place place(Offset lane, int all) {
  const Place p = {lane, all};
  return p;
}
RAY_INLINE Place after(Place p, Place stride) {
  p.lane += stride.lane;
  p.all += stride.all;
  return p;
}

// Where points lie in cells of samples: the cell's lowest sample, and the fractions above it.
typedef struct {
  I3 index;  // of the lowest sample, from the brick's first
  V3 fraction;
  Place lowest, x, y, z;  // the lowest sample; strides
  I type;
  V value_scale, bias;
} Cell;

// As vdvr_local.
RAY_INLINE I local_of(V c, V first, V scale, I top, V* fraction) {
  const V r = (c - first) * scale;
  I i = TO_I(r);
  i = i > top ? top : i;
  i = i < 0 ? (I)0 : i;
  *fraction = r - TO_V(i);
  return i;
}

#if VDVR_SAMPLE_TYPES != 1 && VDVR_SAMPLE_TYPES != 2 && VDVR_SAMPLE_TYPES != 4
RAY_INLINE float stored(FIELD, int type, ulong i) {
  if (type == VDVR_F32) return ((__global const float*)field)[i];
  return type == VDVR_U16 ? (float)((__global const ushort*)field)[i] : (float)field[i];
}
#endif

#if VDVR_SAMPLE_TYPES == 1
#define VDVR_ONE_TYPE float
#define VDVR_ONE_VECTOR V
#elif VDVR_SAMPLE_TYPES == 2
#define VDVR_ONE_TYPE ushort
#define VDVR_ONE_VECTOR U16
#elif VDVR_SAMPLE_TYPES == 4
#define VDVR_ONE_TYPE uchar
#define VDVR_ONE_VECTOR U8
#endif

// As in mixed_sampler.h.
RAY_INLINE V decoded(const Cell* c, V v) {
#if VDVR_SAMPLE_TYPES == 1
  return v;
#elif VDVR_SAMPLE_TYPES == 2 || VDVR_SAMPLE_TYPES == 4
  return v * c->value_scale + c->bias;
#else
  return PICK(c->type == VDVR_F32, v, v * c->value_scale + c->bias);
#endif
}

RAY_INLINE V load(FIELD, const Cell* c, Place p) {
#ifdef VDVR_ONE_TYPE
  __global const VDVR_ONE_TYPE* s = (__global const VDVR_ONE_TYPE*)field + p.all;
  return decoded(c, TO_V(GATHER(VDVR_ONE_VECTOR, s, p.lane)));
#else
  V v;
  const Offset i = p.lane + (Offset)(p.all);
#define STORED(n) LANE(v, n) = stored(field, LANE(c->type, n), LANE(i, n));
  EACH(STORED)
#undef STORED
  return decoded(c, v);
#endif
}

// A sample and its neighbour along x, which lies behind it: one load.
typedef struct {
  V at, next;
} Pair;
#if VDVR_SAMPLE_TYPES == 1
#define FLOAT_PAIR(n) TWO_FLOATS(s + TO_ULONG(LANE(p.lane, n)))
RAY_INLINE Pair float_pair(__global const float* s, Place p) {
  s += p.all;
  const V2 t = PAIRS(FLOAT_PAIR);
  const Pair v = {t.first, t.second};
  return v;
}
#endif
RAY_INLINE Pair load_pair(FIELD, const Cell* c, Place p) {
#if VDVR_SAMPLE_TYPES == 1
  return float_pair((__global const float*)field, p);
#elif defined(VDVR_ONE_TYPE)
  Pair v;
  __global const VDVR_ONE_TYPE* s = (__global const VDVR_ONE_TYPE*)field + p.all;
  VDVR_ONE_VECTOR at, next;
#define TWO(n)                                             \
  {                                                        \
    __global const VDVR_ONE_TYPE* q = s + LANE(p.lane, n); \
    LANE(at, n) = vload2(0, q).x;                          \
    LANE(next, n) = vload2(0, q).y;                        \
  }
  EACH(TWO)
#undef TWO
  v.at = decoded(c, TO_V(at));
  v.next = decoded(c, TO_V(next));
  return v;
#else
  const Pair v = {load(field, c, p), load(field, c, after(p, c->x))};
  return v;
#endif
}

RAY_INLINE V lerp(V a, V b, V t) { return (1.0f - t) * a + t * b; }

// The cells that points c of these bricks lie in; a point outside its brick is taken to the nearest cell.
RAY_INLINE Cell cell_at(VdvrGrid grid, const OpenBrick* b, V3 c) {
  Cell cell;
#if VDVR_UNIFORM
  // Cells of the base in global coordinates have the bits of the brick's own: c - low is exact in fp32.
  const V one = (V)(1.0f), zero = (V)(0.0f);
  cell.index.x = local_of(c.x, zero, one, (I)(grid.cells_x - 1), &cell.fraction.x);
  cell.index.y = local_of(c.y, zero, one, (I)(grid.cells_y - 1), &cell.fraction.y);
  cell.index.z = local_of(c.z, zero, one, (I)(grid.cells_z - 1), &cell.fraction.z);
  cell.x = place(0, 1);
  cell.y = place(0, grid.cells_x + 1);
  cell.z = place(0, (grid.cells_x + 1) * (grid.cells_y + 1));
  cell.lowest =
      place((cell.index.z * (grid.cells_y + 1) + cell.index.y) * (grid.cells_x + 1) + cell.index.x, 0);
#else
  cell.index.x = local_of(c.x, b->low.x, b->scale.x, b->top.x, &cell.fraction.x);
  cell.index.y = local_of(c.y, b->low.y, b->scale.y, b->top.y, &cell.fraction.y);
  cell.index.z = local_of(c.z, b->low.z, b->scale.z, b->top.z, &cell.fraction.z);
  cell.x = place((Offset)(0), 1);
  cell.y = place(b->stride_y, 0);
  cell.z = place(b->stride_z, 0);
  cell.type = b->type;
  cell.value_scale = b->value_scale;
  cell.bias = b->bias;
  cell.lowest = place(b->place + TO_OFFSET(cell.index.z) * b->stride_z +
                          TO_OFFSET(cell.index.y) * b->stride_y + TO_OFFSET(cell.index.x),
                      0);
#endif
  return cell;
}

#if VDVR_BASE_FIRST
// As local_of from 0 on, of c not below it.
RAY_INLINE I local_from_zero(V c, float scale, int top, V* fraction) {
  const V r = c * scale;
  I i = TO_I(r);
  i = i > top ? (I)(top) : i;
  *fraction = r - TO_V(i);
  return i;
}

// As cell_at, of points whose bricks all read the base: its cells in global coordinates have the bits of the
// brick's own, because c - low and powers of two are exact in fp32. No record is read.
RAY_INLINE Cell base_cell_at(VdvrGrid grid, V3 c) {
  const int nx = grid.cells_x >> VDVR_COARSE_X, ny = grid.cells_y >> VDVR_COARSE_Y,
            nz = grid.cells_z >> VDVR_COARSE_Z;
  Cell cell;
  cell.index.x = local_from_zero(c.x, 1.0f / (float)(1 << VDVR_COARSE_X), nx - 1, &cell.fraction.x);
  cell.index.y = local_from_zero(c.y, 1.0f / (float)(1 << VDVR_COARSE_Y), ny - 1, &cell.fraction.y);
  cell.index.z = local_from_zero(c.z, 1.0f / (float)(1 << VDVR_COARSE_Z), nz - 1, &cell.fraction.z);
  cell.x = place((Offset)(0), 1);
  cell.y = place((Offset)(0), nx + 1);
  cell.z = place((Offset)(0), (nx + 1) * (ny + 1));
  cell.lowest = place((cell.index.z * (ny + 1) + cell.index.y) * (nx + 1) + cell.index.x, 0);
  cell.type = (I)(VDVR_F32);
  cell.value_scale = cell.bias = (V)(0.0f);
  return cell;
}
#endif

#include "device/packet_corners.h"

// As vdvr_sample_in_brick: x first, then y, then z.
RAY_INLINE void interpolate(Sampled* k) {
  const V3 f = k->cell.fraction;
  k->value = lerp(lerp(lerp(k->s000, k->s001, f.x), lerp(k->s010, k->s011, f.x), f.y),
                  lerp(lerp(k->s100, k->s101, f.x), lerp(k->s110, k->s111, f.x), f.y), f.z);
}

RAY_INLINE Sampled sample_open(FIELD, const OpenBrick* b, VdvrGrid grid, V3 c) {
  Sampled k;
  k.cell = cell_at(grid, b, c);
#if VDVR_LIT && !VDVR_UNIFORM
  k.apart = b->apart;
#endif
  load_corners(field, &k);
  interpolate(&k);
  return k;
}

#if VDVR_BASE_FIRST
// The same where all lanes' bricks read the base, if `all_base`; `b` is then not looked at.
RAY_INLINE Sampled sample_base_first(FIELD, const OpenBrick* b, int all_base, VdvrGrid grid, V3 c) {
#if VDVR_UNIFORM
  return sample_open(field, b, grid, c);
#else
  Sampled k;
  if (all_base) {
    k.cell = base_cell_at(grid, c);
    k.apart = k.cell.z.all;
  } else {
    k.cell = cell_at(grid, b, c);
    k.apart = b->apart;
  }
  load_corners(field, &k);
  interpolate(&k);
  return k;
#endif
}
#endif

#else

typedef struct {
  V value;
} Sampled;

RAY_INLINE Sampled sample_open(FIELD, const OpenBrick* b, VdvrGrid grid, V3 c) {
  Sampled k;
  k.value = vdvr_image_sample_in_brick(THE_FIELD, &b->record, grid, b->at.x, b->at.y, b->at.z, c.x, c.y, c.z);
  return k;
}

#endif

// The field anywhere: sample_at, or its image form.
RAY_INLINE Sampled sample_anywhere(FIELD, BRICKS, VdvrGrid grid, V3 c) {
  const OpenBrick b = open_brick(bricks, grid, brick_at(grid, c));
  return sample_open(THE_FIELD, &b, grid, c);
}

#include "device/packet_neighbours.h"

#include "device/packet_gradient.h"

#endif
