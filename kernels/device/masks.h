// A mask is what comparisons of VDVR_LANES numbers give: 0 or 1 in scalars, 0 or -1 in vectors. any() and
// all() read sign bits, which a scalar's truth has not: of one lane they are never true. So masks are
// combined by & and |, and asked by ANY, ALL, NOT and PICK alone, which mean the same by any number of lanes
// (tests/device/masks_test.cpp). Included by packet.h and lanes.h, which know VDVR_LANES.
#ifndef VDVR_MASKS_H
#define VDVR_MASKS_H

#if VDVR_LANES == 1
#define ANY(m) ((m) != 0)
#define NOT(m) (!(m))
#else
#define ANY(m) any_lane(m)
#define NOT(m) (~(m))
// Without a branch per lane, which the any() of some compilers has.
static inline __attribute__((always_inline)) int any_lane4(int4 m) {
  const ulong2 halves = as_ulong2(m);
  return (halves.x | halves.y) != 0;
}
static inline __attribute__((always_inline)) int any_lane8(int8 m) { return any_lane4(m.lo | m.hi); }
static inline __attribute__((always_inline)) int any_lane16(int16 m) { return any_lane8(m.lo | m.hi); }
#if VDVR_LANES == 4
#define any_lane(m) any_lane4(m)
#elif VDVR_LANES == 8
#define any_lane(m) any_lane8(m)
#else
#define any_lane(m) any_lane16(m)
#endif
#endif
#define ALL(m) (!ANY(NOT(m)))

// m ? a : b, lane by lane.
#define PICK(m, a, b) select((b), (a), (m))

#endif
