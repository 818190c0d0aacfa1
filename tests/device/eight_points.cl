// The weights of device/eight_points.h, for eight_points_test.cpp, which puts this text behind that header.
// Layouts: float places[item]; float weights[item][8], by themselves, then four items at a time.
__kernel void weigh(__global const float* places, __global float* weights, int items) {
  const int i = (int)get_global_id(0), first = i / 4 * 4;
  if (i >= items) return;
  vstore8(lagrange(places[i]), i, weights);
  const float4 four = vload4(0, places + first);
  float16 low, high;
  lagrange_of_four(four.s0000111122223333, &low, &high);
  const float4 below[4] = {low.s0123, low.s4567, low.s89ab, low.scdef},
               above[4] = {high.s3210, high.s7654, high.sba98, high.sfedc};
  vstore8((float8)(below[i - first], above[i - first]), items + i, weights);
}

// weights[n][place]: what is added where point n alone is 1.
#define POINT(j) (float8)(j == n ? 1.0f : 0.0f)
__kernel void weigh_rows(__global const float* g, __global float* weights, int items) {
  const int i = (int)get_global_id(0);
  if (i >= items / 8) return;
  const float8 places = vload8(i, g);
  for (int n = 0; n < 8; ++n) {
    float8 sum = (float8)(0.0f);
    ADD_POINTS(sum, places, POINT)
    vstore8(sum, i, weights + n * items);
  }
}
