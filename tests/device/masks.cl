// What device/masks.h says of masks, for masks_test.cpp, which puts this text behind device/lanes.h.
// Layouts: float values[item][lane]; int said[item][3] = any, all and none of its lanes above the limit;
// float picked[item][lane]: 1 above the limit, 2 else.
__kernel void ask(__global const float* values, float limit, __global int* said, __global float* picked,
                  int items) {
  const int i = (int)get_global_id(0);
  if (i >= items) return;
  const VEC v = LOAD(values + i * VDVR_LANES), one = (VEC)(1.0f), two = (VEC)(2.0f);
  said[3 * i] = ANY(v > limit);
  said[3 * i + 1] = ALL(v > limit);
  said[3 * i + 2] = ALL(NOT(v > limit));
  STORE(PICK(v > limit, one, two), picked + i * VDVR_LANES);
}
