#pragma once

// Marks a loop over pixels that is compiled for AVX2 too and chosen when the program starts. AVX2 without FMA: the same
// operations in the same order, so every machine gives the same bits. Not under the thread sanitizer, which is not awake
// yet when such choices are made.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define VIRGA_SIMD __attribute__((target_clones("avx2", "default")))
#else
#define VIRGA_SIMD
#endif
#define VIRGA_INLINE inline __attribute__((always_inline))

namespace virga {

/// 32 bytes of numbers that go through an expression together, for loops that the compiler does not vectorise itself:
/// `Type` for values, at(row + i) for those in a row, at any address. Comparisons give masks for `?:`. Pass values by
/// reference: by value the calling convention depends on the instruction set.
template <class Real>
struct PackOf;

#define VIRGA_PACK(Real)                                                                                            \
    template <>                                                                                                     \
    struct PackOf<Real> {                                                                                           \
        static constexpr int lanes = 32 / int(sizeof(Real));                                                        \
        typedef Real Type __attribute__((vector_size(32), may_alias));                                              \
        typedef Real Loose __attribute__((vector_size(32), may_alias, aligned(alignof(Real))));                     \
                                                                                                                    \
        static VIRGA_INLINE Loose& at(Real* values) { return *reinterpret_cast<Loose*>(values); }                   \
        static VIRGA_INLINE const Loose& at(const Real* values) { return *reinterpret_cast<const Loose*>(values); } \
    };
VIRGA_PACK(float)
VIRGA_PACK(double)
#undef VIRGA_PACK

/// A single number in the manner of a pack, for what is left at the end of a row.
template <class Real>
struct OneOf {
    using Type = Real;
    static VIRGA_INLINE Real& at(Real* values) { return *values; }
    static VIRGA_INLINE const Real& at(const Real* values) { return *values; }
};

}  // namespace virga
