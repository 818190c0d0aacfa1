// The largest lane of a vector. Included by classify.cl, node_slack.cl, measure.cl and verify_pieces.cl.
#ifndef VDVR_LARGEST_H
#define VDVR_LARGEST_H

static inline float largest_of_8(float8 v) {
  const float4 a = fmax(v.lo, v.hi);
  const float2 b = fmax(a.lo, a.hi);
  return fmax(b.x, b.y);
}
static inline float largest_of_16(float16 v) { return largest_of_8(fmax(v.lo, v.hi)); }

#endif
