// The definition of the mixed-resolution field, compiled by the OpenCL compiler and by the host compiler
// alike: what is certified, verified and returned by sample_at is this text, and what the ray-caster renders
// its transcript for packets of rays (device/packet_sampler.h), held to it to the bit by
// tests/device/one_sampler_test.cpp (contract: docs/file-format.md).
//
// The includer declares its dialect: VDVR_DIALECT_OPENCL or VDVR_DIALECT_HOST. Scalar fp32, + - *, conversion
// to int, bits read as a float and comparisons only, contraction off on both sides, so that both give the
// same bits. No quotients: OpenCL's may err by 2.5 ulp.
//
// Coordinates are in cells: c = (p - origin) / spacing, 0 <= c <= cells. A point belongs to the brick floor(c
// / g) (half-open; the last brick is closed). Inside it the local coordinate (c - g b) 2^(level - coarse) is
// exact in fp32: the base has a sample every 2^coarse cells of an axis, and a level doubles them.
#ifndef VDVR_MIXED_SAMPLER_H
#define VDVR_MIXED_SAMPLER_H

#if defined(VDVR_DIALECT_OPENCL)
#pragma OPENCL FP_CONTRACT OFF
#define VDVR_GLOBAL __global
// Records and coordinates are handed on by value: a call that is not inlined copies them through memory.
#if defined(__clang__) || defined(__GNUC__)
#define VDVR_INLINE static inline __attribute__((always_inline))
#else
#define VDVR_INLINE static inline
#endif
typedef ulong vdvr_u64;
typedef uint vdvr_u32;
typedef ushort vdvr_u16;
typedef uchar vdvr_u8;
typedef int vdvr_i32;
#define VDVR_AS_FLOAT(bits) as_float(bits)
#elif defined(VDVR_DIALECT_HOST)
#include <bit>
#include <cstdint>
#define VDVR_GLOBAL
#define VDVR_INLINE inline
typedef std::uint64_t vdvr_u64;
typedef std::uint32_t vdvr_u32;
typedef std::uint16_t vdvr_u16;
typedef std::uint8_t vdvr_u8;
typedef std::int32_t vdvr_i32;
#define VDVR_AS_FLOAT(bits) std::bit_cast<float>(bits)
#else
#error "declare VDVR_DIALECT_OPENCL or VDVR_DIALECT_HOST before including mixed_sampler.h"
#endif

// Sample types. The includer says which occur: VDVR_SAMPLE_TYPES, the sum of 1 << type over them, so that a
// volume of one type is read without asking for it.
#define VDVR_F32 0
#define VDVR_U16 1
#define VDVR_U8 2
#ifndef VDVR_SAMPLE_TYPES
#error "VDVR_SAMPLE_TYPES (the sum of 1 << type over the types in use) must be defined"
#endif
#define VDVR_HOLDS(b, t) \
  (VDVR_SAMPLE_TYPES == (1 << (t)) || ((VDVR_SAMPLE_TYPES & (1 << (t))) != 0 && (b).type == (t)))

// A brick's record is two words, low word of its place and bits: level x 3, level y 3, level z 3, base_around
// 1, type 2, shift 5, and 15 that the includer's VDVR_RECORDS gives a meaning. Of float32 samples they are
// the high ones of the place. Integers have an offset on the lattice: COMPACT has it in those 15 bits,
// signed, in units of 2^shift, and places below 2^32 only; WIDE has it in a third word, and the place's high
// bits there.
#define VDVR_RECORDS_F32 0
#define VDVR_RECORDS_COMPACT 1
#define VDVR_RECORDS_WIDE 2
#ifndef VDVR_RECORDS
#if VDVR_SAMPLE_TYPES != 1
#error "VDVR_RECORDS (which records the bricks have) must be defined where integers occur"
#endif
#define VDVR_RECORDS VDVR_RECORDS_F32
#endif
#define VDVR_BRICK_WORDS (VDVR_RECORDS == VDVR_RECORDS_WIDE ? 3 : 2)

// A record, unpacked.
typedef struct {
  vdvr_u64 place;  // number of its first sample, in samples of its type from the buffer's start; or its texel
  vdvr_u32 stride_y;  // in samples; stride_x is 1
  vdvr_u32 stride_z;
  vdvr_u32 level_x, level_y, level_z;
  vdvr_u32 base_around;  // 1: this brick and those across its faces read the base (for raycast.cl; else 0)
  vdvr_u32 type;
  float scale, bias;  // sample = stored * scale + bias, for integers
} VdvrBrick;

// The grid and its bricks. 48 bytes.
typedef struct {
  vdvr_i32 cells_x, cells_y, cells_z;
  vdvr_i32 granularity;
  vdvr_i32 bricks_x, bricks_y, bricks_z;
  float step;  // of the lattice that integer samples lie on: a power of two
  vdvr_i32 coarse_x, coarse_y,
      coarse_z;          // log2 of cells per cell of the base, which divides cells and bricks
  vdvr_i32 lit_samples;  // of lit samples, behind which their gradients stand (packet_sampler.h); else 0
} VdvrGrid;

// Scale and bias are a power of two and a multiple of step below 2^24 steps: exact, as is every sample.
VDVR_INLINE VdvrBrick vdvr_unpack(vdvr_u64 place, vdvr_u32 bits, vdvr_i32 offset, VdvrGrid grid) {
  VdvrBrick b;
  b.level_x = bits & 7u;
  b.level_y = bits >> 3 & 7u;
  b.level_z = bits >> 6 & 7u;
  b.base_around = bits >> 9 & 1u;
  b.type = bits >> 10 & 3u;
  b.place = place;
  const int in_base = (bits & 511u) == 0u;
  b.stride_y =
      ((in_base ? (vdvr_u32)grid.cells_x : (vdvr_u32)grid.granularity << b.level_x) >> grid.coarse_x) + 1u;
  b.stride_z =
      b.stride_y *
      (((in_base ? (vdvr_u32)grid.cells_y : (vdvr_u32)grid.granularity << b.level_y) >> grid.coarse_y) + 1u);
  b.scale = grid.step * (float)(1 << (bits >> 12 & 31u));
  b.bias = grid.step * (float)offset;
  return b;
}

// The offset of a compact record: its 15 high bits, with their sign.
VDVR_INLINE vdvr_i32 vdvr_compact_offset(vdvr_u32 bits) {
  return ((vdvr_i32)((bits >> 17) ^ 0x4000u) - 0x4000) * (1 << (bits >> 12 & 31u));
}

// The record r of the given kind.
VDVR_INLINE VdvrBrick vdvr_record(VDVR_GLOBAL const vdvr_u32* r, int kind, VdvrGrid grid) {
  if (kind == VDVR_RECORDS_COMPACT) return vdvr_unpack(r[0], r[1], vdvr_compact_offset(r[1]), grid);
  return vdvr_unpack((vdvr_u64)(r[1] >> 17) << 32 | r[0], r[1],
                     kind == VDVR_RECORDS_WIDE ? (vdvr_i32)r[2] : 0, grid);
}

VDVR_INLINE VdvrBrick vdvr_brick(VDVR_GLOBAL const vdvr_u32* records, VdvrGrid grid, vdvr_u64 brick) {
  return vdvr_record(records + brick * VDVR_BRICK_WORDS, VDVR_RECORDS, grid);
}

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

// 2^n, -126 <= n <= 127.
VDVR_INLINE float vdvr_power_of_two(vdvr_i32 n) { return VDVR_AS_FLOAT((vdvr_i32)(127 + n) * (1 << 23)); }

// Samples of a level per cell of the grid: a power of two.
VDVR_INLINE float vdvr_per_cell(vdvr_u32 level, vdvr_i32 coarse) {
  return vdvr_power_of_two((vdvr_i32)level - coarse);
}

// The local coordinate of c in brick b of the given level; c may lie on the brick's far face.
VDVR_INLINE VdvrLocal vdvr_local(float c, vdvr_i32 b, vdvr_u32 level, vdvr_i32 granularity, vdvr_i32 cells,
                                 vdvr_i32 coarse) {
  const vdvr_i32 first = b * granularity;
  const vdvr_i32 width = cells - first < granularity ? cells - first : granularity;
  const vdvr_i32 last = (width << level) >> coarse;
  const float r = (c - (float)first) * vdvr_per_cell(level, coarse);
  VdvrLocal l;
  l.index = (vdvr_i32)r;  // as in vdvr_brick_of
  l.index = l.index < 0 ? 0 : (l.index > last - 1 ? last - 1 : l.index);
  l.fraction = r - (float)l.index;
  return l;
}

// Stored samples are decoded one by one, exactly, and interpolated after that: bricks that hold the same
// samples in other types or on other offsets give the same bits.
#define VDVR_AS_IS(stored) (stored)
#define VDVR_DECODED(stored) ((float)(stored)*scale + bias)
// vdvr_bilinear_*: in the lower z face of the cell whose lowest sample is s[0]: x first, then y.
// vdvr_trilinear_*: in that cell: x first, then y, then z.
#define VDVR_DEFINE_INTERPOLATION(NAME, TYPE, READ)                                                        \
  VDVR_INLINE float vdvr_bilinear_##NAME(VDVR_GLOBAL const TYPE* s, vdvr_u32 stride_y, float scale,        \
                                         float bias, float fx, float fy) {                                 \
    (void)scale, (void)bias;                                                                               \
    return vdvr_lerp(vdvr_lerp(READ(s[0]), READ(s[1]), fx),                                                \
                     vdvr_lerp(READ(s[stride_y]), READ(s[stride_y + 1]), fx), fy);                         \
  }                                                                                                        \
  VDVR_INLINE float vdvr_trilinear_##NAME(VDVR_GLOBAL const TYPE* s, vdvr_u32 stride_y, vdvr_u32 stride_z, \
                                          float scale, float bias, float fx, float fy, float fz) {         \
    return vdvr_lerp(vdvr_bilinear_##NAME(s, stride_y, scale, bias, fx, fy),                               \
                     vdvr_bilinear_##NAME(s + stride_z, stride_y, scale, bias, fx, fy), fz);               \
  }
VDVR_DEFINE_INTERPOLATION(f32, float, VDVR_AS_IS)
VDVR_DEFINE_INTERPOLATION(u16, vdvr_u16, VDVR_DECODED)
VDVR_DEFINE_INTERPOLATION(u8, vdvr_u8, VDVR_DECODED)

// Bilinear interpolation among a brick's samples of z index `z`.
VDVR_INLINE float vdvr_sample_in_plane(VDVR_GLOBAL const void* samples, VdvrBrick b, VdvrLocal x, VdvrLocal y,
                                       vdvr_i32 z) {
  const vdvr_u64 i = b.place + (vdvr_u64)z * b.stride_z + (vdvr_u64)y.index * b.stride_y + (vdvr_u64)x.index;
  if (VDVR_HOLDS(b, VDVR_F32))
    return vdvr_bilinear_f32((VDVR_GLOBAL const float*)samples + i, b.stride_y, b.scale, b.bias, x.fraction,
                             y.fraction);
  if (VDVR_HOLDS(b, VDVR_U16))
    return vdvr_bilinear_u16((VDVR_GLOBAL const vdvr_u16*)samples + i, b.stride_y, b.scale, b.bias,
                             x.fraction, y.fraction);
  return vdvr_bilinear_u8((VDVR_GLOBAL const vdvr_u8*)samples + i, b.stride_y, b.scale, b.bias, x.fraction,
                          y.fraction);
}

// The field at a cell coordinate of a known brick.
VDVR_INLINE float vdvr_sample_in_brick(VDVR_GLOBAL const void* samples, VdvrBrick b, VdvrLocal x, VdvrLocal y,
                                       VdvrLocal z) {
  const vdvr_u64 i =
      b.place + (vdvr_u64)z.index * b.stride_z + (vdvr_u64)y.index * b.stride_y + (vdvr_u64)x.index;
  if (VDVR_HOLDS(b, VDVR_F32))
    return vdvr_trilinear_f32((VDVR_GLOBAL const float*)samples + i, b.stride_y, b.stride_z, b.scale, b.bias,
                              x.fraction, y.fraction, z.fraction);
  if (VDVR_HOLDS(b, VDVR_U16))
    return vdvr_trilinear_u16((VDVR_GLOBAL const vdvr_u16*)samples + i, b.stride_y, b.stride_z, b.scale,
                              b.bias, x.fraction, y.fraction, z.fraction);
  return vdvr_trilinear_u8((VDVR_GLOBAL const vdvr_u8*)samples + i, b.stride_y, b.stride_z, b.scale, b.bias,
                           x.fraction, y.fraction, z.fraction);
}

#endif
