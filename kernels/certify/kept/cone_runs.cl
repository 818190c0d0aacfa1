// Kept nodes of cone beam where all detectors stand upright: u, lambda and the weights of six columns belong
// to a whole column of nodes. They are weighted and summed once for the rows that a run of heights reads, a
// strip, and each height takes six of its rows (docs/error-bounds.md, section 16). Layouts as in
// cone_nodes.cl. A work-item does a run of heights of some rows of nodes: what these read of some views stays
// in the caches. Called by host/certify/kept/cone_tiles.cpp.
#define VDVR_LANES 8
#include "device/lanes.h"
#include "shared/cone_nodes.h"
#include "shared/six_taps.h"
#include "device/cone_taps.h"

#define RUN VDVR_CONE_RUN
// Views whose strips are made together; heights of a vector.
#define TOGETHER 4
#define HEIGHTS 8
#define GROUPS (RUN / HEIGHTS)
#define STRIP VDVR_CONE_STRIP

#define FLOOR8(i, v) ((i) + (convert_float8(i) > (v)))

#define COLUMN(j) (*(__global const float16*)(from + (size_t)(j)*column_stride))

#define CLEAR(n) float8 sum##n = (float8)(0.0f);
#define ADD(n) sum##n = fma(taps(g[n]), vload8(0, strip + row[n]), sum##n);
#define PUT(n) to[n] += sum_of(sum##n);

__kernel void cone_runs(__global float* out, __global const float* table, __global const ConeView* views,
                        __global const int2* wanted, ulong first, VdvrConeNodes s) {
  const int part = (int)get_global_id(0), height = (int)get_global_id(1) * RUN, tile = (int)get_global_id(2),
            first_y = part * VDVR_CONE_ROWS, groups = min(s.groups - height / HEIGHTS, GROUPS);
  if (first_y >= VDVR_CONE_TILE || groups <= 0 || tile >= s.tiles) return;
  const int column_stride = s.column_stride, views_all = s.views;
  const float half_side = 0.5f * (float)(VDVR_CONE_TILE - 1);
  const double dz = (double)height - 0.5 * (double)(s.groups * HEIGHTS - 1);
  __global const ConeView* of_tile = views + (size_t)tile * views_all;
  float sums[VDVR_CONE_ROWS * VDVR_CONE_TILE * RUN];
  for (int i = 0; i < VDVR_CONE_ROWS * VDVR_CONE_TILE * RUN; i += 16) vstore16((float16)(0.0f), 0, sums + i);
  float16 strips[TOGETHER * STRIP / 16];
  float shares[TOGETHER * RUN];
  int rows[TOGETHER * RUN];
  for (int k = 0; k < views_all; k += TOGETHER) {
    const int together = min(TOGETHER, views_all - k);
    for (int y = 0; y < VDVR_CONE_ROWS; ++y) {
      const int2 range = wanted[tile * VDVR_CONE_TILE + first_y + y];
      const double dy = (double)(first_y + y) - half_side;
      for (int x = range.x; x <= range.y; ++x) {
        const double dx = (double)x - half_side;
        for (int i = 0; i < together; ++i) {
          __global const ConeView* v = of_tile + k + i;
          const double inverse = 1.0 / (fma(v->step_lambda[0], dx, v->step_lambda[1] * dy) + v->lambda),
                       u = fma(fma(v->step_u[0], dx, v->step_u[1] * dy), inverse, v->part_u),
                       slope = v->step_v[2] * inverse,
                       row0 = fma(fma(v->step_v[2], dz, fma(v->step_v[0], dx, v->step_v[1] * dy)), inverse,
                                  v->part_v);
          int whole_u = (int)u;
          whole_u -= (double)whole_u > u;
          const int column = clamp((int)v->whole_u + whole_u - 2, 0, s.last_column);
          const float8 weight = (float)(inverse * inverse) * taps((float)(u - (double)whole_u - 0.5));
          // Rows of the strip: one more either side than those of its ends in double precision.
          const double end = fma(slope, (double)(groups * HEIGHTS - 1), row0);
          const int whole_v = (int)v->whole_v - 2,
                    low = clamp(whole_v + (int)min(row0, end) - 2, 0, s.last_row) & ~15,
                    chunks =
                        min((clamp(whole_v + (int)max(row0, end) + 2, 0, s.last_row) - low + 8 + 15) / 16,
                            STRIP / 16);
          {
            __global const float* from =
                table + (size_t)(k + i) * s.plane + (size_t)column * column_stride + low;
            float16* to = strips + i * (STRIP / 16);
            for (int c = 0; c < chunks; ++c, from += 16, ++to) {
              float16 across = (float16)(weight.s1) * COLUMN(1);
              across = fma((float16)(weight.s0), COLUMN(0), across);
              across = fma((float16)(weight.s2), COLUMN(2), across);
              across = fma((float16)(weight.s3), COLUMN(3), across);
              across = fma((float16)(weight.s4), COLUMN(4), across);
              across = fma((float16)(weight.s5), COLUMN(5), across);
              *to = across;
            }
          }
          const double4 middle = fma((double4)(slope), (double4)(3.5, 11.5, 19.5, 27.5), (double4)(row0));
          const int4 whole = convert_int4(middle);
          const float4 beyond = convert_float4(middle - convert_double4(whole));
          const int last = chunks * 16 - 8;
          float wh[4];
          int wi[4];
          vstore4(beyond, 0, wh);
          vstore4(whole + whole_v - low, 0, wi);
          for (int j = 0; j < GROUPS; ++j) {
            const float8 at =
                fma((float8)((float)slope), (float8)(-3.5f, -2.5f, -1.5f, -0.5f, 0.5f, 1.5f, 2.5f, 3.5f),
                    (float8)(wh[j]));
            int8 cut = convert_int8(at);
            cut = FLOOR8(cut, at);
            vstore8(at - convert_float8(cut) - 0.5f, 0, shares + i * RUN + j * HEIGHTS);
            vstore8(clamp(cut + wi[j], (int8)(0), (int8)(last)), 0, rows + i * RUN + j * HEIGHTS);
          }
        }
        for (int j = 0; j < groups; ++j) {
          FOR_LANES(CLEAR)
          for (int i = 0; i < together; ++i) {
            const float* strip = (const float*)(strips + i * (STRIP / 16));
            const float* g = shares + i * RUN + j * HEIGHTS;
            const int* row = rows + i * RUN + j * HEIGHTS;
            FOR_LANES(ADD)
          }
          float* to = sums + (y * VDVR_CONE_TILE + x) * RUN + j * HEIGHTS;
          FOR_LANES(PUT)
        }
      }
    }
  }
  for (int y = 0; y < VDVR_CONE_ROWS; ++y) {
    const int2 range = wanted[tile * VDVR_CONE_TILE + first_y + y];
    for (int x = range.x; x <= range.y; ++x) {
      __global float* to = out + first + (size_t)tile * s.tile +
                           ((size_t)(first_y + y) * VDVR_CONE_TILE + x) * s.stride + height;
      const float* from = sums + (y * VDVR_CONE_TILE + x) * RUN;
      for (int j = 0; j < groups * HEIGHTS; j += HEIGHTS)
        vstore8(vload8(0, to + j) + vload8(0, from + j), 0, to + j);
    }
  }
}
