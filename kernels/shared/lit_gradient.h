// A gradient in one word: x, y, z from the lowest bits up, 10 bits each, signed, in units of the volume's
// own. Included by packet_sampler.h, which reads them, and lit_samples.cl, which writes them.
#ifndef VDVR_LIT_GRADIENT_H
#define VDVR_LIT_GRADIENT_H

#define LIT_LARGEST 511
// The components of a word, times 2^22: moved up against the sign, without a shift back.
#define LIT_X(w) ((w) << 22)
#define LIT_Y(w) (((w) << 12) & -0x400000)
#define LIT_Z(w) (((w) << 2) & -0x400000)

#endif
