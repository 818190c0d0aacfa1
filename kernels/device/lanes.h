// One work-item carries VDVR_LANES heights: the vector type VEC, INT of its comparisons, INDEX of its lanes,
// TO_INT and TO_VEC, the same bits as BITS and OF_BITS, aligned loads and stores LOAD and STORE, others READ
// and WRITE, and of private arrays READ_OWN and WRITE_OWN, the LARGEST of its lanes, LANE(v, n), one of them,
// and FOR_LANES(M), M(n) of each, n a hexadecimal digit. Where a work-group shares a column or a brick,
// VDVR_ALONG work-items of it lie along z (device/shared_column.h). Tuning; neither changes the result. With
// VDVR_DOUBLE 1 also a vector of sums in double precision, made of samples by WIDE and rounded to samples by
// NARROW; without it sums are as samples.
#ifndef VDVR_LANES
#define VDVR_LANES 16
#endif
#include "device/masks.h"

#if VDVR_LANES == 1
#define VEC float
#define INT int
#define INDEX 0
#define LANE(v, n) (v)
#define TO_INT(v) convert_int(v)
#define TO_VEC(v) convert_float(v)
#define BITS(v) as_int(v)
#define OF_BITS(v) as_float(v)
#define LOAD(p) (*(p))
#define STORE(v, p) (*(p) = (v))
#define READ(p) (*(p))
#define WRITE(v, p) (*(p) = (v))
#define READ_OWN(p) (*(p))
#define WRITE_OWN(v, p) (*(p) = (v))
#define LARGEST(v) (v)
#define FOR_LANES(M) M(0)
#elif VDVR_LANES == 4
#define VEC float4
#define INT int4
#define INDEX (int4)(0, 1, 2, 3)
#define LANE(v, n) (v).s##n
#define TO_INT(v) convert_int4(v)
#define TO_VEC(v) convert_float4(v)
#define BITS(v) as_int4(v)
#define OF_BITS(v) as_float4(v)
#define LOAD(p) vload4(0, p)
#define STORE(v, p) vstore4(v, 0, p)
#define READ_OWN(p) vload4(0, p)
#define WRITE_OWN(v, p) vstore4(v, 0, p)
#define LARGEST(v) largest_of_4(v)
#define FOR_LANES(M) M(0) M(1) M(2) M(3)
#elif VDVR_LANES == 8
#define VEC float8
#define INT int8
#define INDEX (int8)(0, 1, 2, 3, 4, 5, 6, 7)
#define LANE(v, n) (v).s##n
#define TO_INT(v) convert_int8(v)
#define TO_VEC(v) convert_float8(v)
#define BITS(v) as_int8(v)
#define OF_BITS(v) as_float8(v)
#define LOAD(p) vload8(0, p)
#define STORE(v, p) vstore8(v, 0, p)
#define READ_OWN(p) vload8(0, p)
#define WRITE_OWN(v, p) vstore8(v, 0, p)
#define LARGEST(v) largest_of_8(v)
#define FOR_LANES(M) M(0) M(1) M(2) M(3) M(4) M(5) M(6) M(7)
#elif VDVR_LANES == 16
#define VEC float16
#define INT int16
#define INDEX (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)
#define LANE(v, n) (v).s##n
#define TO_INT(v) convert_int16(v)
#define TO_VEC(v) convert_float16(v)
#define BITS(v) as_int16(v)
#define OF_BITS(v) as_float16(v)
#define LOAD(p) (*(__global const float16*)(p))
#define STORE(v, p) (*(__global float16*)(p) = (v))
#define READ_OWN(p) vload16(0, p)
#define WRITE_OWN(v, p) vstore16(v, 0, p)
#define LARGEST(v) largest_of_16(v)
#define FOR_LANES(M) M(0) M(1) M(2) M(3) M(4) M(5) M(6) M(7) M(8) M(9) M(a) M(b) M(c) M(d) M(e) M(f)
#else
#error "VDVR_LANES must be 1, 4, 8 or 16"
#endif

#if VDVR_LANES > 1
// Not by vload and vstore: PoCL makes these of loads of pairs, and where two of them overlap, as at the nodes
// below and above, LLVM shares the pairs and adds them one by one, in place of whole vectors.
typedef VEC __attribute__((aligned(4))) LOOSE;
#define READ(p) (*(__global const LOOSE*)(p))
#define WRITE(v, p) (*(__global LOOSE*)(p) = (v))
#endif

#define ALWAYS_INLINE __attribute__((always_inline))
static inline ALWAYS_INLINE float largest_of_4(float4 v) {
  const float2 a = fmax(v.lo, v.hi);
  return fmax(a.x, a.y);
}
static inline ALWAYS_INLINE float largest_of_8(float8 v) { return largest_of_4(fmax(v.lo, v.hi)); }
static inline ALWAYS_INLINE float largest_of_16(float16 v) { return largest_of_8(fmax(v.lo, v.hi)); }

#ifndef VDVR_DOUBLE
#define VDVR_DOUBLE 0
#endif
#if VDVR_DOUBLE
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#define REAL double
#if VDVR_LANES == 1
#define SUM double
#define WIDE(v) convert_double(v)
#define NARROW(v) convert_float(v)
#elif VDVR_LANES == 4
#define SUM double4
#define WIDE(v) convert_double4(v)
#define NARROW(v) convert_float4(v)
#elif VDVR_LANES == 8
#define SUM double8
#define WIDE(v) convert_double8(v)
#define NARROW(v) convert_float8(v)
#else
#define SUM double16
#define WIDE(v) convert_double16(v)
#define NARROW(v) convert_float16(v)
#endif
#else
#define REAL float
#define SUM VEC
#define WIDE(v) (v)
#define NARROW(v) (v)
#endif

// One row ahead, walks across the columns of an array that another kernel has just written find what they
// read in the first cache: processors foresee strides of less than a page. Tried on PoCL 3.1 and on Intel's
// runtime of 2026; simulators need not know it.
#if VDVR_LANES > 1 && defined(__has_builtin) && !defined(VDVR_PLAIN_VECTORS)
#if __has_builtin(__builtin_prefetch)
#define SOON(p) __builtin_prefetch(p)
#endif
#endif
#ifndef SOON
#define SOON(p)
#endif
