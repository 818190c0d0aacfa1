// One work-item carries VDVR_LANES samples of z: the vector type, and its aligned loads and stores. Tuning;
// never changes the result. With VDVR_DOUBLE 1 also a vector of sums in double precision, made of samples by
// WIDE and rounded to samples by NARROW; without it sums are as samples. Included by back_project.cl,
// batched_product.cl and filter_rows.cl.
#ifndef VDVR_LANES
#define VDVR_LANES 16
#endif
#include "device/masks.h"

#if VDVR_LANES == 1
#define VEC float
#define LOAD(p) (*(p))
#define STORE(v, p) (*(p) = (v))
#elif VDVR_LANES == 4
#define VEC float4
#define LOAD(p) vload4(0, p)
#define STORE(v, p) vstore4(v, 0, p)
#elif VDVR_LANES == 8
#define VEC float8
#define LOAD(p) vload8(0, p)
#define STORE(v, p) vstore8(v, 0, p)
#else
#define VEC float16
#define LOAD(p) (*(__global const float16*)(p))
#define STORE(v, p) (*(__global float16*)(p) = (v))
#endif

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
