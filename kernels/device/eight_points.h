// Lagrange's weights of eight points, as `verify` reads tables of cone-beam views by. They err together
// by 8.3 2^-24 at most (docs/error-bounds.md, "What verify does", "Cone beam"). Nothing of build uses them.
#ifndef VDVR_EIGHT_POINTS_H
#define VDVR_EIGHT_POINTS_H

// The eight weights on the nodes -3 .. 4, expanded about the middle between 0 and 1: even and odd powers of
// g = f - 1/2, alike and opposite on either side.
#define EVEN(a, b, c, d) (float8)(a, b, c, d, d, c, b, a)
#define ODD(a, b, c, d) (float8)(a, b, c, d, -(d), -(c), -(b), -(a))
#define OF_EIGHT(weights) weights
#define OF_TWO(weights) (float16)(weights, weights)
#define WEIGHTS(NAME, TYPE, PLACE, OF)                                                              \
  static inline __attribute__((always_inline)) TYPE NAME(PLACE f) {                                 \
    const TYPE g = (TYPE)(f - 0.5f), s = g * g;                                                     \
    TYPE even = OF(EVEN(1.0f / 1440, -1.0f / 288, 1.0f / 160, -1.0f / 288)),                        \
         odd = OF(ODD(-1.0f / 5040, 1.0f / 720, -1.0f / 240, 1.0f / 144));                          \
    even = fma(s, even, OF(EVEN(-7.0f / 1152, 59.0f / 1152, -15.0f / 128, 83.0f / 1152)));          \
    odd = fma(s, odd, OF(ODD(1.0f / 576, -59.0f / 2880, 5.0f / 64, -83.0f / 576)));                 \
    even = fma(s, even, OF(EVEN(259.0f / 23040, -499.0f / 4608, 1299.0f / 2560, -1891.0f / 4608))); \
    odd = fma(s, odd, OF(ODD(-37.0f / 11520, 499.0f / 11520, -433.0f / 1280, 1891.0f / 2304)));     \
    even = fma(s, even, OF(EVEN(-5.0f / 2048, 49.0f / 2048, -245.0f / 2048, 1225.0f / 2048)));      \
    odd = fma(s, odd, OF(ODD(5.0f / 7168, -49.0f / 5120, 245.0f / 3072, -1225.0f / 1024)));         \
    return fma(g, odd, even);                                                                       \
  }
WEIGHTS(lagrange, float8, float, OF_EIGHT)
// Those of two places, each of which fills one half of `f`.
WEIGHTS(lagrange_of_two, float16, float16, OF_TWO)

#undef WEIGHTS
#undef OF_EIGHT
#undef OF_TWO
#undef EVEN
#undef ODD
#endif
