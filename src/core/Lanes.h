// Eight floats, or eight unsigned integers, that go through an expression together, so that a kernel reads like the
// formula. GCC's vector types underneath: AVX where the function is VIRGA_SIMD and the machine has it, SSE elsewhere,
// the same bits on both, as neither fuses a product with a sum.
//
// For .cpp files whose functions are VIRGA_SIMD: everything here is inlined into them, as a function of its own would
// be called with another convention on each machine. Compile those with -fno-math-errno, without which a square root is
// a call.
#pragma once

#include <cstdint>
#include <cstring>

#include "core/Simd.h"

namespace virga::lanes {

constexpr int count = 8;

typedef float FloatVector __attribute__((vector_size(32)));
typedef std::int32_t IntVector __attribute__((vector_size(32)));
typedef std::uint32_t UintVector __attribute__((vector_size(32)));

/// All bits set in the lanes where something holds.
struct Mask {
    IntVector v;

    VIRGA_INLINE bool any() const
    {
        std::int64_t parts[4];
        std::memcpy(parts, &v, sizeof parts);
        return ((parts[0] | parts[1]) | (parts[2] | parts[3])) != 0;
    }
    VIRGA_INLINE bool operator[](int lane) const { return v[lane] != 0; }
};
VIRGA_INLINE Mask operator&(const Mask& a, const Mask& b) { return {a.v & b.v}; }
VIRGA_INLINE Mask operator|(const Mask& a, const Mask& b) { return {a.v | b.v}; }

struct Uint {
    UintVector v;

    Uint() = default;
    VIRGA_INLINE Uint(std::uint32_t value) : v(UintVector{} + value) {}
    VIRGA_INLINE explicit Uint(const UintVector& vector) : v(vector) {}
};
#define VIRGA_LANES_OPERATOR(op) \
    VIRGA_INLINE Uint operator op(const Uint& a, const Uint& b) { return Uint(a.v op b.v); }
VIRGA_LANES_OPERATOR(+)
VIRGA_LANES_OPERATOR(*)
VIRGA_LANES_OPERATOR(&)
VIRGA_LANES_OPERATOR(^)
#undef VIRGA_LANES_OPERATOR
VIRGA_INLINE Uint operator>>(const Uint& a, std::uint32_t bits) { return Uint(a.v >> bits); }
VIRGA_INLINE Uint operator<<(const Uint& a, std::uint32_t bits) { return Uint(a.v << bits); }
VIRGA_INLINE Uint& operator+=(Uint& a, const Uint& b) { return a = a + b; }

struct Float {
    FloatVector v;

    Float() = default;
    VIRGA_INLINE Float(float value) : v(FloatVector{} + value) {}
    VIRGA_INLINE explicit Float(const FloatVector& vector) : v(vector) {}
    /// The numbers, which must be under 2^31.
    VIRGA_INLINE explicit Float(const Uint& u) : v(__builtin_convertvector((IntVector)u.v, FloatVector)) {}

    VIRGA_INLINE float operator[](int lane) const { return v[lane]; }
};
#define VIRGA_LANES_OPERATOR(op) \
    VIRGA_INLINE Float operator op(const Float& a, const Float& b) { return Float(a.v op b.v); }
VIRGA_LANES_OPERATOR(+)
VIRGA_LANES_OPERATOR(-)
VIRGA_LANES_OPERATOR(*)
VIRGA_LANES_OPERATOR(/)
#undef VIRGA_LANES_OPERATOR
#define VIRGA_LANES_OPERATOR(op) \
    VIRGA_INLINE Mask operator op(const Float& a, const Float& b) { return {a.v op b.v}; }
VIRGA_LANES_OPERATOR(<)
VIRGA_LANES_OPERATOR(<=)
VIRGA_LANES_OPERATOR(>)
VIRGA_LANES_OPERATOR(>=)
#undef VIRGA_LANES_OPERATOR
VIRGA_INLINE Float operator-(const Float& a) { return Float(-a.v); }

VIRGA_INLINE Float load(const float* values)
{
    Float result;
    std::memcpy(&result.v, values, sizeof result.v);
    return result;
}
VIRGA_INLINE void store(const Float& a, float* values) { std::memcpy(values, &a.v, sizeof a.v); }

/// a where the mask holds, else b.
VIRGA_INLINE Float pick(const Mask& mask, const Float& a, const Float& b) { return Float(mask.v ? a.v : b.v); }

VIRGA_INLINE Float min(const Float& a, const Float& b) { return Float(a.v < b.v ? a.v : b.v); }
VIRGA_INLINE Float max(const Float& a, const Float& b) { return Float(a.v > b.v ? a.v : b.v); }
VIRGA_INLINE Float clamp(const Float& a, const Float& low, const Float& high) { return min(max(a, low), high); }
VIRGA_INLINE Float abs(const Float& a) { return Float((FloatVector)((IntVector)a.v & 0x7fffffff)); }
VIRGA_INLINE Float mix(const Float& a, const Float& b, const Float& t) { return a + (b - a) * t; }

/// For |a| < 2^31.
VIRGA_INLINE Float floor(const Float& a)
{
    const FloatVector whole = __builtin_convertvector(__builtin_convertvector(a.v, IntVector), FloatVector);
    return Float(whole > a.v ? whole - 1.0f : whole);
}
VIRGA_INLINE Float fract(const Float& a) { return a - floor(a); }

VIRGA_INLINE Float sqrt(const Float& a)
{
    float values[count];
    store(a, values);
    for (float& value : values) value = __builtin_sqrtf(value);
    return load(values);
}

/// Relative error below 2e-7 for -87 <= a <= 88; held to that range. Moshier 1992, Cephes, expf.
VIRGA_INLINE Float exp(const Float& a)
{
    const Float x = clamp(a, -87.0f, 88.0f);
    const Float n = floor(x * 1.44269504f + 0.5f);
    const Float r = x - n * 0.693359375f - n * -2.12194440e-4f;
    const Float p = ((((1.9875691500e-4f * r + 1.3981999507e-3f) * r + 8.3334519073e-3f) * r + 4.1665795894e-2f) * r +
                     1.6666665459e-1f) *
                        r +
                    5.0000001201e-1f;
    const IntVector power = (__builtin_convertvector(n.v, IntVector) + 127) << 23;
    return (p * r * r + r + 1.0f) * Float((FloatVector)power);
}

/// Natural logarithm, relative error below 2e-7 (absolute beside 1), for normal numbers > 0. Moshier 1992, Cephes,
/// logf.
VIRGA_INLINE Float log(const Float& a)
{
    const IntVector bits = (IntVector)a.v;
    // mantissa in [sqrt(1/2), sqrt(2))
    IntVector exponent = (bits >> 23) - 126;
    FloatVector m = (FloatVector)((bits & 0x007fffff) | 0x3f000000);
    const IntVector isSmall = m < 0.707106781f;
    exponent += isSmall;
    m = isSmall ? m + m : m;
    const Float x = Float(m) - 1.0f, z = x * x, e = Float(__builtin_convertvector(exponent, FloatVector));
    const Float p =
        ((((((((7.0376836292e-2f * x - 1.1514610310e-1f) * x + 1.1676998740e-1f) * x - 1.2420140846e-1f) * x +
             1.4249322787e-1f) *
                x -
            1.6668057665e-1f) *
               x +
           2.0000714765e-1f) *
              x -
          2.4999993993e-1f) *
             x +
         3.3333331174e-1f) *
        x * z;
    return x - 0.5f * z + (p - 2.12194440e-4f * e) + 0.693359375f * e;
}

/// The names of GLSL, for the files in shaders/shared/.
struct Vec4 {
    Float x, y, z, w;
};
struct Vec3 {
    Float x, y, z;

    Vec3() = default;
    VIRGA_INLINE explicit Vec3(const Float& all) : x(all), y(all), z(all) {}
    VIRGA_INLINE Vec3(const Float& x_, const Float& y_, const Float& z_) : x(x_), y(y_), z(z_) {}
    VIRGA_INLINE explicit Vec3(const Vec4& v) : x(v.x), y(v.y), z(v.z) {}
};
VIRGA_INLINE Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
VIRGA_INLINE Vec3 operator*(const Vec3& a, const Float& b) { return {a.x * b, a.y * b, a.z * b}; }
VIRGA_INLINE Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
VIRGA_INLINE Vec3 operator*(const Float& a, const Vec3& b) { return b * a; }
VIRGA_INLINE Float dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

VIRGA_INLINE Float length(const Vec3& a) { return sqrt(dot(a, a)); }

struct Uvec4 {
    Uint x, y, z, w;

    Uvec4() = default;
    VIRGA_INLINE Uvec4(const Uint& x_, const Uint& y_, const Uint& z_, const Uint& w_) : x(x_), y(y_), z(z_), w(w_) {}
};
VIRGA_INLINE Uvec4 operator*(const Uvec4& a, const Uint& b) { return {a.x * b, a.y * b, a.z * b, a.w * b}; }
VIRGA_INLINE Uvec4 operator+(const Uvec4& a, const Uint& b) { return {a.x + b, a.y + b, a.z + b, a.w + b}; }
VIRGA_INLINE Uvec4 operator^(const Uvec4& a, const Uvec4& b) { return {a.x ^ b.x, a.y ^ b.y, a.z ^ b.z, a.w ^ b.w}; }
VIRGA_INLINE Uvec4 operator>>(const Uvec4& a, std::uint32_t bits)
{
    return {a.x >> bits, a.y >> bits, a.z >> bits, a.w >> bits};
}

}  // namespace virga::lanes
