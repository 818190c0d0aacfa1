// The node test of every level on a block of gold samples (the paper's Eq. 10, per node), and the samples of chosen tiles.
// Layouts as in gold_bounds.cl. A brick is VDVR_GRANULARITY^3 base cells; level l samples every (rate >> l)-th gold node.
// Called by host/gold_stream.cpp.

#ifndef VDVR_BRICK_NODES
#error "VDVR_BRICK_NODES must be granularity * gold rate"
#endif
#if VDVR_BRICK_NODES < 16
#define SEGMENT VDVR_BRICK_NODES
#else
#define SEGMENT 16
#endif

// Gold at every `spacing`-th column, interpolated linearly along z from its every `spacing`-th node:
// along[block][y / spacing][x / spacing][stride].
__kernel void interpolate_columns(__global float* along, __global const float* gold, int nx, int ny, int nz, int gold_stride,
                                  int stride, int spacing, int blocks) {
  const int cx = (nx - 1) / spacing + 1, cy = (ny - 1) / spacing + 1;
  const int z = (int)get_global_id(0) * 16, x = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / cy, y = (int)get_global_id(2) - block * cy;
  if (z >= nz || x >= cx || block >= blocks) return;
  __global const float* from =
      gold + (((size_t)block * (ny + 2) + y * spacing + 1) * (nx + 2) + x * spacing + 1) * gold_stride + 1;
  __global float* to = along + (((size_t)block * cy + y) * cx + x) * stride;
  const float step = 1.0f / (float)spacing;
  for (int k = z; k < min(z + 16, nz); ++k) {
    const int below = k / spacing * spacing;
    const float f = (float)(k - below) * step;
    to[k] = below == k ? from[k] : (1.0f - f) * from[below] + f * from[below + spacing];
  }
}

// Raises error[block][brick z][brick y][brick x] to the largest |interpolant - gold| + slack of the brick's closed nodes.
// error starts negative: it stays so where no node of a brick is tested. Positive floats order as their bits do.
__kernel void level_error(volatile __global int* error, __global const float* along, __global const float* gold,
                          __global const float* slack, int nx, int ny, int nz, int gold_stride, int stride, int spacing,
                          int bricks_x, int bricks_y, int bricks_z, int blocks) {
  const int z = (int)get_global_id(0) * 16, x = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / ny, y = (int)get_global_id(2) - block * ny;
  if (z >= nz || x >= nx || block >= blocks) return;
  const int cx = (nx - 1) / spacing + 1, cy = (ny - 1) / spacing + 1;
  const int ix = min(x / spacing, cx - 2), iy = min(y / spacing, cy - 2);
  const float fx = (float)(x - ix * spacing) / (float)spacing, fy = (float)(y - iy * spacing) / (float)spacing;
  __global const float* a = along + (((size_t)block * cy + iy) * cx + ix) * stride + z;
  __global const float* b = a + (size_t)cx * stride;
  const float16 low = (1.0f - fx) * vload16(0, a) + fx * vload16(0, a + stride);
  const float16 high = (1.0f - fx) * vload16(0, b) + fx * vload16(0, b + stride);
  const float16 g = vload16(0, gold + (((size_t)block * (ny + 2) + y + 1) * (nx + 2) + x + 1) * gold_stride + z + 1);
  const float16 s = vload16(0, slack + (((size_t)block * ny + y) * nx + x) * stride + z);
  const float16 total = fabs((1.0f - fy) * low + fy * high - g) + s;

  float lanes[16];
  vstore16(total, 0, lanes);
  for (int first = 0; first < 16; first += SEGMENT) {
    const int k = z + first;
    if (k >= nz) break;
    float largest = lanes[first];
    for (int i = 1; i < SEGMENT; ++i) largest = k + i < nz ? fmax(largest, lanes[first + i]) : largest;
    // A node on a border belongs to the closed boxes of the bricks on both sides.
    const int bz = min(k / VDVR_BRICK_NODES, bricks_z - 1);
    for (int by = max((y - 1) / VDVR_BRICK_NODES, 0); by <= min(y / VDVR_BRICK_NODES, bricks_y - 1); ++by)
      for (int bx = max((x - 1) / VDVR_BRICK_NODES, 0); bx <= min(x / VDVR_BRICK_NODES, bricks_x - 1); ++bx) {
        volatile __global int* e = error + (((size_t)block * bricks_z + bz) * bricks_y + by) * bricks_x + bx;
        if (largest >= 0.0f) atomic_max(e, as_int(largest));
        if (k % VDVR_BRICK_NODES == 0 && k > 0 && k / VDVR_BRICK_NODES == bz && lanes[first] >= 0.0f)
          atomic_max(e - (size_t)bricks_y * bricks_x, as_int(lanes[first]));
      }
  }
}

// Copies the samples of tiles out of gold: request i writes tile samples float[sz][sy][sx] at `offset`.
typedef struct {
  int block, node_x, node_y, node_z;      // of the brick's first node in its block
  int spacing_x, spacing_y, spacing_z;    // in gold nodes
  int side_x, side_y, side_z;             // samples
  int last_x, last_y, last_z;             // last node of the grid inside the block: beyond it planes repeat
  int pad;
  ulong offset;
} TileRequest;

__kernel void extract_tiles(__global float* out, __global const float* gold, __global const float* margin,
                            __global const TileRequest* requests, int count, int nx, int ny, int gold_stride, float kept) {
  const int i = (int)get_global_id(0), request = (int)get_global_id(1);
  if (request >= count) return;
  const TileRequest r = requests[request];
  if (i >= r.side_x * r.side_y * r.side_z) return;
  const int ix = i % r.side_x, iy = i / r.side_x % r.side_y, iz = i / r.side_x / r.side_y;
  const int x = min(r.node_x + ix * r.spacing_x, r.last_x), y = min(r.node_y + iy * r.spacing_y, r.last_y);
  const int z = min(r.node_z + iz * r.spacing_z, r.last_z);
  const bool keep = margin[((size_t)r.block * ny + y) * nx + x] >= kept;
  out[r.offset + i] = keep ? gold[(((size_t)r.block * (ny + 2) + y + 1) * (nx + 2) + x + 1) * gold_stride + z + 1] : 0.0f;
}
