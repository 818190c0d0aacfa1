// The weights of device/eight_points.h, for eight_points_test.cpp, which puts this text behind that header.
// Layouts: float places[item]; float weights[item][8].
__kernel void weigh(__global const float* places, __global float* weights, int items) {
  const int i = (int)get_global_id(0);
  if (i < items) vstore8(lagrange(places[i]), i, weights);
}
