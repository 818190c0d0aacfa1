// Gold from the nodes that determine it (docs/error-bounds.md, section 3): along z a product with few rows or
// with a band of them, across z filters of VDVR_TAPS taps, one program for all of their rates: PoCL takes
// tens of milliseconds for each that it has in its cache. Layouts: columns of contiguous heights, anywhere
// (shared/interpolate_gold.h). Called by host/certify/kept/interpolate_gold.cpp.
#include "device/lanes.h"
#include "shared/interpolate_gold.h"

#ifndef VDVR_RUN
#error "VDVR_RUN must be the terms of a run"
#endif
// --- along z ---

// Eight columns share each vector of weights. Named sums, not arrays: compilers keep these in registers.
#define FOR_COLUMNS(M) M(0) M(1) M(2) M(3) M(4) M(5) M(6) M(7)
// Columns beyond the last repeat it and are not stored.
#define COLUMN(c)                                                                                     \
  __global const float* column##c = in + p.in_first + (size_t)y * s.in_y +                            \
                                    (size_t)min(x + c, p.columns_x - 1) * s.in_x + first_term[group]; \
  VEC total##c = (VEC)(0.0f), rest##c = (VEC)(0.0f);
#define CLEAR(c) VEC sum##c = (VEC)(0.0f);
#define ADD(c) sum##c = fma((VEC)(column##c[j]), w, sum##c);
// What adding a run to the others rounds off is summed beside them (Knuth's TwoSum: additions alone).
#define TOTAL(c)                                          \
  {                                                       \
    const VEC t = total##c + sum##c, part = t - total##c; \
    rest##c += (total##c - (t - part)) + (sum##c - part); \
    total##c = t;                                         \
  }
#define PUT(c) \
  if (x + c < p.columns_x) STORE(total##c + rest##c, target + c * s.out_x);

// out[y][x][16 group + i] = sum_j weights[group][j][i] in[y][x][first_term[group] + j], part by part.
__kernel void along_z(__global float* out, __global const float* in, __global const float* weights,
                      __global const int* first_term, __global const VdvrColumns* parts, VdvrAlongZ s) {
  const int z = (int)get_global_id(0) * VDVR_LANES, group = z / 16;
  const int part = (int)get_global_id(2) / s.columns_y;
  if (group >= s.groups || part >= s.parts) return;
  const VdvrColumns p = parts[part];
  const int x = (int)get_global_id(1) * 8, y = (int)get_global_id(2) - part * s.columns_y;
  if (x >= p.columns_x || y >= p.columns_y) return;
  __global const float* of_group = weights + (size_t)group * s.terms * 16 + z % 16;
  FOR_COLUMNS(COLUMN)
  for (int first = 0; first < s.terms; first += VDVR_RUN) {
    const int last = min(first + VDVR_RUN, s.terms);
    FOR_COLUMNS(CLEAR)
    for (int j = first; j < last; ++j) {
      const VEC w = LOAD(of_group + (size_t)j * 16);
      FOR_COLUMNS(ADD)
    }
    FOR_COLUMNS(TOTAL)
  }
  __global float* target = out + p.out_first + (size_t)y * s.out_y + (size_t)x * s.out_x + z;
  FOR_COLUMNS(PUT)
}

// --- across z ---

#ifndef VDVR_TAPS
#error "VDVR_TAPS must be the taps of the filters across z"
#endif
// Named sums, not arrays, as above.
#define FOR_1(M) M(0)
#define FOR_3(M) M(0) M(1) M(2)
#define FOR_4(M) FOR_3(M) M(3)
#define FOR_5(M) FOR_4(M) M(4)
#define FOR_7(M) FOR_5(M) M(5) M(6)
#define BEGIN_SUM(i) VEC phase##i = (VEC)(0.0f);
#define ADD_TAP(i) phase##i = fma((VEC)(w[(i)*VDVR_TAPS + t]), v, phase##i);
#define PUT_PHASE(i)                                                                                  \
  {                                                                                                   \
    const int n = interval * phases + p + i - s.skipped;                                              \
    if (p + i < phases && n >= 0 && n < s.outputs) STORE(phase##i, target + (size_t)n * s.out_along); \
  }

// The nodes of an interval, which lies between the two middle ones of its inputs: the first of these itself,
// and the others by weights[phase - 1][tap], in whole groups of SUMS phases, which share what they
// read.
#define ACROSS(SUMS, FOR_SUMS)                                                                              \
  __kernel void across_##SUMS(__global float* out, __global const float* in, __global const float* weights, \
                              VdvrAcross s) {                                                               \
    const int z = (int)get_global_id(0) * VDVR_LANES, phases = s.phases;                                    \
    const int other = (int)get_global_id(1), box = (int)get_global_id(2) / s.intervals,                     \
              interval = (int)get_global_id(2) - box * s.intervals;                                         \
    if (z >= s.z || other >= s.others || box >= s.boxes) return;                                            \
    __global const float* from = in + s.in_first + (size_t)box * s.in_box +                                 \
                                 (size_t)interval * s.step * s.in_along + (size_t)other * s.in_other + z;   \
    __global float* target = out + s.out_first + (size_t)box * s.out_box + (size_t)other * s.out_other + z; \
    const int node = interval * phases - s.skipped;                                                         \
    if (node >= 0 && node < s.outputs)                                                                      \
      STORE(LOAD(from + (VDVR_TAPS / 2 - 1) * s.in_along), target + (size_t)node * s.out_along);            \
    for (int p = 1; p < phases; p += SUMS) {                                                                \
      __global const float* w = weights + (p - 1) * VDVR_TAPS;                                              \
      FOR_SUMS(BEGIN_SUM)                                                                                   \
      for (int t = 0; t < VDVR_TAPS; ++t) {                                                                 \
        const VEC v = LOAD(from + (size_t)t * s.in_along);                                                  \
        FOR_SUMS(ADD_TAP)                                                                                   \
      }                                                                                                     \
      FOR_SUMS(PUT_PHASE)                                                                                   \
    }                                                                                                       \
  }
ACROSS(1, FOR_1)
ACROSS(3, FOR_3)
ACROSS(4, FOR_4)
ACROSS(5, FOR_5)
ACROSS(7, FOR_7)
