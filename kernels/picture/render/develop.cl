// What the host takes of a picture: the bytes and the value of each pixel, four pixels to a work-item. On the
// host this takes longer than a GPU's picture. Layouts, of pixels in rows: float4 picture[n]; uchar4 rgb[3],
// float4 values[1] of each four. VDVR_NOTHING says where a pixel has no value: 0 nowhere, 1 where it is below
// 0 (a depth), 2 where it is not finite. Called by host/picture/render/frame.cpp.
#ifndef VDVR_NOTHING
#error "VDVR_NOTHING must be 0, 1 or 2"
#endif

// NaN becomes 0.
static inline uchar byte_of(float x) { return convert_uchar(x > 0.0f ? min(x, 1.0f) * 255.0f + 0.5f : 0.0f); }

static inline float value_of(float x) {
#if VDVR_NOTHING == 1
  return x < 0.0f ? as_float(0x7fc00000u) : x;
#elif VDVR_NOTHING == 2
  return isfinite(x) ? x : as_float(0x7fc00000u);
#else
  return x;
#endif
}

__kernel void develop(__global uchar4* restrict rgb, __global float4* restrict values,
                      __global const float4* restrict picture, int pixels) {
  const int i = (int)get_global_id(0);
  if (4 * i >= pixels) return;
  // The last four may be fewer.
  const float4 a = picture[4 * i], b = picture[min(4 * i + 1, pixels - 1)],
               c = picture[min(4 * i + 2, pixels - 1)], d = picture[min(4 * i + 3, pixels - 1)];
  rgb[3 * i] = (uchar4)(byte_of(a.x), byte_of(a.y), byte_of(a.z), byte_of(b.x));
  rgb[3 * i + 1] = (uchar4)(byte_of(b.y), byte_of(b.z), byte_of(c.x), byte_of(c.y));
  rgb[3 * i + 2] = (uchar4)(byte_of(c.z), byte_of(d.x), byte_of(d.y), byte_of(d.z));
  values[i] = (float4)(value_of(a.w), value_of(b.w), value_of(c.w), value_of(d.w));
}
