// The field of mixed_sampler.h read through the texture unit: one 3D image (atlas) per sample type holds the
// base volume and tiles of that type. A brick's record names the texel of its first sample. Same bricks, same
// local coordinates, same weights up to the unit's own precision, which the certificate charges as its
// image3d sampler term (docs/error-bounds.md). OpenCL only, with VDVR_SAMPLER_IMAGE3D. Included by
// raycast.cl.
#ifndef VDVR_MIXED_IMAGE_H
#define VDVR_MIXED_IMAGE_H
#if defined(VDVR_DIALECT_OPENCL) && defined(VDVR_SAMPLER_IMAGE3D)

// Clamping to the edge never decides a value: local coordinates stay inside the brick's own texels.
__constant sampler_t vdvr_linear =
    CLK_NORMALIZED_COORDS_FALSE | CLK_ADDRESS_CLAMP_TO_EDGE | CLK_FILTER_LINEAR;

// Texel coordinate of c along one axis. Clamped to the brick's own samples, so that a rounding error at its
// face cannot read the texel of a neighbouring tile.
VDVR_INLINE float vdvr_texel(float c, vdvr_i32 b, vdvr_u32 level, vdvr_i32 granularity, vdvr_i32 cells,
                             vdvr_i32 coarse, float texel) {
  const vdvr_i32 first = b * granularity;
  const vdvr_i32 width = cells - first < granularity ? cells - first : granularity;
  const float r = (c - (float)first) * vdvr_per_cell(level, coarse);
  const float last = (float)((width << level) >> coarse);
  return texel + (r < 0.0f ? 0.0f : (r > last ? last : r));
}

// The texel of a brick's first sample, packed into its place: 15 bits x, 16 bits y, 16 bits z.
VDVR_INLINE float vdvr_image_sample_in_brick(__read_only image3d_t f32, __read_only image3d_t u16,
                                             __read_only image3d_t u8, const VdvrBrick* b, VdvrGrid grid,
                                             vdvr_i32 bx, vdvr_i32 by, vdvr_i32 bz, float cx, float cy,
                                             float cz) {
  const float x = vdvr_texel(cx, bx, b->level_x, grid.granularity, grid.cells_x, grid.coarse_x,
                             (float)(b->place & 0x7fffu) + 0.5f);
  const float y = vdvr_texel(cy, by, b->level_y, grid.granularity, grid.cells_y, grid.coarse_y,
                             (float)(b->place >> 15 & 0xffffu) + 0.5f);
  const float z = vdvr_texel(cz, bz, b->level_z, grid.granularity, grid.cells_z, grid.coarse_z,
                             (float)(b->place >> 31 & 0xffffu) + 0.5f);
  const float4 texel = (float4)(x, y, z, 0.0f);
  // The filter of a normalised format returns stored / largest.
  if (VDVR_HOLDS(*b, VDVR_F32)) return read_imagef(f32, vdvr_linear, texel).x;
  if (VDVR_HOLDS(*b, VDVR_U16))
    return read_imagef(u16, vdvr_linear, texel).x * (65535.0f * b->scale) + b->bias;
  return read_imagef(u8, vdvr_linear, texel).x * (255.0f * b->scale) + b->bias;
}

#endif
#endif
