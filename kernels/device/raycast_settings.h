// What every ray-casting program can be built with, and its inlining. Included by raycast.cl and d2vr.cl.
#ifndef VDVR_RAYCAST_SETTINGS_H
#define VDVR_RAYCAST_SETTINGS_H

// 1: where and how what is seen stands, instead of its colour.
#ifndef VDVR_GEOMETRY
#define VDVR_GEOMETRY 0
#endif
// With VDVR_GEOMETRY. 1: instead of the depth the largest bound of the samples seen, -1 where none is;
// bounds[bz][by][bx] is what the field errs by at most in a brick.
#ifndef VDVR_BOUNDS
#define VDVR_BOUNDS 0
#endif
#if VDVR_BOUNDS
#define BOUNDS , __global const float* restrict bounds
#define THE_BOUNDS , bounds
#else
#define BOUNDS
#define THE_BOUNDS
#endif
// Tuning: pixels of one work-group. 8 x 8 keeps the rays of a group in the same bricks.
#ifndef VDVR_GROUP_X
#define VDVR_GROUP_X 8
#endif
#ifndef VDVR_GROUP_Y
#define VDVR_GROUP_Y 8
#endif

// Calls in the sampling loop cost as much as a sample; compilers without the attribute inline anyway.
#if defined(__clang__) || defined(__GNUC__)
#define RAY_INLINE static inline __attribute__((always_inline))
#else
#define RAY_INLINE static inline
#endif

#endif
