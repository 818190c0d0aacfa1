// One work-item carries VDVR_LANES samples of z: the vector type, and its aligned loads and stores. Tuning;
// never changes the result. Included by back_project.cl and batched_product.cl.
#ifndef VDVR_LANES
#define VDVR_LANES 16
#endif

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
