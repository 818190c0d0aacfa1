// Points of a packet and the bricks that they lie in. The includer has defined OpenBrick, which begins with
// I3 at; V3 low, high. Included by packet_sampler.h and d2vr_field.h.
#ifndef VDVR_PACKET_BRICKS_H
#define VDVR_PACKET_BRICKS_H

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
  const I cell = TO_I(c), inside = cell < 0 ? (I)0 : cell;
  const I b = AS_I(AS_U(inside) / (U)(VDVR_GRANULARITY));  // unsigned: a shift
  return b > bricks - 1 ? (I)(bricks - 1) : b;
}
RAY_INLINE I3 brick_at(VdvrGrid grid, V3 c) {
  const I3 b = {brick_of(c.x, grid.bricks_x), brick_of(c.y, grid.bricks_y), brick_of(c.z, grid.bricks_z)};
  return b;
}
RAY_INLINE Offset brick_index(VdvrGrid grid, I3 b) {
  return (TO_OFFSET(b.z) * (Offset)(grid.bricks_y) + TO_OFFSET(b.y)) * (Offset)(grid.bricks_x) +
         TO_OFFSET(b.x);
}

// The last brick of an axis is closed, and wider than the grid where the cells do not divide by the
// granularity.
RAY_INLINE V high_of(I b, V low, int bricks) {
  return PICK(b >= bricks - 1, (V)(INFINITY), low + (float)VDVR_GRANULARITY);
}

// Bricks by their place alone, or the cubes of bricks [b - radius, b + radius]; what else the includer's
// open_brick() reads is left open.
RAY_INLINE OpenBrick boxed_bricks(VdvrGrid grid, I3 at, I radius) {
  OpenBrick b;
  const I3 low = {at.x - radius, at.y - radius, at.z - radius};
  const I3 high = {at.x + radius, at.y + radius, at.z + radius};
  b.at = at;
  b.low = v3(TO_V(low.x * VDVR_GRANULARITY), TO_V(low.y * VDVR_GRANULARITY), TO_V(low.z * VDVR_GRANULARITY));
  b.high = v3(high_of(high.x, TO_V(high.x * VDVR_GRANULARITY), grid.bricks_x),
              high_of(high.y, TO_V(high.y * VDVR_GRANULARITY), grid.bricks_y),
              high_of(high.z, TO_V(high.z * VDVR_GRANULARITY), grid.bricks_z));
  return b;
}
RAY_INLINE OpenBrick boxed_brick(VdvrGrid grid, I3 at) { return boxed_bricks(grid, at, (I)(0)); }

RAY_INLINE OpenBrick no_brick(void) {
  OpenBrick b;
  b.low = b.high = v3((V)(INFINITY), (V)(INFINITY), (V)(INFINITY));
  return b;
}

RAY_INLINE I is_inside(const OpenBrick* b, V3 c) {
  return (c.x >= b->low.x) & (c.x < b->high.x) & (c.y >= b->low.y) & (c.y < b->high.y) & (c.z >= b->low.z) &
         (c.z < b->high.z);
}

#endif
