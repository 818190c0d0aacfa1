// The weights of device/eight_points.h, for eight_points_test.cpp, which puts this text behind that header.
// Layouts: float places[item]; float weights[item][8], by themselves, then two items at a time.
__kernel void weigh(__global const float* places, __global float* weights, int items) {
  const int i = (int)get_global_id(0), pair = i / 2 * 2;
  if (i >= items) return;
  vstore8(lagrange(places[i]), i, weights);
  const float16 of_two = lagrange_of_two((float16)((float8)(places[pair]), (float8)(places[pair + 1])));
  vstore8(i == pair ? of_two.lo : of_two.hi, items + i, weights);
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
