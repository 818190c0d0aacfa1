// The ray-caster's program with points for rays: one_sampler_test.cpp puts this text behind that of
// raycast.cl, built as the ray-caster builds it.
//
// Layout: points[group][step][16] in cells. A lane takes the steps of its slot in order, and a packet keeps
// its bricks open until one of its lanes leaves its own, as rays do.

#define SLOTS 16

__kernel VDVR_HINT void sample_points(FIELD, BRICKS, VdvrGrid grid, __global const float4* restrict points,
                                      int groups, int steps, __global float* restrict values) {
  const int packets = SLOTS / VDVR_LANES, item = (int)get_global_id(0);
  const int group = item / packets, first = item % packets * VDVR_LANES;
  if (group >= groups) return;
  OpenBrick brick = no_brick();
  for (int step = 0; step < steps; ++step) {
    const int at = (group * steps + step) * SLOTS + first;
    V3 c;
#define POINT(n)                         \
  {                                      \
    const float4 p = points[at + 0x##n]; \
    LANE(c.x, n) = p.x;                  \
    LANE(c.y, n) = p.y;                  \
    LANE(c.z, n) = p.z;                  \
  }
    EACH(POINT)
#undef POINT
    c = clamp_to_grid(c, grid);
    if (ANY(NOT(is_inside(&brick, c)))) brick = open_brick(bricks, grid, brick_at(grid, c));
    const V value = sample_open(THE_FIELD, &brick, grid, c).value;
#define PUT_VALUE(n) values[at + 0x##n] = LANE(value, n);
    EACH(PUT_VALUE)
#undef PUT_VALUE
  }
}

#if !VDVR_LIT
float within(float c, int cells) { return c < 0.0f ? 0.0f : (c > (float)cells ? (float)cells : c); }

// The definition, on the device: as sample_at has it, and as the kernels that measure have it, plane by
// plane.
__kernel void define_points(FIELD, BRICKS, VdvrGrid grid, __global const float4* restrict points, int count,
                            __global float* restrict values, __global float* restrict by_planes) {
  const int i = (int)get_global_id(0);
  if (i >= count) return;
  const float cx = within(points[i].x, grid.cells_x), cy = within(points[i].y, grid.cells_y),
              cz = within(points[i].z, grid.cells_z);
  const int bx = vdvr_brick_of(cx, grid.granularity, grid.bricks_x);
  const int by = vdvr_brick_of(cy, grid.granularity, grid.bricks_y);
  const int bz = vdvr_brick_of(cz, grid.granularity, grid.bricks_z);
  const VdvrBrick b = vdvr_brick(bricks, grid, ((ulong)bz * grid.bricks_y + by) * grid.bricks_x + bx);
  const VdvrLocal x = vdvr_local(cx, bx, b.level_x, grid.granularity, grid.cells_x, grid.coarse_x);
  const VdvrLocal y = vdvr_local(cy, by, b.level_y, grid.granularity, grid.cells_y, grid.coarse_y);
  const VdvrLocal z = vdvr_local(cz, bz, b.level_z, grid.granularity, grid.cells_z, grid.coarse_z);
  values[i] = vdvr_sample_in_brick(field, b, x, y, z);
  by_planes[i] = vdvr_lerp(vdvr_sample_in_plane(field, b, x, y, z.index),
                           vdvr_sample_in_plane(field, b, x, y, z.index + 1), z.fraction);
}
#endif
