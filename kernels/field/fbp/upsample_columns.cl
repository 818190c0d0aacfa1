// Finer columns of detector rows, by their cosine series (docs/geometry.md): the values half-way between
// detector columns by a convolution, with a fast Fourier transform; those between the half columns by
// VDVR_TAPS taps, for the series is oversampled there. All in double precision, rounded once, to the float
// that is stored. A work-item carries 2 VDVR_LANES rows of one view as VDVR_LANES complex rows: the
// convolution's kernel is real. Layouts: in and out as shared/chunks.h says; scratch: VDVR_WIDTH work-items
// side by side, element by element. Called by host/field/fbp/upsample_columns.cpp.
#include "device/lanes.h"
#include "shared/upsample_columns.h"

#if !VDVR_DOUBLE
#error "VDVR_DOUBLE must be 1"
#endif
#if !defined(VDVR_TAPS) || !defined(VDVR_WIDTH)
#error "VDVR_TAPS and VDVR_WIDTH must be set"
#endif

#if VDVR_LANES == 1
#define GET(p) (*(p))
#define PUT(v, p) (*(p) = (v))
#elif VDVR_LANES == 4
#define GET(p) vload4(0, p)
#define PUT(v, p) vstore4(v, 0, p)
#else
#define GET(p) vload8(0, p)
#define PUT(v, p) vstore8(v, 0, p)
#endif

#define STRIDE ((size_t)VDVR_WIDTH * 2 * VDVR_LANES)
#define AT(i) (mine + (size_t)(i)*STRIDE)
#define COMPLEX(name, i) SUM name##_re = GET(AT(i)), name##_im = GET(AT(i) + VDVR_LANES);
#define KEEP(i, re, im)          \
  {                              \
    PUT(re, AT(i));              \
    PUT(im, AT(i) + VDVR_LANES); \
  }
// Times a root of unity, and times its conjugate.
#define TURN(i, re, im, w) \
  KEEP(i, fma((re), (SUM)((w).x), -((im) * (SUM)((w).y))), fma((re), (SUM)((w).y), (im) * (SUM)((w).x)))
#define TURNED_BACK(name, i, w)                                  \
  SUM name##_re, name##_im;                                      \
  {                                                              \
    COMPLEX(r, i)                                                \
    name##_re = fma(r_re, (SUM)((w).x), r_im * (SUM)((w).y));    \
    name##_im = fma(r_im, (SUM)((w).x), -(r_re * (SUM)((w).y))); \
  }
// A row of either half of the lanes, at a detector column.
#define ROWS(u) WIDE(LOAD(rows + (size_t)(u)*16))
#define OTHER_ROWS(u) WIDE(LOAD(rows + (size_t)(u)*16 + 8))

// Two stages of radix 2 at once, decimation in frequency: frequencies come out in bit-reversed order.
static inline void forward(__global double* mine, __global const double2* root, int length, int from) {
  for (int size = from, step = length / from; size >= 4; size /= 4, step *= 4) {
    const int quarter = size / 4;
    for (int first = 0; first < length; first += size)
      for (int j = 0; j < quarter; ++j) {
        const int i = first + j;
        COMPLEX(a, i)
        COMPLEX(b, i + quarter)
        COMPLEX(c, i + 2 * quarter)
        COMPLEX(d, i + 3 * quarter)
        const SUM s_re = a_re + c_re, s_im = a_im + c_im, t_re = b_re + d_re, t_im = b_im + d_im;
        const SUM p_re = a_re - c_re, p_im = a_im - c_im, q_re = b_re - d_re, q_im = b_im - d_im;
        KEEP(i, s_re + t_re, s_im + t_im)
        TURN(i + quarter, s_re - t_re, s_im - t_im, root[2 * j * step])
        TURN(i + 2 * quarter, p_re + q_im, p_im - q_re, root[j * step])
        TURN(i + 3 * quarter, p_re - q_im, p_im + q_re, root[3 * j * step])
      }
  }
}

// The last stage, where the length is no power of four; its own inverse but for a factor.
static inline void pairs(__global double* mine, int length) {
  for (int i = 0; i < length; i += 2) {
    COMPLEX(a, i)
    COMPLEX(b, i + 1)
    KEEP(i, a_re + b_re, a_im + b_im)
    KEEP(i + 1, a_re - b_re, a_im - b_im)
  }
}

// The inverse of `forward`, times the length.
static inline void inverse(__global double* mine, __global const double2* root, int length, int from) {
  for (int size = from, step = length / from; size <= length; size *= 4, step /= 4) {
    const int quarter = size / 4;
    for (int first = 0; first < length; first += size)
      for (int j = 0; j < quarter; ++j) {
        const int i = first + j;
        COMPLEX(a, i)
        TURNED_BACK(b, i + quarter, root[2 * j * step])
        TURNED_BACK(c, i + 2 * quarter, root[j * step])
        TURNED_BACK(d, i + 3 * quarter, root[3 * j * step])
        const SUM p_re = a_re + b_re, p_im = a_im + b_im, q_re = a_re - b_re, q_im = a_im - b_im;
        const SUM r_re = c_re + d_re, r_im = c_im + d_im, t_re = c_re - d_re, t_im = c_im - d_im;
        KEEP(i, p_re + r_re, p_im + r_im)
        KEEP(i + quarter, q_re - t_im, q_im + t_re)
        KEEP(i + 2 * quarter, p_re - r_re, p_im - r_im)
        KEEP(i + 3 * quarter, q_re + t_im, q_im - t_re)
      }
  }
}

// The first stage, on the rows followed by zeros: there are at most a third as many as the length.
static inline void spread(__global double* mine, __global const float* rows, __global const double2* root,
                          int columns, int length) {
  const int quarter = length / 4;
  for (int j = 0; j < quarter; ++j) {
    const SUM a_re = j < columns ? ROWS(j) : (SUM)(0.0f), a_im = j < columns ? OTHER_ROWS(j) : (SUM)(0.0f);
    const bool has_b = j + quarter < columns;
    const SUM b_re = has_b ? ROWS(j + quarter) : (SUM)(0.0f),
              b_im = has_b ? OTHER_ROWS(j + quarter) : (SUM)(0.0f);
    KEEP(j, a_re + b_re, a_im + b_im)
    TURN(j + quarter, a_re - b_re, a_im - b_im, root[2 * j])
    TURN(j + 2 * quarter, a_re + b_im, a_im - b_re, root[j])
    TURN(j + 3 * quarter, a_re - b_im, a_im + b_re, root[3 * j])
  }
}

// Detector columns and the values half-way between, mirrored at the detector's edges: element `margin` is
// the edge, which is half-way.
static inline void take_half_columns(__global double* halves, __global const double* mine,
                                     __global const float* rows, VdvrFinerColumns shape) {
  const int period = 4 * shape.columns;
  for (int e = 0; e < 2 * shape.columns + 1 + 2 * shape.margin; ++e) {
    int m = (e - shape.margin) % period;
    if (m < 0) m += period;
    if (m > period / 2) m = period - m;
    SUM re, im;
    if (m % 2 != 0) {
      re = ROWS(m / 2);
      im = OTHER_ROWS(m / 2);
    } else {
      const int other = m == 0 ? 0 : shape.length - m / 2;
      re = GET(AT(m / 2)) + GET(AT(other));
      im = GET(AT(m / 2) + VDVR_LANES) + GET(AT(other) + VDVR_LANES);
    }
    PUT(re, halves + (size_t)e * STRIDE);
    PUT(im, halves + (size_t)e * STRIDE + VDVR_LANES);
  }
}

#define FOR_PHASES(M) M(0) M(1) M(2)
#define CLEAR(r) SUM re##r = (SUM)(0.0f), im##r = (SUM)(0.0f);
#define ADD(r)                                              \
  {                                                         \
    const SUM w = (SUM)(taps[(phase + r) * VDVR_TAPS + t]); \
    re##r = fma(w, x, re##r);                               \
    im##r = fma(w, y, im##r);                               \
  }
#define STORE_COLUMN(j, re, im)                     \
  if ((j) >= 0 && (j) < shape.count) {              \
    STORE(NARROW(re), target + (size_t)(j)*16);     \
    STORE(NARROW(im), target + (size_t)(j)*16 + 8); \
  }
#define PUT_PHASE(r) STORE_COLUMN(column + phase + r, re##r, im##r)

// taps[phase][VDVR_TAPS]; phase 0 is a copy.
static inline void interpolate(__global float* target, __global const double* halves,
                               __global const double* taps, VdvrFinerColumns shape) {
  const int phases = shape.rate / 2, before = (shape.pad + phases - 1) / phases;
  for (int i = -before; shape.pad + i * phases < shape.count; ++i) {
    const int column = shape.pad + i * phases;
    __global const double* node = halves + (size_t)(i + shape.margin) * STRIDE;
    STORE_COLUMN(column, GET(node), GET(node + VDVR_LANES))
    __global const double* from = node - (VDVR_TAPS / 2 - 1) * STRIDE;
    int phase = 1;
    for (; phase + 2 < phases; phase += 3) {
      FOR_PHASES(CLEAR)
      for (int t = 0; t < VDVR_TAPS; ++t) {
        const SUM x = GET(from + (size_t)t * STRIDE), y = GET(from + (size_t)t * STRIDE + VDVR_LANES);
        FOR_PHASES(ADD)
      }
      FOR_PHASES(PUT_PHASE)
    }
    // What three do not divide: one at 4x, where three would take as long as at 8x.
    for (; phase < phases; ++phase) {
      CLEAR(0)
      for (int t = 0; t < VDVR_TAPS; ++t) {
        const SUM x = GET(from + (size_t)t * STRIDE), y = GET(from + (size_t)t * STRIDE + VDVR_LANES);
        ADD(0)
      }
      PUT_PHASE(0)
    }
  }
}

__kernel void upsample_columns(__global float* out, __global const float* in, __global const double2* root,
                               __global const double2* spectrum, __global const double* taps,
                               __global double* scratch, VdvrFinerColumns shape) {
  const int slot = (int)get_global_id(0);
  if (slot >= shape.slots) return;
  const int elements = shape.length + 2 * shape.columns + 1 + 2 * shape.margin;
  __global double* mine = scratch + (size_t)(slot / VDVR_WIDTH) * elements * STRIDE +
                          (size_t)(slot % VDVR_WIDTH) * 2 * VDVR_LANES;
  __global double* halves = mine + (size_t)shape.length * STRIDE;
  const int parts = 8 / VDVR_LANES, tasks = shape.views * shape.chunks * parts;
  // The last stage takes pairs where the length is no power of four.
  int smallest = shape.length;
  while (smallest > 4) smallest /= 4;
  for (int task = slot; task < tasks; task += shape.slots) {
    const int part = task % parts, chunk = task / parts % shape.chunks, view = task / parts / shape.chunks;
    __global const float* rows = in + shape.in.first + (size_t)view * shape.in.batch +
                                 (size_t)chunk * shape.in.chunk + (size_t)part * VDVR_LANES;
    __global float* target = out + shape.out.first + (size_t)view * shape.out.batch +
                             (size_t)chunk * shape.out.chunk + (size_t)part * VDVR_LANES;
    spread(mine, rows, root, shape.columns, shape.length);
    forward(mine, root, shape.length, shape.length / 4);
    if (smallest == 2) pairs(mine, shape.length);
    for (int i = 0; i < shape.length; ++i) {
      COMPLEX(x, i)
      TURN(i, x_re, x_im, spectrum[i])
    }
    if (smallest == 2) pairs(mine, shape.length);
    inverse(mine, root, shape.length, smallest == 2 ? 8 : 4);
    take_half_columns(halves, mine, rows, shape);
    interpolate(target, halves, taps, shape);
  }
}
