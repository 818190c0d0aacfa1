// How much the test of a device computes (trust.cl). Values of a kind, and results of each value by kernel.
#ifndef VDVR_TRUST_H
#define VDVR_TRUST_H

#define VDVR_TRUST_VALUES 64
#define VDVR_TRUST_SCALAR 41
#define VDVR_TRUST_VECTOR 8
#define VDVR_TRUST_DOUBLE 6
#define VDVR_TRUST_POINTS 512
#define VDVR_TRUST_BRICKS 8

#endif
