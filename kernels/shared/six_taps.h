// Weights of six columns, by the place f between the two in the middle: polynomials of degree 5 that are
// nearly minimax where columns are spaced at an eighth of the pixels. What they err: host/bounds/six_taps.hpp.
// Constants only, so that both compilers read them, for scalars, vectors and double precision.
//
//   column of tap n is floor(u) + n, n = -2 .. 3;  f = u - floor(u), g = f - 1/2, s = g * g
//   weight of tap n      = VDVR_SIX_EVEN_n(s) + g * VDVR_SIX_ODD_n(s),  n = -2 (A), -1 (B), 0 (C)
//   weight of tap 1 - n  = VDVR_SIX_EVEN_n(s) - g * VDVR_SIX_ODD_n(s)
#ifndef VDVR_SIX_TAPS_H
#define VDVR_SIX_TAPS_H

#define VDVR_SIX_EVEN_A(s) (0.0122978883f + (s) * (-0.0545045882f + (s) * 0.0214510132f))
#define VDVR_SIX_ODD_A(s) (-0.00482356129f + (s) * (-0.00556636974f + (s) * 0.123759523f))
#define VDVR_SIX_EVEN_B(s) (-0.0993602127f + (s) * (0.413390756f + (s) * -0.0643445626f))
#define VDVR_SIX_ODD_B(s) (0.0657817721f + (s) * (-0.144432873f + (s) * -0.591388881f))
#define VDVR_SIX_EVEN_C(s) (0.587062597f + (s) * (-0.358886391f + (s) * 0.0428916365f))
#define VDVR_SIX_ODD_C(s) (-1.17322719f + (s) * (0.460868895f + (s) * 1.1566329f))

#endif
