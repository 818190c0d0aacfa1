// Quotients by powers of two, as products by their exact inverses: OpenCL's own quotients may err by 2.5 ulp,
// and some kernels take theirs for exact. Included by cell_test.cl, fit_tiles.cl and
// verify_pieces.cl.
#ifndef VDVR_POWERS_H
#define VDVR_POWERS_H

// 1 / n of a power of two, 1 <= n: 2^-k has the bits (127 - k) << 23, and clz(n) is 31 - k.
static inline float inverse_of_power(int n) { return as_float((96 + clz(n)) << 23); }

#endif
