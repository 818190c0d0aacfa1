// The field of mixed_sampler.h read through the texture unit: one 3D image (the atlas) holds the base volume
// and all tiles, a brick's first sample at texel centre (texel_x, texel_y, texel_z). Same bricks, same local
// coordinates, same weights up to the unit's own precision, which the certificate charges as its image3d
// sampler term (docs/error-bounds.md). OpenCL only, with VDVR_SAMPLER_IMAGE3D. Included by raycast.cl.
#ifndef VDVR_MIXED_IMAGE_H
#define VDVR_MIXED_IMAGE_H
#if defined(VDVR_DIALECT_OPENCL) && defined(VDVR_SAMPLER_IMAGE3D)

// Clamping to the edge never decides a value: local coordinates stay inside the brick's own texels.
__constant sampler_t vdvr_linear =
    CLK_NORMALIZED_COORDS_FALSE | CLK_ADDRESS_CLAMP_TO_EDGE | CLK_FILTER_LINEAR;

// Texel coordinate of c along one axis. Clamped to the brick's own samples, so that a rounding error at its
// face cannot read the texel of a neighbouring tile.
VDVR_INLINE float vdvr_texel(float c, vdvr_i32 b, vdvr_u32 level, vdvr_i32 granularity, vdvr_i32 cells,
                             float texel) {
  const vdvr_i32 first = b * granularity;
  const vdvr_i32 width = cells - first < granularity ? cells - first : granularity;
  const float r = (c - (float)first) * (float)(1 << level);
  const float last = (float)(width << level);
  return texel + (r < 0.0f ? 0.0f : (r > last ? last : r));
}

VDVR_INLINE float vdvr_image_sample_in_brick(__read_only image3d_t atlas, const VdvrBrick* b, VdvrGrid grid,
                                             vdvr_i32 bx, vdvr_i32 by, vdvr_i32 bz, float cx, float cy,
                                             float cz) {
  const float x = vdvr_texel(cx, bx, b->level_x, grid.granularity, grid.cells_x, b->texel_x);
  const float y = vdvr_texel(cy, by, b->level_y, grid.granularity, grid.cells_y, b->texel_y);
  const float z = vdvr_texel(cz, bz, b->level_z, grid.granularity, grid.cells_z, b->texel_z);
  return read_imagef(atlas, vdvr_linear, (float4)(x, y, z, 0.0f)).x;
}

#endif
#endif
