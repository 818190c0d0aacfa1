// Weights of six columns, by the place f between the two in the middle: polynomials of degree 5 that are
// nearly minimax where columns are spaced at an eighth of the pixels. What they err:
// host/certify/bounds/column_taps.hpp. Constants and products only: both compilers read them, for scalars,
// vectors and double precision.
//
//   column of tap n is floor(u) + n, n = -2 .. 3;  f = u - floor(u), g = f - 1/2, s = g * g
//   weight of tap n      = EVEN_n(s) + g * ODD_n(s),  n = -2 (A), -1 (B), 0 (C)
//   weight of tap 1 - n  = EVEN_n(s) - g * ODD_n(s)
//
// where EVEN_A(s) is VDVR_SIX_POLYNOMIAL(s, VDVR_SIX_EVEN_A).
#ifndef VDVR_SIX_TAPS_H
#define VDVR_SIX_TAPS_H

#define VDVR_SIX_EVEN_A 0.0122978883f, -0.0545045882f, 0.0214510132f
#define VDVR_SIX_ODD_A -0.00482356129f, -0.00556636974f, 0.123759523f
#define VDVR_SIX_EVEN_B -0.0993602127f, 0.413390756f, -0.0643445626f
#define VDVR_SIX_ODD_B 0.0657817721f, -0.144432873f, -0.591388881f
#define VDVR_SIX_EVEN_C 0.587062597f, -0.358886391f, 0.0428916365f
#define VDVR_SIX_ODD_C -1.17322719f, 0.460868895f, 1.1566329f

// By Horner's scheme; the second macro is there to take the list apart.
#define VDVR_SIX_POLYNOMIAL(s, list) VDVR_SIX_HORNER(s, list)
#define VDVR_SIX_HORNER(s, c0, c1, c2) ((c0) + (s) * ((c1) + (s) * (c2)))
// The same on a device, in one type.
#define VDVR_SIX_FUSED(T, s, list) VDVR_SIX_FUSED_HORNER(T, s, list)
#define VDVR_SIX_FUSED_HORNER(T, s, c0, c1, c2) fma((T)(s), fma((T)(s), (T)(c2), (T)(c1)), (T)(c0))

#endif
