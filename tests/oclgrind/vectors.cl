// Kernels that read only what they wrote, and what Oclgrind 21.10 makes of them (docs/robustness.md):
//   oclgrind-kernel --uninitialized --build-options -cl-opt-disable upper_half.sim    reports a use of lane 3
//   oclgrind-kernel --uninitialized --build-options -cl-opt-disable joined.sim        crashes
// Our packets do both: any_lane16 halves vectors, TURN joins them (kernels/device/packet.h).
__kernel void upper_half(__global int* out) {
  const int16 whole = (int16)(1);
  const int8 half_of_it = whole.hi;
  if (half_of_it.s3 == 1) out[0] = 1;
}

__kernel void joined(__global int* out) {
  float4 low = (float4)(1.0f), high = (float4)(2.0f);  // not const: that folds the join away
  const float8 both = (float8)(low, high);
  out[0] = (int)both.s5;
}
