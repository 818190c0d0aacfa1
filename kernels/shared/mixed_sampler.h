// The definition of the mixed-resolution field, compiled by the OpenCL compiler and by the host compiler
// alike: what the verifier certifies, the ray-caster renders and sample_at returns is this text (contract:
// docs/file-format.md).
//
// The includer declares its dialect: VDVR_DIALECT_OPENCL or VDVR_DIALECT_HOST. Scalar fp32, + - *, conversion
// to int and comparisons only, contraction off on both sides, so that both give the same bits.
//
// Coordinates are in cells: c = (p - origin) / spacing, 0 <= c <= cells. A point belongs to the brick floor(c
// / g) (half-open; the last brick is closed). Inside it the local coordinate (c - g b) 2^level is exact in
// fp32.
#ifndef VDVR_MIXED_SAMPLER_H
#define VDVR_MIXED_SAMPLER_H

#if defined(VDVR_DIALECT_OPENCL)
#pragma OPENCL FP_CONTRACT OFF
#define VDVR_GLOBAL __global
#define VDVR_INLINE inline
typedef ulong vdvr_u64;
typedef uint vdvr_u32;
typedef int vdvr_i32;
#elif defined(VDVR_DIALECT_HOST)
#include <cstdint>
#define VDVR_GLOBAL
#define VDVR_INLINE inline
typedef std::uint64_t vdvr_u64;
typedef std::uint32_t vdvr_u32;
typedef std::int32_t vdvr_i32;
#else
#error "declare VDVR_DIALECT_OPENCL or VDVR_DIALECT_HOST before including mixed_sampler.h"
#endif

// Where a brick's samples lie. 48 bytes; host/resident_volume.cpp fills it and checks the layout.
typedef struct {
  vdvr_u64 offset;    // of its first sample in the sample buffer, in floats
  vdvr_u32 stride_y;  // in floats; stride_x is 1
  vdvr_u32 stride_z;
  vdvr_u32 level_x, level_y, level_z;
  vdvr_u32 base_around;  // 1: this brick and those across its faces read the base (for raycast.cl; else 0)
  float texel_x, texel_y, texel_z;  // of its first sample in the image3d atlas, at the texel's centre
  float pad1;
} VdvrBrick;

// The grid and its bricks. 32 bytes.
typedef struct {
  vdvr_i32 cells_x, cells_y, cells_z;
  vdvr_i32 granularity;
  vdvr_i32 bricks_x, bricks_y, bricks_z;
  vdvr_i32 pad0;
} VdvrGrid;

// A cell coordinate inside one brick along one axis: the sample below it and the fraction above that.
typedef struct {
  vdvr_i32 index;
  float fraction;
} VdvrLocal;

// (1 - t) a + t b gives a at t = 0 and b at t = 1 to the bit, which a + t (b - a) does not.
VDVR_INLINE float vdvr_lerp(float a, float b, float t) { return (1.0f - t) * a + t * b; }

// The brick along one axis that a cell coordinate belongs to.
VDVR_INLINE vdvr_i32 vdvr_brick_of(float c, vdvr_i32 granularity, vdvr_i32 bricks) {
  // Truncation stands for floor: they differ below 0 only, where the clamp gives 0 either way. A floor is a
  // dozen instructions on some devices.
  vdvr_i32 b = (vdvr_i32)c / granularity;
  return b < 0 ? 0 : (b > bricks - 1 ? bricks - 1 : b);
}

// The local coordinate of c in brick b of the given level; c may lie on the brick's far face.
VDVR_INLINE VdvrLocal vdvr_local(float c, vdvr_i32 b, vdvr_u32 level, vdvr_i32 granularity, vdvr_i32 cells) {
  const vdvr_i32 first = b * granularity;
  const vdvr_i32 width = cells - first < granularity ? cells - first : granularity;
  const vdvr_i32 last = width << level;
  const float r = (c - (float)first) * (float)(1 << level);
  VdvrLocal l;
  l.index = (vdvr_i32)r;  // as in vdvr_brick_of
  l.index = l.index < 0 ? 0 : (l.index > last - 1 ? last - 1 : l.index);
  l.fraction = r - (float)l.index;
  return l;
}

// Bilinear interpolation in the lower z face of the cell whose lowest sample is `s`: x first, then y.
VDVR_INLINE float vdvr_bilinear(VDVR_GLOBAL const float* s, vdvr_u32 stride_y, float fx, float fy) {
  return vdvr_lerp(vdvr_lerp(s[0], s[1], fx), vdvr_lerp(s[stride_y], s[stride_y + 1], fx), fy);
}

// Trilinear interpolation in that cell: x first, then y, then z.
VDVR_INLINE float vdvr_trilinear(VDVR_GLOBAL const float* s, vdvr_u32 stride_y, vdvr_u32 stride_z, float fx,
                                 float fy, float fz) {
  return vdvr_lerp(vdvr_bilinear(s, stride_y, fx, fy), vdvr_bilinear(s + stride_z, stride_y, fx, fy), fz);
}

// The field at a cell coordinate of a known brick; `first` is the brick's first sample.
VDVR_INLINE float vdvr_sample_in_brick(VDVR_GLOBAL const float* first, vdvr_u32 stride_y, vdvr_u32 stride_z,
                                       VdvrLocal x, VdvrLocal y, VdvrLocal z) {
  return vdvr_trilinear(
      first + (vdvr_u64)z.index * stride_z + (vdvr_u64)y.index * stride_y + (vdvr_u64)x.index, stride_y,
      stride_z, x.fraction, y.fraction, z.fraction);
}

// The field at a cell coordinate: finds the brick, then samples it.
VDVR_INLINE float vdvr_sample(VDVR_GLOBAL const float* samples, VDVR_GLOBAL const VdvrBrick* bricks,
                              VdvrGrid grid, float cx, float cy, float cz) {
  const vdvr_i32 bx = vdvr_brick_of(cx, grid.granularity, grid.bricks_x);
  const vdvr_i32 by = vdvr_brick_of(cy, grid.granularity, grid.bricks_y);
  const vdvr_i32 bz = vdvr_brick_of(cz, grid.granularity, grid.bricks_z);
  const VdvrBrick b =
      bricks[((vdvr_u64)bz * (vdvr_u64)grid.bricks_y + (vdvr_u64)by) * (vdvr_u64)grid.bricks_x +
             (vdvr_u64)bx];
  return vdvr_sample_in_brick(samples + b.offset, b.stride_y, b.stride_z,
                              vdvr_local(cx, bx, b.level_x, grid.granularity, grid.cells_x),
                              vdvr_local(cy, by, b.level_y, grid.granularity, grid.cells_y),
                              vdvr_local(cz, bz, b.level_z, grid.granularity, grid.cells_z));
}

#endif
