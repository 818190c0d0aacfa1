// The field of mixed_sampler.h (VDVR_SAMPLER_BUFFER) or mixed_image.h (VDVR_SAMPLER_IMAGE3D) at the points of
// a packet, and its gradient. Lane by lane the bits of vdvr_sample: the same operations on the same operands;
// what is shared between lanes is only which brick records are open. Included by raycast.cl.
//
// In packets of several lanes offsets are 32-bit: the launcher takes them only where every offset fits.
#ifndef VDVR_PACKET_SAMPLER_H
#define VDVR_PACKET_SAMPLER_H

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

// Central differences reach half a base cell to each side, at every level: one gradient operator for the
// whole volume, so that shading has no seam where levels meet.
#define GRADIENT_REACH 0.5f

// The bricks that the lanes are in; a cell coordinate c belongs to one iff low <= c < high.
typedef struct {
  I3 at;
  V3 low, high;
#if VDVR_LANES == 1
  VdvrBrick record;
#elif !VDVR_UNIFORM
  V3 scale;  // samples per cell
  I3 top;    // index of the last cell
  I place, stride_y, stride_z;
  I base_around, type;
  V value_scale, bias;
#endif
} OpenBrick;

RAY_INLINE V3 v3(V x, V y, V z) {
  const V3 v = {x, y, z};
  return v;
}

RAY_INLINE V clamp_to(V c, int cells) {
  c = LEAST(c, (V)(float)cells);
  return MOST(c, (V)(0.0f));
}
RAY_INLINE V3 clamp_to_grid(V3 c, VdvrGrid grid) {
  return v3(clamp_to(c.x, grid.cells_x), clamp_to(c.y, grid.cells_y), clamp_to(c.z, grid.cells_z));
}

// As vdvr_brick_of.
RAY_INLINE I brick_of(V c, int bricks) {
  I b = TO_I(c) / VDVR_GRANULARITY;
  b = b > bricks - 1 ? (I)(bricks - 1) : b;
  return b < 0 ? (I)0 : b;
}
RAY_INLINE I3 brick_at(VdvrGrid grid, V3 c) {
  const I3 b = {brick_of(c.x, grid.bricks_x), brick_of(c.y, grid.bricks_y), brick_of(c.z, grid.bricks_z)};
  return b;
}
#if VDVR_LANES == 1
typedef ulong Offset;
#define TO_OFFSET(i) ((ulong)(i))
RAY_INLINE Offset brick_index(VdvrGrid grid, I3 b) {
  return ((ulong)b.z * (ulong)grid.bricks_y + (ulong)b.y) * (ulong)grid.bricks_x + (ulong)b.x;
}
#else
typedef I Offset;
#define TO_OFFSET(i) (i)
RAY_INLINE Offset brick_index(VdvrGrid grid, I3 b) {
  return (b.z * grid.bricks_y + b.y) * grid.bricks_x + b.x;
}
#endif

// The last brick of an axis is closed, and wider than the grid where the cells do not divide by the
// granularity.
RAY_INLINE V high_of(I b, V low, int bricks) {
  return PICK(b == bricks - 1, (V)(INFINITY), low + (float)VDVR_GRANULARITY);
}

RAY_INLINE OpenBrick no_brick(void) {
  OpenBrick b;
  b.low = v3((V)(INFINITY), (V)(INFINITY), (V)(INFINITY));
  return b;
}

RAY_INLINE OpenBrick open_brick(BRICKS, VdvrGrid grid, I3 at) {
  OpenBrick b;
  b.at = at;
  b.low = v3(TO_V(at.x * VDVR_GRANULARITY), TO_V(at.y * VDVR_GRANULARITY), TO_V(at.z * VDVR_GRANULARITY));
  b.high = v3(high_of(at.x, b.low.x, grid.bricks_x), high_of(at.y, b.low.y, grid.bricks_y),
              high_of(at.z, b.low.z, grid.bricks_z));
#if VDVR_LANES == 1
  b.record = vdvr_brick(bricks, grid, brick_index(grid, at));
#elif !VDVR_UNIFORM
  // vdvr_unpack, lane by lane.
  const I word = brick_index(grid, at) * VDVR_BRICK_WORDS;
  __global const int* words = (__global const int*)bricks;
  b.place = GATHER(I, words, word);
  const I bits = GATHER(I, words + 1, word);
  const I lx = bits & 7, ly = bits >> 3 & 7, lz = bits >> 6 & 7;
  const I in_base = (bits & 511) == 0;
  b.stride_y = PICK(in_base, (I)(grid.cells_x), (I)(VDVR_GRANULARITY) << lx) + 1;
  b.stride_z = b.stride_y * (PICK(in_base, (I)(grid.cells_y), (I)(VDVR_GRANULARITY) << ly) + 1);
  b.scale = v3(TO_V((I)(1) << lx), TO_V((I)(1) << ly), TO_V((I)(1) << lz));
  b.top.x = (LEAST(grid.cells_x - at.x * VDVR_GRANULARITY, (I)(VDVR_GRANULARITY)) << lx) - 1;
  b.top.y = (LEAST(grid.cells_y - at.y * VDVR_GRANULARITY, (I)(VDVR_GRANULARITY)) << ly) - 1;
  b.top.z = (LEAST(grid.cells_z - at.z * VDVR_GRANULARITY, (I)(VDVR_GRANULARITY)) << lz) - 1;
  b.base_around = (bits & 512) != 0;
  b.type = bits >> 10 & 3;
  if (VDVR_BRICK_WORDS == 3) {
    b.value_scale = grid.step * TO_V((I)(1) << (bits >> 12 & 31));
    b.bias = grid.step * TO_V(GATHER(I, words + VDVR_BRICK_WORDS - 1, word));
  }
#endif
  return b;
}

RAY_INLINE I is_inside(const OpenBrick* b, V3 c) {
  return (c.x >= b->low.x) & (c.x < b->high.x) & (c.y >= b->low.y) & (c.y < b->high.y) & (c.z >= b->low.z) &
         (c.z < b->high.z);
}

// Whether the bricks across the faces read the base, as these do.
#ifdef VDVR_SAMPLER_IMAGE3D
RAY_INLINE I base_around(const OpenBrick* b) { return 0; }
#elif VDVR_LANES == 1
RAY_INLINE I base_around(const OpenBrick* b) { return (int)b->record.base_around; }
#elif VDVR_UNIFORM
RAY_INLINE I base_around(const OpenBrick* b) { return (I)(-1); }
#else
RAY_INLINE I base_around(const OpenBrick* b) { return b->base_around; }
#endif

// --- buffer: cells and their corners
// -----------------------------------------------------------------------------------------------------------
#ifdef VDVR_SAMPLER_BUFFER

// Where points lie in cells of samples: the cell's lowest sample, and the fractions above it.
typedef struct {
  Offset first, stride_y, stride_z;
  V3 fraction;
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

// Samples number i of the buffer, decoded as in mixed_sampler.h.
RAY_INLINE V load(FIELD, const Cell* c, Offset i) {
#if VDVR_SAMPLE_TYPES == 1
  __global const float* s = (__global const float*)field;
  return GATHER(V, s, i);
#elif VDVR_SAMPLE_TYPES == 2
  __global const ushort* s = (__global const ushort*)field;
  return TO_V(GATHER(U16, s, i)) * c->value_scale + c->bias;
#elif VDVR_SAMPLE_TYPES == 4
  return TO_V(GATHER(U8, field, i)) * c->value_scale + c->bias;
#else
  V v;
#define STORED(n) LANE(v, n) = stored(field, LANE(c->type, n), LANE(i, n));
  EACH(STORED)
#undef STORED
  return PICK(c->type == VDVR_F32, v, v * c->value_scale + c->bias);
#endif
}

RAY_INLINE V lerp(V a, V b, V t) { return (1.0f - t) * a + t * b; }

// The cells that points c of these bricks lie in; a point outside its brick is taken to the nearest cell.
RAY_INLINE Cell cell_at(VdvrGrid grid, const OpenBrick* b, V3 c) {
  Cell cell;
#if VDVR_LANES == 1
  const VdvrBrick* r = &b->record;
  const VdvrLocal x = vdvr_local(c.x, b->at.x, r->level_x, VDVR_GRANULARITY, grid.cells_x);
  const VdvrLocal y = vdvr_local(c.y, b->at.y, r->level_y, VDVR_GRANULARITY, grid.cells_y);
  const VdvrLocal z = vdvr_local(c.z, b->at.z, r->level_z, VDVR_GRANULARITY, grid.cells_z);
  cell.fraction = v3(x.fraction, y.fraction, z.fraction);
  cell.stride_y = r->stride_y;
  cell.stride_z = r->stride_z;
  cell.type = (int)r->type;
  cell.value_scale = r->scale;
  cell.bias = r->bias;
  cell.first = r->place + (ulong)z.index * r->stride_z + (ulong)y.index * r->stride_y + (ulong)x.index;
#elif VDVR_UNIFORM
  // Cells of the base in global coordinates have the bits of the brick's own: c - low is exact in fp32.
  const V one = (V)(1.0f), zero = (V)(0.0f);
  const I ix = local_of(c.x, zero, one, (I)(grid.cells_x - 1), &cell.fraction.x);
  const I iy = local_of(c.y, zero, one, (I)(grid.cells_y - 1), &cell.fraction.y);
  const I iz = local_of(c.z, zero, one, (I)(grid.cells_z - 1), &cell.fraction.z);
  cell.stride_y = (I)(grid.cells_x + 1);
  cell.stride_z = (I)((grid.cells_x + 1) * (grid.cells_y + 1));
  cell.first = (iz * (grid.cells_y + 1) + iy) * (grid.cells_x + 1) + ix;
#else
  const I ix = local_of(c.x, b->low.x, b->scale.x, b->top.x, &cell.fraction.x);
  const I iy = local_of(c.y, b->low.y, b->scale.y, b->top.y, &cell.fraction.y);
  const I iz = local_of(c.z, b->low.z, b->scale.z, b->top.z, &cell.fraction.z);
  cell.stride_y = b->stride_y;
  cell.stride_z = b->stride_z;
  cell.type = b->type;
  cell.value_scale = b->value_scale;
  cell.bias = b->bias;
  cell.first = b->place + iz * b->stride_z + iy * b->stride_y + ix;
#endif
  return cell;
}

// Corners s<z><y><x> of cells.
typedef struct {
  V s000, s001, s010, s011, s100, s101, s110, s111;
} Corners;

RAY_INLINE Corners corners_of(FIELD, const Cell* c) {
  const Offset i = c->first, y = i + c->stride_y, z = i + c->stride_z, yz = z + c->stride_y;
  Corners k;
  k.s000 = load(field, c, i);
  k.s001 = load(field, c, i + 1);
  k.s010 = load(field, c, y);
  k.s011 = load(field, c, y + 1);
  k.s100 = load(field, c, z);
  k.s101 = load(field, c, z + 1);
  k.s110 = load(field, c, yz);
  k.s111 = load(field, c, yz + 1);
  return k;
}

// As vdvr_trilinear: x first, then y, then z.
RAY_INLINE V trilinear(const Corners* k, V3 f) {
  return lerp(lerp(lerp(k->s000, k->s001, f.x), lerp(k->s010, k->s011, f.x), f.y),
              lerp(lerp(k->s100, k->s101, f.x), lerp(k->s110, k->s111, f.x), f.y), f.z);
}

RAY_INLINE V sample_open(FIELD, const OpenBrick* b, VdvrGrid grid, V3 c) {
  const Cell cell = cell_at(grid, b, c);
  const Corners k = corners_of(field, &cell);
  return trilinear(&k, cell.fraction);
}

// f(c + reach) - f(c - reach) along one axis of the base. The reach is half a cell, so both points lie in the
// cell of c and one beside it: `a` and `b` are the field in the faces of c's cell, `beyond` in the face
// behind the nearer one, first the index of face a.
RAY_INLINE V difference(V a, V b, V beyond, I lower, V first, V lo, V hi) {
  const V p = PICK(lower, beyond, a), q = PICK(lower, a, b), r = PICK(lower, b, beyond);
  const V face = PICK(lower, first, first + 1.0f);  // of q
  return lerp(q, r, hi - face) - lerp(p, q, lo - (face - 1.0f));
}

// As far as the sample `beyond` lies from corner a, in cells: back where the point is nearer to a. A face of
// the grid has none: then a or b itself, which gets weight 1 or 0.
RAY_INLINE I steps_beyond(I lower, I index, int cells) {
  const I to = PICK(lower, index - 1, index + 2);
  return (to < 0 ? (I)0 : (to > cells ? (I)cells : to)) - index;
}

// Differences along the axes where all samples needed are the base's: of cells' corners and 12 samples
// beside.
RAY_INLINE V3 base_differences(FIELD, VdvrGrid grid, V3 c, V3 lo, V3 hi, V value_scale, V bias, I type) {
  const V one = (V)(1.0f), zero = (V)(0.0f);
  Cell cell;
  const I ix = local_of(c.x, zero, one, (I)(grid.cells_x - 1), &cell.fraction.x);
  const I iy = local_of(c.y, zero, one, (I)(grid.cells_y - 1), &cell.fraction.y);
  const I iz = local_of(c.z, zero, one, (I)(grid.cells_z - 1), &cell.fraction.z);
  cell.type = type;
  cell.value_scale = value_scale;
  cell.bias = bias;
  cell.stride_y = (Offset)(grid.cells_x + 1);
  cell.stride_z = cell.stride_y * (Offset)(grid.cells_y + 1);
  cell.first = TO_OFFSET(iz) * cell.stride_z + TO_OFFSET(iy) * cell.stride_y + TO_OFFSET(ix);
  const Corners k = corners_of(field, &cell);
  const V3 t = cell.fraction;
  const Offset sy = cell.stride_y, sz = cell.stride_z;
  const I nearer_x = t.x < 0.5f, nearer_y = t.y < 0.5f, nearer_z = t.z < 0.5f;
  V3 d;
  {
    const Offset i = cell.first + TO_OFFSET(steps_beyond(nearer_x, ix, grid.cells_x));
    const V beyond = lerp(lerp(load(field, &cell, i), load(field, &cell, i + sy), t.y),
                          lerp(load(field, &cell, i + sz), load(field, &cell, i + sz + sy), t.y), t.z);
    d.x = difference(lerp(lerp(k.s000, k.s010, t.y), lerp(k.s100, k.s110, t.y), t.z),
                     lerp(lerp(k.s001, k.s011, t.y), lerp(k.s101, k.s111, t.y), t.z), beyond, nearer_x,
                     TO_V(ix), lo.x, hi.x);
  }
  // Along y and z what is shared of the interpolation in x.
  const V e00 = lerp(k.s000, k.s001, t.x), e01 = lerp(k.s010, k.s011, t.x);
  const V e10 = lerp(k.s100, k.s101, t.x), e11 = lerp(k.s110, k.s111, t.x);
  {
    const Offset i = cell.first + TO_OFFSET(steps_beyond(nearer_y, iy, grid.cells_y)) * sy;
    const V beyond = lerp(lerp(load(field, &cell, i), load(field, &cell, i + 1), t.x),
                          lerp(load(field, &cell, i + sz), load(field, &cell, i + sz + 1), t.x), t.z);
    d.y = difference(lerp(e00, e10, t.z), lerp(e01, e11, t.z), beyond, nearer_y, TO_V(iy), lo.y, hi.y);
  }
  {
    const Offset i = cell.first + TO_OFFSET(steps_beyond(nearer_z, iz, grid.cells_z)) * sz;
    const V beyond = lerp(lerp(load(field, &cell, i), load(field, &cell, i + 1), t.x),
                          lerp(load(field, &cell, i + sy), load(field, &cell, i + sy + 1), t.x), t.y);
    d.z = difference(lerp(e00, e01, t.y), lerp(e10, e11, t.y), beyond, nearer_z, TO_V(iz), lo.z, hi.z);
  }
  return d;
}

#else

RAY_INLINE V sample_open(FIELD, const OpenBrick* b, VdvrGrid grid, V3 c) {
  return vdvr_image_sample_in_brick(THE_FIELD, &b->record, grid, b->at.x, b->at.y, b->at.z, c.x, c.y, c.z);
}

#endif

// The field anywhere: vdvr_sample, or its image form.
RAY_INLINE V sample_anywhere(FIELD, BRICKS, VdvrGrid grid, V3 c) {
  const OpenBrick b = open_brick(bricks, grid, brick_at(grid, c));
  return sample_open(THE_FIELD, &b, grid, c);
}

// The same where most points lie in open bricks; lanes outside `needed` get some finite value.
RAY_INLINE V sample_near(FIELD, BRICKS, VdvrGrid grid, const OpenBrick* b, V3 c, I needed) {
#if !VDVR_UNIFORM
  if (ANY(needed & NOT(is_inside(b, c)))) return sample_anywhere(THE_FIELD, bricks, grid, c);
#endif
  return sample_open(THE_FIELD, b, grid, c);
}

// Differences along the axes wherever the points lie: six samples.
RAY_INLINE V3 differences(FIELD, BRICKS, VdvrGrid grid, const OpenBrick* b, V3 c, V3 lo, V3 hi, I needed) {
  V3 d;
  d.x = sample_near(THE_FIELD, bricks, grid, b, v3(hi.x, c.y, c.z), needed) -
        sample_near(THE_FIELD, bricks, grid, b, v3(lo.x, c.y, c.z), needed);
  d.y = sample_near(THE_FIELD, bricks, grid, b, v3(c.x, hi.y, c.z), needed) -
        sample_near(THE_FIELD, bricks, grid, b, v3(c.x, lo.y, c.z), needed);
  d.z = sample_near(THE_FIELD, bricks, grid, b, v3(c.x, c.y, hi.z), needed) -
        sample_near(THE_FIELD, bricks, grid, b, v3(c.x, c.y, lo.z), needed);
  return d;
}

// Density per length along the world axes; one-sided at the grid's faces, where the reach is cut. Every lane
// of c lies in the grid; those outside `needed` get some finite value.
RAY_INLINE V3 gradient_at(FIELD, BRICKS, VdvrGrid grid, const OpenBrick* b, V3 c, float3 cells_per_length,
                          I needed) {
  const V3 lo = v3(MOST(c.x - GRADIENT_REACH, (V)(0.0f)), MOST(c.y - GRADIENT_REACH, (V)(0.0f)),
                   MOST(c.z - GRADIENT_REACH, (V)(0.0f)));
  const V3 hi = v3(LEAST(c.x + GRADIENT_REACH, (V)(float)grid.cells_x),
                   LEAST(c.y + GRADIENT_REACH, (V)(float)grid.cells_y),
                   LEAST(c.z + GRADIENT_REACH, (V)(float)grid.cells_z));
  V3 d = v3((V)(0.0f), (V)(0.0f), (V)(0.0f));
#ifdef VDVR_SAMPLER_BUFFER
  const I simple = base_around(b);
  if (ANY(needed & NOT(simple))) d = differences(THE_FIELD, bricks, grid, b, c, lo, hi, needed & NOT(simple));
  if (ANY(needed & simple)) {
#if VDVR_LANES == 1
    d = base_differences(field, grid, c, lo, hi, b->record.scale, b->record.bias, (int)b->record.type);
#elif VDVR_UNIFORM
    d = base_differences(field, grid, c, lo, hi, (V)(1.0f), (V)(0.0f), (I)(VDVR_F32));
#else
    // Bytes of the base lie in the buffer under any number that a base sample has.
    const I type = PICK(simple, b->type, (I)(VDVR_U8));
    const V3 e = base_differences(field, grid, c, lo, hi, b->value_scale, b->bias, type);
    d = v3(PICK(simple, e.x, d.x), PICK(simple, e.y, d.y), PICK(simple, e.z, d.z));
#endif
  }
#else
  d = differences(THE_FIELD, bricks, grid, b, c, lo, hi, needed);
#endif
  return v3(d.x / (hi.x - lo.x) * cells_per_length.x, d.y / (hi.y - lo.y) * cells_per_length.y,
            d.z / (hi.z - lo.z) * cells_per_length.z);
}

#endif
