// One step of a fit to the trilinear filter, at VDVR_LANES samples of a column of a lattice
// (docs/error-bounds.md, section 13): a sample less `share` of the middle between the largest and the
// smallest of interpolant - target over the 27 nodes around it, in the middles of edges, faces and cells and
// at the sample itself. A target that does not count is NaN, which no comparison takes: a sample around which
// none counts stays. Included by fit_base.cl and fit_tiles.cl, after device/lanes.h.

// Where the columns around a sample's lie. A neighbour that is not there is not looked at, nor is one along
// an axis whose samples are all nodes: the step along it is 0.
typedef struct {
  int west, east, north, south;
  long to_x, to_y;          // of samples
  long target_x, target_y;  // of targets, half as far apart
  long between;             // from targets at samples' heights to those half a sample below them; 0: none
} VdvrAround;

#define HALF(a, b) fma((VEC)(0.5f), (a), 0.5f * (b))
#define FIT_ERROR(interpolant, at)          \
  {                                         \
    const VEC e = (interpolant)-READ(at);   \
    smallest = e < smallest ? e : smallest; \
    largest = e > largest ? e : largest;    \
  }
// The nine columns of nodes around a sample's, at heights for which `nw` .. `se` are the lattice interpolated
// along z: rows north (y - 1), middle, south; columns west (x - 1), middle, east. Along x first.
#define FIT_COLUMNS(M)       \
  M(nw, -to_north - to_west) \
  M(nm, -to_north)           \
  M(ne, -to_north + to_east) \
  M(mw, -to_west)            \
  M(mm, 0)                   \
  M(me, to_east)             \
  M(sw, to_south - to_west)  \
  M(sm, to_south)            \
  M(se, to_south + to_east)
#define FIT_AT(name, to) const VEC name = READ(c + (to));
#define FIT_BELOW(name, to) const VEC name = HALF(READ(c + (to)-1), READ(c + (to)));
#define FIT_ABOVE(name, to) const VEC name = HALF(READ(c + (to)), READ(c + (to) + 1));
#define FIT_NODES(WHICH, at)                                                              \
  {                                                                                       \
    FIT_COLUMNS(WHICH)                                                                    \
    const VEC n0 = HALF(nw, nm), n1 = HALF(nm, ne), m0 = HALF(mw, mm), m1 = HALF(mm, me); \
    const VEC s0 = HALF(sw, sm), s1 = HALF(sm, se);                                       \
    FIT_ERROR(mm, (at))                                                                   \
    if (a.west) FIT_ERROR(m0, (at)-a.target_x)                                            \
    if (a.east) FIT_ERROR(m1, (at) + a.target_x)                                          \
    if (a.north) {                                                                        \
      FIT_ERROR(HALF(nm, mm), (at)-a.target_y)                                            \
      if (a.west) FIT_ERROR(HALF(n0, m0), (at)-a.target_y - a.target_x)                   \
      if (a.east) FIT_ERROR(HALF(n1, m1), (at)-a.target_y + a.target_x)                   \
    }                                                                                     \
    if (a.south) {                                                                        \
      FIT_ERROR(HALF(mm, sm), (at) + a.target_y)                                          \
      if (a.west) FIT_ERROR(HALF(m0, s0), (at) + a.target_y - a.target_x)                 \
      if (a.east) FIT_ERROR(HALF(m1, s1), (at) + a.target_y + a.target_x)                 \
    }                                                                                     \
  }

static inline VEC fitted(__global const float* c, __global const float* t, VdvrAround a, float share) {
  const long to_west = a.west ? a.to_x : 0, to_east = a.east ? a.to_x : 0, to_north = a.north ? a.to_y : 0,
             to_south = a.south ? a.to_y : 0;
  VEC smallest = (VEC)(INFINITY), largest = (VEC)(-INFINITY);
  FIT_NODES(FIT_AT, t)
  if (a.between != 0) {
    FIT_NODES(FIT_BELOW, t + a.between)
    FIT_NODES(FIT_ABOVE, t + a.between + 1)
  }
  const VEC old = READ(c), moved = fma((VEC)(-(share * 0.5f)), smallest + largest, old);
  return select(old, moved, smallest <= largest);
}
