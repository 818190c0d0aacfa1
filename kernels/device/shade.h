// Light on a point of a picture. Included by raycast_dvr.h.
#ifndef VDVR_SHADE_H
#define VDVR_SHADE_H

// 1: lights that stand still; else only the one at the eye.
#ifndef VDVR_FIXED_LIGHTS
#define VDVR_FIXED_LIGHTS 0
#endif

RAY_INLINE V to_the_24th(V x) {
  const V x2 = x * x, x4 = x2 * x2, x8 = x4 * x4;
  return x8 * x8 * x8;
}

#if VDVR_FIXED_LIGHTS
typedef struct {
  V diffuse, highlight;
} Light;
// Of all lights together on a surface that faces the eye along `normal`, unit length.
RAY_INLINE Light light_on(const VdvrRaycast* p, V3 normal, V3 view) {
  const V none = (V)(0.0f);
  const V facing = -dot3(normal, view);
  Light sum = {none, none};
  if (p->head_light) {
    sum.diffuse = facing;
    sum.highlight = to_the_24th(facing);
  }
  for (int i = 0; i < p->lights; ++i) {
    const V3 l = v3((V)(p->light[i][0]), (V)(p->light[i][1]), (V)(p->light[i][2]));
    const V cosine = dot3(normal, l);
    const I lit = cosine > 0.0f;
    sum.diffuse += PICK(lit, cosine, none);
    // Blinn: halfway between the light and the eye.
    const V3 half_way = v3(l.x - view.x, l.y - view.y, l.z - view.z);
    const V length2 = dot3(half_way, half_way);
    const V aligned = dot3(normal, half_way) / sqrt(MOST(length2, (V)(1e-12f)));
    sum.highlight += PICK(lit & (aligned > 0.0f), to_the_24th(aligned), none);
  }
  return sum;
}
#endif

// Phong, two-sided: a surface shows the eye its front. Where the gradient is weak its direction is noise:
// shading fades out there.
RAY_INLINE V3 shade(const VdvrRaycast* p, V3 rgb, V3 gradient, V3 view, float gradient_full) {
  const V magnitude = sqrt(dot3(gradient, gradient));
  const I known = magnitude > 0.0f;
  const V none = (V)(0.0f), one = (V)(1.0f);
  const V strength = gradient_full > 0.0f ? LEAST(magnitude / gradient_full, one) : PICK(known, one, none);
  const V along = dot3(gradient, view);
#if VDVR_FIXED_LIGHTS
  const V towards = PICK(along > 0.0f, -one, one) / PICK(known, magnitude, one);
  const Light light = light_on(p, scaled(gradient, towards), view);
  const V lit = 1.0f + strength * ((0.25f + p->light_share * light.diffuse) - 1.0f);
  const V highlight = 0.2f * strength * light.highlight;
#else
  const V facing = PICK(known, LEAST(fabs(along) / PICK(known, magnitude, one), one), one);
  const V lit = 1.0f + strength * ((0.25f + 0.75f * facing) - 1.0f);
  const V highlight = 0.2f * strength * to_the_24th(facing);
#endif
  return v3(rgb.x * lit + highlight, rgb.y * lit + highlight, rgb.z * lit + highlight);
}

#endif
