// Lagrange's weights of eight points, as `verify` reads tables of cone-beam views by. They err together
// by 8.3 2^-24 at most (docs/error-bounds.md, "What verify does", "Cone beam"). Nothing of build uses them.
#ifndef VDVR_EIGHT_POINTS_H
#define VDVR_EIGHT_POINTS_H

// The eight weights on the nodes -3 .. 4, expanded about the middle between 0 and 1: even and odd powers of
// g = f - 1/2, highest first, alike and opposite on either side.
#define EVEN(a, b, c, d) ((float8)(a, b, c, d, d, c, b, a))
#define ODD(a, b, c, d) ((float8)(a, b, c, d, -(d), -(c), -(b), -(a)))
#define EVEN_6 EVEN(1.0f / 1440, -1.0f / 288, 1.0f / 160, -1.0f / 288)
#define EVEN_4 EVEN(-7.0f / 1152, 59.0f / 1152, -15.0f / 128, 83.0f / 1152)
#define EVEN_2 EVEN(259.0f / 23040, -499.0f / 4608, 1299.0f / 2560, -1891.0f / 4608)
#define EVEN_0 EVEN(-5.0f / 2048, 49.0f / 2048, -245.0f / 2048, 1225.0f / 2048)
#define ODD_7 ODD(-1.0f / 5040, 1.0f / 720, -1.0f / 240, 1.0f / 144)
#define ODD_5 ODD(1.0f / 576, -59.0f / 2880, 5.0f / 64, -83.0f / 576)
#define ODD_3 ODD(-37.0f / 11520, 499.0f / 11520, -433.0f / 1280, 1891.0f / 2304)
#define ODD_1 ODD(5.0f / 7168, -49.0f / 5120, 245.0f / 3072, -1225.0f / 1024)
// Even and odd powers, of g's square and of coefficients that `OF` brings there.
#define EVEN_POWERS(s, OF) fma(s, fma(s, fma(s, OF(EVEN_6), OF(EVEN_4)), OF(EVEN_2)), OF(EVEN_0))
#define ODD_POWERS(s, OF) fma(s, fma(s, fma(s, OF(ODD_7), OF(ODD_5)), OF(ODD_3)), OF(ODD_1))
#define OF_EIGHT(weights) weights
#define OF_FOUR_TIMES_FOUR(weights) (float16)((weights).lo, (weights).lo, (weights).lo, (weights).lo)
static inline __attribute__((always_inline)) float8 lagrange(float f) {
  const float8 g = (float8)(f - 0.5f), s = g * g;
  return fma(g, ODD_POWERS(s, OF_EIGHT), EVEN_POWERS(s, OF_EIGHT));
}
// Those of four places, each of which fills a quarter of `f`: of the nodes -3 .. 0 in `low`, and in `high` of
// the nodes 4, 3, 2 and 1, in this order.
static inline __attribute__((always_inline)) void lagrange_of_four(float16 f, float16* low, float16* high) {
  const float16 g = f - 0.5f, s = g * g, even = EVEN_POWERS(s, OF_FOUR_TIMES_FOUR),
                odd = ODD_POWERS(s, OF_FOUR_TIMES_FOUR);
  *low = fma(g, odd, even);
  *high = fma(-g, odd, even);
}

// Adds to `sum` what eight places take of the points that `POINT(0)` .. `POINT(7)` are of each: by g, their
// way from the middle between 0 and 1, of at most 1. Weights of these err together by 22.9 2^-24 at most.
#define ADD_POINTS(sum, g, POINT)       \
  {                                     \
    const float8 of_square = (g) * (g); \
    ADD_POINT_PAIR(sum, g, POINT, 0, 7) \
    ADD_POINT_PAIR(sum, g, POINT, 1, 6) \
    ADD_POINT_PAIR(sum, g, POINT, 2, 5) \
    ADD_POINT_PAIR(sum, g, POINT, 3, 4) \
  }
#define ADD_POINT_PAIR(sum, g, POINT, i, j)               \
  {                                                       \
    float8 even = (EVEN_6).s##i, odd = (ODD_7).s##i;      \
    even = fma(of_square, even, (float8)((EVEN_4).s##i)); \
    odd = fma(of_square, odd, (float8)((ODD_5).s##i));    \
    even = fma(of_square, even, (float8)((EVEN_2).s##i)); \
    odd = fma(of_square, odd, (float8)((ODD_3).s##i));    \
    even = fma(of_square, even, (float8)((EVEN_0).s##i)); \
    odd = fma(of_square, odd, (float8)((ODD_1).s##i));    \
    sum = fma(fma(g, odd, even), POINT(i), sum);          \
    sum = fma(fma(-(g), odd, even), POINT(j), sum);       \
  }

#undef OF_EIGHT
#undef OF_FOUR_TIMES_FOUR
#endif
