// Functions for vectors of several widths, of which the loader takes the widest that the processor has. Sums
// are the same bits on all of them: no compiler fuses products with sums here (-ffp-contract=off), and the
// order of a sum is that of the source.
#pragma once

#include <cstdint>

// Resolvers run before a sanitizer is ready.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define VDVR_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define VDVR_SANITIZED 1
#endif
#endif

#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(VDVR_SANITIZED)
#define VDVR_MANY_WIDTHS 1
#endif

// Before a function whose loops the compiler makes vectors of.
#ifdef VDVR_MANY_WIDTHS
#define VDVR_WIDE __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define VDVR_WIDE
#endif

// Defines void NAME PARAMETERS, which calls NAME##_in<N> ARGUMENTS, a template that is always inlined: N
// doubles are a vector of the processor's. GCC keeps vectors that are longer than the processor's in memory.
#ifdef VDVR_MANY_WIDTHS
#define VDVR_IN_WIDTHS(NAME, PARAMETERS, ARGUMENTS)                                   \
  __attribute__((target("default"))) void NAME PARAMETERS { NAME##_in<2> ARGUMENTS; } \
  __attribute__((target("avx2"))) void NAME PARAMETERS { NAME##_in<4> ARGUMENTS; }    \
  __attribute__((target("avx512f"))) void NAME PARAMETERS { NAME##_in<8> ARGUMENTS; }
#else
#define VDVR_IN_WIDTHS(NAME, PARAMETERS, ARGUMENTS) \
  void NAME PARAMETERS { NAME##_in<2> ARGUMENTS; }
#endif
#define VDVR_ALWAYS_INLINE [[gnu::always_inline]] inline

namespace vdvr::wide {

/// N doubles, at any place in memory.
template <std::int64_t N>
struct Doubles {
  typedef double Vector __attribute__((vector_size(N * sizeof(double)), aligned(8), may_alias));
  typedef float Floats __attribute__((vector_size(N * sizeof(float)), aligned(4), may_alias));
  VDVR_ALWAYS_INLINE static const Vector& at(const double* p) { return *reinterpret_cast<const Vector*>(p); }
  VDVR_ALWAYS_INLINE static Vector& at(double* p) { return *reinterpret_cast<Vector*>(p); }
  VDVR_ALWAYS_INLINE static Floats& at(float* p) { return *reinterpret_cast<Floats*>(p); }
};

}  // namespace vdvr::wide
