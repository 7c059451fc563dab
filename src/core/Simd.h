#pragma once

// Marks a loop over pixels that is compiled for AVX2 too and chosen when the program starts. AVX2 without FMA: the same
// operations in the same order, so every machine gives the same bits.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define VIRGA_SIMD __attribute__((target_clones("avx2", "default")))
#else
#define VIRGA_SIMD
#endif
#define VIRGA_INLINE inline __attribute__((always_inline))

namespace virga {

/// 32 bytes of numbers that go through an expression together, for loops that the compiler does not vectorise itself.
/// Comparisons give masks for `?:`. Pass by reference: by value the calling convention depends on the instruction set.
template <class Real>
struct PackOf;
template <>
struct PackOf<float> {
    static constexpr int lanes = 8;
    typedef float Type __attribute__((vector_size(32), may_alias));
};
template <>
struct PackOf<double> {
    static constexpr int lanes = 4;
    typedef double Type __attribute__((vector_size(32), may_alias));
};

}  // namespace virga
