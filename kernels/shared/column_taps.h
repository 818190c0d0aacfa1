// Weights of columns by the place f between the two in the middle, polynomials of degree 5 that are nearly
// minimax: six of columns at an eighth of the pixels, eight of columns at a sixth. Eight err a tenth of what
// six do. They cost as much in vectors of eight, and tables that are denser both ways take 9/16 of the
// memory. What they err: host/certify/bounds/column_taps.hpp. Constants and products only: both compilers
// read them, for scalars, vectors and double precision.
//
//   column of tap n is floor(u) + n;  f = u - floor(u), g = f - 1/2, s = g * g
//   weight of tap n      = EVEN_n(s) + g * ODD_n(s),  of six taps n = -2 (A), -1 (B), 0 (C),
//   weight of tap 1 - n  = EVEN_n(s) - g * ODD_n(s)   of eight n = -3 (A), -2 (B), -1 (C), 0 (D)
//
// where EVEN_A(s) of six is VDVR_TAPS_POLYNOMIAL(s, VDVR_SIX_EVEN_A).
#ifndef VDVR_COLUMN_TAPS_H
#define VDVR_COLUMN_TAPS_H

#define VDVR_SIX_EVEN_A 0.0122978883f, -0.0545045882f, 0.0214510132f
#define VDVR_SIX_ODD_A -0.00482356129f, -0.00556636974f, 0.123759523f
#define VDVR_SIX_EVEN_B -0.0993602127f, 0.413390756f, -0.0643445626f
#define VDVR_SIX_ODD_B 0.0657817721f, -0.144432873f, -0.591388881f
#define VDVR_SIX_EVEN_C 0.587062597f, -0.358886391f, 0.0428916365f
#define VDVR_SIX_ODD_C -1.17322719f, 0.460868895f, 1.1566329f

#define VDVR_EIGHT_EVEN_A -0.00275375857f, 0.0126391975f, -0.00693499763f
#define VDVR_EIGHT_ODD_A 0.000784415985f, -0.00350383716f, 0.00141833094f
#define VDVR_EIGHT_EVEN_B 0.0254337303f, -0.115049414f, 0.0552605018f
#define VDVR_EIGHT_ODD_B -0.0101579754f, 0.0453109704f, -0.018411858f
#define VDVR_EIGHT_EVEN_C -0.122281566f, 0.519324958f, -0.12419454f
#define VDVR_EIGHT_ODD_C 0.0814765245f, -0.344171017f, 0.0721842423f
#define VDVR_EIGHT_EVEN_D 0.599601567f, -0.416914642f, 0.0758686587f
#define VDVR_EIGHT_ODD_D -1.19913054f, 0.830484986f, -0.134422287f

// By Horner's scheme; the second macro is there to take the list apart.
#define VDVR_TAPS_POLYNOMIAL(s, list) VDVR_TAPS_HORNER(s, list)
#define VDVR_TAPS_HORNER(s, c0, c1, c2) ((c0) + (s) * ((c1) + (s) * (c2)))
// The same on a device, in one type.
#define VDVR_TAPS_FUSED(T, s, list) VDVR_TAPS_FUSED_HORNER(T, s, list)
#define VDVR_TAPS_FUSED_HORNER(T, s, c0, c1, c2) fma((T)(s), fma((T)(s), (T)(c2), (T)(c1)), (T)(c0))

#endif
