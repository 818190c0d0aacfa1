// VDVR_WIDE before a function compiles it for vectors of several widths, of which the loader takes the widest
// that the processor has. Sums are the same bits on all of them: no compiler fuses products with sums here
// (-ffp-contract=off), and the order of a sum is that of the source.
#pragma once

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
#define VDVR_WIDE __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define VDVR_WIDE
#endif
