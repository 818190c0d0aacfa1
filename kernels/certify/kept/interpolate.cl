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

// Eight columns share each vector of weights, or four. Named sums, not arrays: compilers keep these in
// registers.
#define FOR_2(M) M(0) M(1)
#define FOR_3(M) FOR_2(M) M(2)
#define FOR_4(M) FOR_3(M) M(3)
#define FOR_8(M) FOR_4(M) M(4) M(5) M(6) M(7)
#define BEGIN_SUM(i) VEC sum##i = (VEC)(0.0f);
// Columns beyond the last repeat it and are not stored.
#define COLUMN(c)                                                          \
  __global const float* column##c = in + p.in_first + (size_t)y * s.in_y + \
                                    (size_t)min(x + c, p.columns_x - 1) * s.in_x + first_term[group];
#define ADD(c) sum##c = fma((VEC)(column##c[j]), w, sum##c);
#define BEGIN_TOTAL(c) VEC total##c = (VEC)(0.0f), rest##c = (VEC)(0.0f);
// What adding a run to the others rounds off is summed beside them (Knuth's TwoSum: additions alone).
#define TOTAL(c)                                          \
  {                                                       \
    const VEC t = total##c + sum##c, part = t - total##c; \
    rest##c += (total##c - (t - part)) + (sum##c - part); \
    total##c = t;                                         \
  }
#define PUT_COLUMN(c, v) \
  if (x + c < p.columns_x) STORE(v, target + c * s.out_x);
#define PUT_TOTAL(c) PUT_COLUMN(c, total##c + rest##c)
// Chains of a column, each of every so manieth term.
#define BEGIN_CHAINS(c) \
  VEC chain0##c = (VEC)(0.0f), chain1##c = chain0##c, chain2##c = chain0##c, chain3##c = chain0##c;
#define ADD_TO_0(c) chain0##c = fma((VEC)(column##c[j]), w, chain0##c);
#define ADD_TO_1(c) chain1##c = fma((VEC)(column##c[j + 1]), w, chain1##c);
#define ADD_TO_2(c) chain2##c = fma((VEC)(column##c[j + 2]), w, chain2##c);
#define ADD_TO_3(c) chain3##c = fma((VEC)(column##c[j + 3]), w, chain3##c);
#define ADD_TERM(i, FOR_COLUMNS)                            \
  {                                                         \
    const VEC w = LOAD(of_group + (size_t)j * 16 + (i)*16); \
    FOR_COLUMNS(ADD_TO_##i)                                 \
  }
#define PUT_2(c) PUT_COLUMN(c, chain0##c + chain1##c)
#define PUT_4(c) PUT_COLUMN(c, (chain0##c + chain1##c) + (chain2##c + chain3##c))

// out[y][x][16 group + i] = sum_j weights[group][j][i] in[y][x][first_term[group] + j], part by part, COLUMNS
// columns a work-item.
#define ALONG_Z(NAME, COLUMNS, SUMS)                                                                    \
  __kernel void NAME(__global float* out, __global const float* in, __global const float* weights,      \
                     __global const int* first_term, __global const VdvrColumns* parts, VdvrAlongZ s) { \
    const int z = (int)get_global_id(0) * VDVR_LANES, group = z / 16;                                   \
    const int part = (int)get_global_id(2) / s.columns_y;                                               \
    if (group >= s.groups || part >= s.parts) return;                                                   \
    const VdvrColumns p = parts[part];                                                                  \
    const int x = (int)get_global_id(1) * COLUMNS, y = (int)get_global_id(2) - part * s.columns_y;      \
    if (x >= p.columns_x || y >= p.columns_y) return;                                                   \
    __global const float* of_group = weights + (size_t)group * s.terms * 16 + z % 16;                   \
    __global float* target = out + p.out_first + (size_t)y * s.out_y + (size_t)x * s.out_x + z;         \
    SUMS                                                                                                \
  }

// Of many terms: in runs.
#define IN_RUNS                                             \
  FOR_8(COLUMN);                                            \
  FOR_8(BEGIN_TOTAL);                                       \
  for (int first = 0; first < s.terms; first += VDVR_RUN) { \
    const int last = min(first + VDVR_RUN, s.terms);        \
    FOR_8(BEGIN_SUM);                                       \
    for (int j = first; j < last; ++j) {                    \
      const VEC w = LOAD(of_group + (size_t)j * 16);        \
      FOR_8(ADD);                                           \
    }                                                       \
    FOR_8(TOTAL);                                           \
  }                                                         \
  FOR_8(PUT_TOTAL);

// Of a narrow band: in chains of every other term, or of every fourth, so that each has its share of a
// filter's taps, wherever these begin. Terms of weight 0 change nothing.
#define IN_TWO_CHAINS                 \
  FOR_4(COLUMN);                      \
  FOR_4(BEGIN_CHAINS);                \
  int j = 0;                          \
  for (; j + 1 < s.terms; j += 2) {   \
    ADD_TERM(0, FOR_4)                \
    ADD_TERM(1, FOR_4)                \
  }                                   \
  if (j < s.terms) ADD_TERM(0, FOR_4) \
  FOR_4(PUT_2);
#define IN_FOUR_CHAINS                    \
  FOR_3(COLUMN);                          \
  FOR_3(BEGIN_CHAINS);                    \
  int j = 0;                              \
  for (; j + 3 < s.terms; j += 4) {       \
    ADD_TERM(0, FOR_3)                    \
    ADD_TERM(1, FOR_3)                    \
    ADD_TERM(2, FOR_3)                    \
    ADD_TERM(3, FOR_3)                    \
  }                                       \
  if (j < s.terms) ADD_TERM(0, FOR_3)     \
  if (j + 1 < s.terms) ADD_TERM(1, FOR_3) \
  if (j + 2 < s.terms) ADD_TERM(2, FOR_3) \
  FOR_3(PUT_4);

ALONG_Z(along_z, 8, IN_RUNS)
ALONG_Z(along_z_in_two, 4, IN_TWO_CHAINS)
ALONG_Z(along_z_in_four, 3, IN_FOUR_CHAINS)

// --- across z ---

#ifndef VDVR_TAPS
#error "VDVR_TAPS must be the taps of the filters across z"
#endif
// Kept columns of a row that lies between two of the kept ones, four at a time, which share the weights.
#define BEGIN_COLUMN(i)     \
  VEC sum##i = (VEC)(0.0f); \
  __global const float* column##i = from + (size_t)min(first + x + i, s.kept_x - 1) * s.in_x;
#define ADD_ROW(i) sum##i = fma(w, LOAD(column##i + row), sum##i);
#define KEEP_COLUMN(i) own[(x + i) * group] = sum##i;
static inline ALWAYS_INLINE void along_y(__local VEC* own, int group, __global const float* in,
                                         __global const float* weights, int y, int first, int columns,
                                         VdvrAcross s) {
  const int position = y + s.skipped_y, interval = position / s.phases_y,
            phase = position - interval * s.phases_y;
  __global const float* from = in + (size_t)interval * s.step_y * s.in_y;
  if (phase == 0) {
    from += (size_t)(VDVR_TAPS / 2 - 1) * s.in_y;
    for (int x = 0; x < columns; ++x)
      own[x * group] = LOAD(from + (size_t)min(first + x, s.kept_x - 1) * s.in_x);
    return;
  }
  __global const float* of_phase = weights + (phase - 1) * VDVR_TAPS;
  for (int x = 0; x < columns; x += 4) {
    FOR_4(BEGIN_COLUMN)
    for (int t = 0; t < VDVR_TAPS; ++t) {
      const VEC w = (VEC)(of_phase[t]);
      const size_t row = (size_t)t * s.in_y;
      FOR_4(ADD_ROW)
    }
    FOR_4(KEEP_COLUMN)
  }
}

// SUMS nodes at once, of PHASES phases in each interval, which share what they read.
#define ADD_TAP(i) \
  sum##i = fma((VEC)(w[i % phases_at_once * VDVR_TAPS + t]), from[(t + i / phases_at_once) * group], sum##i);
#define PUT_NODE(i) put_node(target, sum##i, x + i / phases_at_once, end, p + i % phases_at_once, s);
static inline ALWAYS_INLINE void put_node(__global float* target, VEC v, int interval, int end, int phase,
                                          VdvrAcross s) {
  const int n = interval * s.phases_x + phase - s.skipped_x;
  if (interval < end && phase < s.phases_x && n >= 0 && n < s.outputs_x)
    STORE(v, target + (size_t)n * s.out_x);
}

// A row of nodes of gold, or `chunk` of its intervals: first its kept columns, into local memory, where each
// work-item has places of its own, then the nodes between these. An interval lies between the two middle ones
// of its inputs, and its first node is the first of these itself.
#define ACROSS(PHASES, SUMS, FOR_SUMS)                                                                       \
  __kernel void across_##PHASES(__global float* out, __global const float* in,                               \
                                __global const float* weights_x, __global const float* weights_y,            \
                                VdvrAcross s, __local VEC* room) {                                           \
    const int phases_at_once = PHASES;                                                                       \
    const int z = (int)get_global_id(0) * VDVR_LANES, y = (int)get_global_id(1),                             \
              box = (int)get_global_id(2) / s.chunks,                                                        \
              first = ((int)get_global_id(2) - box * s.chunks) * s.chunk;                                    \
    if (z >= s.z || y >= s.outputs_y || box >= s.boxes) return;                                              \
    const int group = (int)(get_local_size(0) * get_local_size(1) * get_local_size(2));                      \
    __local VEC* own = room + ((get_local_id(2) * get_local_size(1) + get_local_id(1)) * get_local_size(0) + \
                               get_local_id(0));                                                             \
    along_y(own, group, in + (size_t)box * s.in_box + z, weights_y, y, first * s.step_x, s.columns, s);      \
    __global float* target = out + s.out_first + (size_t)box * s.out_box + (size_t)y * s.out_y + z;          \
    const int end = min(first + s.chunk, s.intervals_x);                                                     \
    for (int x = first; x < end; x += SUMS / PHASES) {                                                       \
      const __local VEC* from = own + (x - first) * s.step_x * group;                                        \
      for (int i = 0; i < SUMS / PHASES; ++i)                                                                \
        put_node(target, from[(VDVR_TAPS / 2 - 1 + i * s.step_x) * group], x + i, end, 0, s);                \
      for (int p = 1; p < s.phases_x; p += PHASES) {                                                         \
        __global const float* w = weights_x + (p - 1) * VDVR_TAPS;                                           \
        FOR_SUMS(BEGIN_SUM)                                                                                  \
        for (int t = 0; t < VDVR_TAPS; ++t) {                                                                \
          FOR_SUMS(ADD_TAP)                                                                                  \
        }                                                                                                    \
        FOR_SUMS(PUT_NODE)                                                                                   \
      }                                                                                                      \
    }                                                                                                        \
  }
ACROSS(1, 2, FOR_2)
ACROSS(3, 3, FOR_3)
ACROSS(4, 4, FOR_4)
