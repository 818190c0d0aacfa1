// Work-items of a work-group that share a column, a row or a brick, whose largest values meet in local
// memory: VDVR_ALONG of them, a power of two. 1, as CPUs have it: a work-item does it all, and no barrier is
// there. Tuning; a largest value does not change with who finds it. Included by fourth_differences.cl and
// verify_pieces.cl.
#ifndef VDVR_ALONG
#define VDVR_ALONG 1
#endif

// Before __kernel's void; and the kernel's last parameter. The room is an argument, since PoCL 3.1 gives an
// array that the kernel declares to all of its groups at once, where a function that is called more than once
// is handed it: clang takes its address for the function's constant, and PoCL moves to the groups only what
// kernels name.
#define SHARED_COLUMN __attribute__((reqd_work_group_size(VDVR_ALONG, 1, 1)))
#define SHARED_ROOM __local int* shared_room
#if VDVR_ALONG == 1
#define OWN_PART 0
#define LARGEST_OF_GROUP(v) (v)
#define LEAST_OF_GROUP(i) (i)
#else
#define OWN_PART ((int)get_local_id(0))
// Of all work-items of the group, in each of them. Every one must come here.
#define LARGEST_OF_GROUP(v) largest_of_group(v, (__local float*)shared_room)
#define LEAST_OF_GROUP(i) least_of_group(i, shared_room)
#define MEET(better)                                                     \
  const int own = OWN_PART;                                              \
  room[own] = v;                                                         \
  for (int others = VDVR_ALONG / 2; others > 0; others /= 2) {           \
    barrier(CLK_LOCAL_MEM_FENCE);                                        \
    if (own < others) room[own] = better(room[own], room[own + others]); \
  }                                                                      \
  barrier(CLK_LOCAL_MEM_FENCE);                                          \
  v = room[0];                                                           \
  barrier(CLK_LOCAL_MEM_FENCE);                                          \
  return v;
static inline float largest_of_group(float v, __local float* room) { MEET(fmax) }
static inline int least_of_group(int v, __local int* room) { MEET(min) }
#endif
