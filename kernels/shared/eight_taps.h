// Weights of eight columns, by the place f between the two in the middle: polynomials of degree 5 that are
// nearly minimax where columns are spaced at a sixth of the pixels. They err less than the six of six_taps.h
// do at an eighth, polynomials cost the same in vectors of eight, and tables that are denser both ways take
// 9/16 of the memory. At a quarter of the pixels eight taps would err by 1.3e-6, which small tolerances
// notice.
//
//   column of tap n is floor(u) + n, n = -3 .. 4;  f = u - floor(u), g = f - 1/2, s = g * g
//   weight of tap n      = EVEN_n(s) + g * ODD_n(s),  n = -3 (A), -2 (B), -1 (C), 0 (D)
//   weight of tap 1 - n  = EVEN_n(s) - g * ODD_n(s)
#ifndef VDVR_EIGHT_TAPS_H
#define VDVR_EIGHT_TAPS_H

#define VDVR_EIGHT_EVEN_A -0.00275375857f, 0.0126391975f, -0.00693499763f
#define VDVR_EIGHT_ODD_A 0.000784415985f, -0.00350383716f, 0.00141833094f
#define VDVR_EIGHT_EVEN_B 0.0254337303f, -0.115049414f, 0.0552605018f
#define VDVR_EIGHT_ODD_B -0.0101579754f, 0.0453109704f, -0.018411858f
#define VDVR_EIGHT_EVEN_C -0.122281566f, 0.519324958f, -0.12419454f
#define VDVR_EIGHT_ODD_C 0.0814765245f, -0.344171017f, 0.0721842423f
#define VDVR_EIGHT_EVEN_D 0.599601567f, -0.416914642f, 0.0758686587f
#define VDVR_EIGHT_ODD_D -1.19913054f, 0.830484986f, -0.134422287f

#endif
