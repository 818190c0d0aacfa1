// What stands at the corners of the cells that the points of a packet lie in. The includer has defined Cell,
// Place and the loads of pairs. Included by packet_sampler.h.
#ifndef VDVR_PACKET_CORNERS_H
#define VDVR_PACKET_CORNERS_H

// A sample point: the field there, and what it was interpolated from. Corners s<z><y><x>.
typedef struct {
  Cell cell;
  V s000, s001, s010, s011, s100, s101, s110, s111;
  V value;
#if VDVR_LIT && !VDVR_UNIFORM
  int apart;  // as its brick's
#endif
} Sampled;

#if VDVR_LIT
// The words at the corners of cells, in two planes: x, y of a V4 are the two along y, z, w those beside them
// along x. They stand behind one another: a load a lane and plane.
typedef struct {
  V4 low, high;
} Planes;

// Of pairs, whose alignment lets every device load two words at once, and most four.
#define FOUR_OF(s, i) as_float4(vload2(0, (__global const ulong*)(s) + TO_ULONG(i)))
#define LOW(n) FOUR_OF(s, LANE(lowest, n))
// An offset that all lanes share costs nothing in an address.
RAY_INLINE Planes planes_apart(__global const float* s, Offset lowest, int apart) {
  __global const float* above = s + 2 * (ulong)(uint)apart;
#define HIGH(n) FOUR_OF(above, LANE(lowest, n))
  const Planes p = {TURN(LOW), TURN(HIGH)};
#undef HIGH
  return p;
}
RAY_INLINE Planes planes_of(__global const float* s, const Sampled* k) {
  const Offset lowest = k->cell.lowest.lane;
#if VDVR_UNIFORM
  return planes_apart(s, lowest, k->cell.z.all);
#else
  if (k->apart) return planes_apart(s, lowest, k->apart);
  const Offset highest = lowest + k->cell.z.lane;
#define HIGH(n) FOUR_OF(s, LANE(highest, n))
  const Planes p = {TURN(LOW), TURN(HIGH)};
#undef HIGH
  return p;
#endif
}
#undef LOW
#undef FOUR_OF

RAY_INLINE void load_corners(FIELD, Sampled* k) {
  const Planes p = planes_of((__global const float*)field, k);
  k->s000 = p.low.x;
  k->s010 = p.low.y;
  k->s001 = p.low.z;
  k->s011 = p.low.w;
  k->s100 = p.high.x;
  k->s110 = p.high.y;
  k->s101 = p.high.z;
  k->s111 = p.high.w;
}
#else
RAY_INLINE void load_corners(FIELD, Sampled* k) {
  const Cell* c = &k->cell;
  const Place i = c->lowest, iy = after(i, c->y), iz = after(i, c->z), iyz = after(iy, c->z);
  const Pair low = load_pair(field, c, i), low_y = load_pair(field, c, iy), high = load_pair(field, c, iz),
             high_y = load_pair(field, c, iyz);
  k->s000 = low.at;
  k->s001 = low.next;
  k->s010 = low_y.at;
  k->s011 = low_y.next;
  k->s100 = high.at;
  k->s101 = high.next;
  k->s110 = high_y.at;
  k->s111 = high_y.next;
}
#endif

#endif
