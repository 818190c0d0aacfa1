// What the kernels of the kept nodes of cone beam share: a view as the host gives it, and eight taps of a
// place.
#ifndef VDVR_CONE_TAPS_H
#define VDVR_CONE_TAPS_H
#include "device/lanes.h"
#include "shared/column_taps.h"

// As host/certify/kept/cone_tiles.cpp fills it.
typedef struct {
  REAL step_u[3], part_u;
  REAL step_v[3], part_v;
  REAL step_lambda[3], lambda;
  REAL whole_u, whole_v, unused[2];
} ConeView;

// Rounds what lies below 2^22 to the nearest whole number where it is added.
#define TO_WHOLE 12582912.0f

// Of taps -3 .. 4.
#define FIRST_OF(a, b, c) a
#define SECOND_OF(a, b, c) b
#define THIRD_OF(a, b, c) c
// A list becomes arguments where it is handed on: OpenCL C has no macros of any number of them.
#define TAKE(pick, list) pick(list)
#define TAP(pick, kind, tap) TAKE(pick, VDVR_EIGHT_##kind##_##tap)
#define LANES(a, b, c, d, sign) (float8)(a, b, c, d, sign(d), sign(c), sign(b), sign(a))
#define COEFFICIENTS(pick, kind, sign) \
  LANES(TAP(pick, kind, A), TAP(pick, kind, B), TAP(pick, kind, C), TAP(pick, kind, D), sign)
#define SAME(x) (x)
#define OPPOSITE(x) (-(x))
#define EVEN_OF(pick) COEFFICIENTS(pick, EVEN, SAME)
#define ODD_OF(pick) COEFFICIENTS(pick, ODD, OPPOSITE)

// The weights at g, whose square is s: in a vector type T, of coefficients that `widened` brings there.
#define TAPS(T, g, s, widened)                                                              \
  fma((T)(g),                                                                               \
      VDVR_TAPS_FUSED_HORNER(T, s, widened(ODD_OF(FIRST_OF)), widened(ODD_OF(SECOND_OF)),   \
                             widened(ODD_OF(THIRD_OF))),                                    \
      VDVR_TAPS_FUSED_HORNER(T, s, widened(EVEN_OF(FIRST_OF)), widened(EVEN_OF(SECOND_OF)), \
                             widened(EVEN_OF(THIRD_OF))))

static inline __attribute__((always_inline)) float8 taps(float g) {
  const float s = g * g;
  return TAPS(float8, g, s, SAME);
}

// What the four taps below four places have of even and of odd powers.
#define FOUR_OF(kind, pick) \
  ((float4)(TAP(pick, kind, A), TAP(pick, kind, B), TAP(pick, kind, C), TAP(pick, kind, D)))
#define FOUR_TIMES(four) (float16)(four, four, four, four)
#define HALF_TAPS(kind, s)                                                \
  VDVR_TAPS_FUSED_HORNER(float16, s, FOUR_TIMES(FOUR_OF(kind, FIRST_OF)), \
                         FOUR_TIMES(FOUR_OF(kind, SECOND_OF)), FOUR_TIMES(FOUR_OF(kind, THIRD_OF)))
#define EVEN_TAPS(s) HALF_TAPS(EVEN, s)
#define ODD_TAPS(s) HALF_TAPS(ODD, s)

// `left` and `right`: four columns each, weighed, in a vector type T; column(j) has the j-th of eight.
#define WEIGH_COLUMNS(T, weight, column)                                   \
  T left = (T)(weight.s0) * column(0), right = (T)(weight.s7) * column(7); \
  left = fma((T)(weight.s1), column(1), left);                             \
  right = fma((T)(weight.s6), column(6), right);                           \
  left = fma((T)(weight.s2), column(2), left);                             \
  right = fma((T)(weight.s5), column(5), right);                           \
  left = fma((T)(weight.s3), column(3), left);                             \
  right = fma((T)(weight.s4), column(4), right);

static inline __attribute__((always_inline)) float sum_of(float8 v) {
  const float4 four = v.lo + v.hi;
  const float2 two = four.lo + four.hi;
  return two.x + two.y;
}

#endif
