#pragma once

// Marks a loop over pixels that is compiled for AVX2 too and chosen when the program starts. AVX2 without FMA: the same
// operations in the same order, so every machine gives the same bits.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define VIRGA_SIMD __attribute__((target_clones("avx2", "default")))
#else
#define VIRGA_SIMD
#endif
#define VIRGA_INLINE inline __attribute__((always_inline))
