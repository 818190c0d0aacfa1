// A packet: VDVR_LANES rays that one work-item follows side by side. 1 suits devices whose work-items are
// lanes themselves (GPUs), 8 or 16 those whose work-items are threads (CPUs). Every lane does the same
// operations in the same order, whatever the others do, so that the number of lanes never changes a bit.
// Included by raycast.cl and d2vr.cl.
#ifndef VDVR_PACKET_H
#define VDVR_PACKET_H

// Tuning: rays of one packet.
#ifndef VDVR_LANES
#define VDVR_LANES 1
#endif
#include "device/masks.h"

// LANE(v, n): component n of a vector. EACH(F): the statements F(n) of every lane. GATHER(T, p, i): elements
// i of the array p. COLUMNS, ROWS: where the lanes' pixels lie in the packet's PACKET_X x PACKET_Y.
#if VDVR_LANES == 1
#define PACKET(NAME) NAME
#define LANE(v, n) (v)
#define EACH(F) F(0)
#define GATHER(T, p, i) ((p)[i])
#define PACKET_X 1
#define PACKET_Y 1
#define COLUMNS 0
#define ROWS 0
#else
#define LANE(v, n) (v).s##n
// No number is negative, and such a one needs no sign in an address.
#define AT(p, i) (p)[(uint)(i)]
#if VDVR_LANES == 4
#define PACKET(NAME) NAME##4
#define EACH(F) F(0) F(1) F(2) F(3)
#define GATHER(T, p, i) ((T)(AT(p, (i).s0), AT(p, (i).s1), AT(p, (i).s2), AT(p, (i).s3)))
#define PACKET_X 2
#define PACKET_Y 2
#define COLUMNS (int4)(0, 1, 0, 1)
#define ROWS (int4)(0, 0, 1, 1)
#elif VDVR_LANES == 8
#define PACKET(NAME) NAME##8
#define EACH(F) F(0) F(1) F(2) F(3) F(4) F(5) F(6) F(7)
#define GATHER(T, p, i)                                                                          \
  ((T)(AT(p, (i).s0), AT(p, (i).s1), AT(p, (i).s2), AT(p, (i).s3), AT(p, (i).s4), AT(p, (i).s5), \
       AT(p, (i).s6), AT(p, (i).s7)))
#define PACKET_X 4
#define PACKET_Y 2
#define COLUMNS (int8)(0, 1, 2, 3, 0, 1, 2, 3)
#define ROWS (int8)(0, 0, 0, 0, 1, 1, 1, 1)
#elif VDVR_LANES == 16
#define PACKET(NAME) NAME##16
#define EACH(F) F(0) F(1) F(2) F(3) F(4) F(5) F(6) F(7) F(8) F(9) F(a) F(b) F(c) F(d) F(e) F(f)
#define GATHER(T, p, i)                                                                          \
  ((T)(AT(p, (i).s0), AT(p, (i).s1), AT(p, (i).s2), AT(p, (i).s3), AT(p, (i).s4), AT(p, (i).s5), \
       AT(p, (i).s6), AT(p, (i).s7), AT(p, (i).s8), AT(p, (i).s9), AT(p, (i).sa), AT(p, (i).sb), \
       AT(p, (i).sc), AT(p, (i).sd), AT(p, (i).se), AT(p, (i).sf)))
#define PACKET_X 4
#define PACKET_Y 4
#define COLUMNS (int16)(0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3)
#define ROWS (int16)(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3)
#else
#error "VDVR_LANES must be 1, 4, 8 or 16"
#endif
#endif
#define TO_V(x) PACKET(convert_float)(x)
#define TO_I(x) PACKET(convert_int)(x)
#define AS_I(x) PACKET(as_int)(x)
#define AS_U(x) PACKET(as_uint)(x)

typedef PACKET(float) V;
typedef PACKET(int) I;
typedef PACKET(uint) U;
typedef PACKET(ushort) U16;
typedef PACKET(uchar) U8;

// Of kernels that follow packets: work-items are vectors already. A compiler that joins work-items (Intel's
// for CPUs) would otherwise make vectors of vectors, for which it takes twenty times as long and more.
#if VDVR_LANES == 1
#define PACKET_HINT
#else
#define PACKET_HINT __attribute__((vec_type_hint(V)))
#endif

#if VDVR_LANES == 1
typedef ulong Offset;
#define TO_OFFSET(i) ((ulong)(i))
#define TO_ULONG(i) (i)
#else
typedef I Offset;
#define TO_OFFSET(i) (i)
#define TO_ULONG(i) ((ulong)(uint)(i))  // of one lane; no offset is negative
#endif

// Without the NaN rules of fmin, fmax and clamp, which cost branches; no operand is NaN.
#define LEAST(a, b) ((a) < (b) ? (a) : (b))
#define MOST(a, b) ((a) > (b) ? (a) : (b))

// Three coordinates of every lane.
typedef struct {
  V x, y, z;
} V3;
typedef struct {
  I x, y, z;
} I3;

// Four numbers of every lane, from one float4 a lane: TURN(ROW), ROW(n) that of lane n. One load and half a
// dozen shuffles a lane, where four loads and as many inserts would stand.
typedef struct {
  V x, y, z, w;
} V4;
#if VDVR_LANES == 1
RAY_INLINE V4 turned(float4 a) {
  const V4 t = {a.x, a.y, a.z, a.w};
  return t;
}
#define TURN(ROW) turned(ROW(0))
#elif VDVR_LANES == 4
RAY_INLINE V4 turned(float4 a, float4 b, float4 c, float4 d) {
  const V4 t = {(V)(a.x, b.x, c.x, d.x), (V)(a.y, b.y, c.y, d.y), (V)(a.z, b.z, c.z, d.z),
                (V)(a.w, b.w, c.w, d.w)};
  return t;
}
#define TURN(ROW) turned(ROW(0), ROW(1), ROW(2), ROW(3))
#elif VDVR_LANES == 8
RAY_INLINE V4 turned(float4 a, float4 b, float4 c, float4 d, float4 e, float4 f, float4 g, float4 h) {
  const float8 ae = (float8)(a, e), bf = (float8)(b, f), cg = (float8)(c, g), dh = (float8)(d, h);
#define LOW(p, q) (float8)(p.s0, q.s0, p.s1, q.s1, p.s4, q.s4, p.s5, q.s5)
#define HIGH(p, q) (float8)(p.s2, q.s2, p.s3, q.s3, p.s6, q.s6, p.s7, q.s7)
#define EVEN(p, q) (float8)(p.s01, q.s01, p.s45, q.s45)
#define ODD(p, q) (float8)(p.s23, q.s23, p.s67, q.s67)
  const float8 ab_xy = LOW(ae, bf), ab_zw = HIGH(ae, bf), cd_xy = LOW(cg, dh), cd_zw = HIGH(cg, dh);
  const V4 t = {EVEN(ab_xy, cd_xy), ODD(ab_xy, cd_xy), EVEN(ab_zw, cd_zw), ODD(ab_zw, cd_zw)};
#undef LOW
#undef HIGH
#undef EVEN
#undef ODD
  return t;
}
#define TURN(ROW) turned(ROW(0), ROW(1), ROW(2), ROW(3), ROW(4), ROW(5), ROW(6), ROW(7))
#else
// Rows of four lanes in a vector, four lanes apart, so that halves of rows and then their numbers meet within
// its quarters.
RAY_INLINE V4 turned(float16 a, float16 b, float16 c, float16 d) {
  const ulong8 pa = as_ulong8(a), pb = as_ulong8(b), pc = as_ulong8(c), pd = as_ulong8(d);
#define FIRST(p, q) as_float16((ulong8)(p.s0, q.s0, p.s2, q.s2, p.s4, q.s4, p.s6, q.s6))
#define SECOND(p, q) as_float16((ulong8)(p.s1, q.s1, p.s3, q.s3, p.s5, q.s5, p.s7, q.s7))
  const float16 ab_xy = FIRST(pa, pb), ab_zw = SECOND(pa, pb), cd_xy = FIRST(pc, pd), cd_zw = SECOND(pc, pd);
#define EVEN(p, q) \
  (float16)(p.s0, p.s2, q.s0, q.s2, p.s4, p.s6, q.s4, q.s6, p.s8, p.sa, q.s8, q.sa, p.sc, p.se, q.sc, q.se)
#define ODD(p, q) \
  (float16)(p.s1, p.s3, q.s1, q.s3, p.s5, p.s7, q.s5, q.s7, p.s9, p.sb, q.s9, q.sb, p.sd, p.sf, q.sd, q.sf)
  const V4 t = {EVEN(ab_xy, cd_xy), ODD(ab_xy, cd_xy), EVEN(ab_zw, cd_zw), ODD(ab_zw, cd_zw)};
#undef ODD
#undef EVEN
#undef SECOND
#undef FIRST
  return t;
}
#define TURN(ROW)                                                                              \
  turned((float16)(ROW(0), ROW(4), ROW(8), ROW(c)), (float16)(ROW(1), ROW(5), ROW(9), ROW(d)), \
         (float16)(ROW(2), ROW(6), ROW(a), ROW(e)), (float16)(ROW(3), ROW(7), ROW(b), ROW(f)))
#endif

// Two numbers of every lane, from one address a lane: PAIRS(ROW), ROW(n) the TWO_FLOATS of lane n. They
// travel as one word: of two floats compilers make a load, and then as many shuffles as of four.
typedef struct {
  V first, second;
} V2;
#if VDVR_LANES == 1
#define TWO_FLOATS(p) vload2(0, p)
RAY_INLINE V2 paired(float2 a) {
  const V2 t = {a.x, a.y};
  return t;
}
#define PAIRS(ROW) paired(ROW(0))
#else
#define TWO_FLOATS(p) as_ulong(vload2(0, p))
#if VDVR_LANES == 4
RAY_INLINE V2 paired(ulong a, ulong b, ulong c, ulong d) {
  const float8 t = as_float8((ulong4)(a, b, c, d));
  const V2 v = {t.even, t.odd};
  return v;
}
#define PAIRS(ROW) paired(ROW(0), ROW(1), ROW(2), ROW(3))
#else
typedef struct {
  float8 first, second;
} Paired8;
RAY_INLINE Paired8 paired8(ulong a, ulong b, ulong c, ulong d, ulong e, ulong f, ulong g, ulong h) {
#ifdef VDVR_PLAIN_VECTORS  // element by element, for simulators that cannot follow vectors that are joined
#define FLOAT_OF(w, n) as_float((uint)((w) >> (32 * (n))))
#define EIGHT(n)                                                                                           \
  (float8)(FLOAT_OF(a, n), FLOAT_OF(b, n), FLOAT_OF(c, n), FLOAT_OF(d, n), FLOAT_OF(e, n), FLOAT_OF(f, n), \
           FLOAT_OF(g, n), FLOAT_OF(h, n))
  const Paired8 t = {EIGHT(0), EIGHT(1)};
#undef EIGHT
#undef FLOAT_OF
#else
  const float8 abef = as_float8((ulong4)(a, b, e, f)), cdgh = as_float8((ulong4)(c, d, g, h));
  const Paired8 t = {(float8)(abef.s0, abef.s2, cdgh.s0, cdgh.s2, abef.s4, abef.s6, cdgh.s4, cdgh.s6),
                     (float8)(abef.s1, abef.s3, cdgh.s1, cdgh.s3, abef.s5, abef.s7, cdgh.s5, cdgh.s7)};
#endif
  return t;
}
#if VDVR_LANES == 8
RAY_INLINE V2 as_pairs(Paired8 t) {
  const V2 v = {t.first, t.second};
  return v;
}
#define PAIRS(ROW) as_pairs(paired8(ROW(0), ROW(1), ROW(2), ROW(3), ROW(4), ROW(5), ROW(6), ROW(7)))
#else
RAY_INLINE V2 as_pairs(Paired8 a, Paired8 b) {
  const V2 v = {(V)(a.first, b.first), (V)(a.second, b.second)};
  return v;
}
#define PAIRS(ROW)                                                                  \
  as_pairs(paired8(ROW(0), ROW(1), ROW(2), ROW(3), ROW(4), ROW(5), ROW(6), ROW(7)), \
           paired8(ROW(8), ROW(9), ROW(a), ROW(b), ROW(c), ROW(d), ROW(e), ROW(f)))
#endif
#endif
#endif

#endif
