// Which drops exist: the co-moving hashed cells of docs/design.md. Compiled by GLSL and, through shared/alias.h, by C++.
// Structs are rows of 16 bytes, so that std430 and C++ agree.
#ifndef VIRGA_FN
#define VIRGA_FN
#endif

/// The cell of every 64th drop is looked up, those of the drops between are found from it.
const uint dropsPerBlock = 64u;

/// One cell of one layer of the rain, in the frame that falls with the layer's size class.
struct Cell {
    uvec4 key;     // x, y: hash of (seed, layer, i, j, k); z: layer; w: number of its first drop in the whole list
    vec4 origin;   // xyz: corner with the smallest coordinates, from the camera when the shutter opens, world axes [m]
    vec4 phase;    // phase of each turbulence wave at that corner when the shutter opens [turns]
};

/// What the drops of a layer have in common: some of the drops of a size class.
struct DropClass {
    vec4 size;     // x, y: least and largest diameter [m]; z: slope of the size distribution [1/m]; w: cell edge [m]
    vec4 travel;   // xyz: way from shutter open to close relative to the camera, world axes [m]; w: speed of fall [m/s]
    vec4 rank;     // x: least rank of a drop; y: range of ranks; z, w: -
};

/// Four waves that shift drops: the closed form of turbulence (particles/Motion.h).
struct TurbulenceWave {
    vec4 wave;     // xyz: wave vector [turns/m]; w: phase step from open to close [turns]
    vec4 shift;    // xyz: amplitude [m]; w: range of the phase that is the drop's own [turns]
};

struct Drop {
    vec3 open;       // from the camera at shutter open, world axes [m]
    vec3 close;      // from the camera at shutter close, world axes [m]
    float diameter;  // [m]
    float rank;      // [0, 1): its place in the order in which faint drops are drawn (visibility.glsl)
    uint look;       // random bits for what the stroke looks like
};

/// PCG 4-D hash. Jarzynski and Olano 2020, "Hash Functions for GPU Rendering", JCGT 9(3).
VIRGA_FN uvec4 hash4(uvec4 v)
{
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v = v ^ (v >> 16u);
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

/// [0, 1), 24 bits: every value is exact in float.
VIRGA_FN float unitFloat(uint bits) { return float(bits >> 8u) * (1.0f / 16777216.0f); }

/// A wave of period 1 and amplitude 1 made of two parabolas: a sine to 6 % that costs no sine. Its slope is continuous, so
/// drops that follow it have a continuous velocity; its rms is sqrt(8/15).
VIRGA_FN float parabolicWave(float turns)
{
    float x = 2.0f * fract(turns) - 1.0f;
    return 4.0f * x * (1.0f - abs(x));
}

/// Diameter [m] at quantile u in [0, 1) of an exponential distribution of slope `slope` cut to [least, largest].
VIRGA_FN float truncatedExponential(float u, float least, float largest, float slope)
{
    float kept = 1.0f - exp(-slope * (largest - least));
    return least - log(1.0f - u * kept) / slope;
}

/// Drop number `index` of a cell. All randomness is a hash of (cell, index): any drop of any frame alone.
VIRGA_FN Drop dropInCell(Cell cell, DropClass dropClass, TurbulenceWave wave0, TurbulenceWave wave1,
                         TurbulenceWave wave2, TurbulenceWave wave3, uint index)
{
    uvec4 place = hash4(uvec4(cell.key.x, cell.key.y, index, 0x9e3779b9u));
    uvec4 traits = hash4(place);
    vec3 local = vec3(unitFloat(place.x), unitFloat(place.y), unitFloat(place.z)) * dropClass.size.w;

#ifdef NO_TURBULENCE
    vec3 shiftOpen = vec3(0.0f), shiftClose = vec3(0.0f);
#else
    float own0 = unitFloat(traits.y) - 0.5f;
    float own1 = unitFloat(traits.z) - 0.5f;
    float own2 = unitFloat(traits.w) - 0.5f;
    float own3 = unitFloat(traits.y ^ (traits.w << 7u)) - 0.5f;
    float phase0 = cell.phase.x + dot(vec3(wave0.wave), local) + wave0.shift.w * own0;
    float phase1 = cell.phase.y + dot(vec3(wave1.wave), local) + wave1.shift.w * own1;
    float phase2 = cell.phase.z + dot(vec3(wave2.wave), local) + wave2.shift.w * own2;
    float phase3 = cell.phase.w + dot(vec3(wave3.wave), local) + wave3.shift.w * own3;
    vec3 shiftOpen = vec3(wave0.shift) * parabolicWave(phase0) + vec3(wave1.shift) * parabolicWave(phase1) +
                     vec3(wave2.shift) * parabolicWave(phase2) + vec3(wave3.shift) * parabolicWave(phase3);
    vec3 shiftClose = vec3(wave0.shift) * parabolicWave(phase0 + wave0.wave.w) +
                      vec3(wave1.shift) * parabolicWave(phase1 + wave1.wave.w) +
                      vec3(wave2.shift) * parabolicWave(phase2 + wave2.wave.w) +
                      vec3(wave3.shift) * parabolicWave(phase3 + wave3.wave.w);
#endif

    Drop drop;
    vec3 still = vec3(cell.origin) + local;
    drop.open = still + shiftOpen;
    drop.close = still + vec3(dropClass.travel) + shiftClose;
    drop.diameter = truncatedExponential(unitFloat(place.w), dropClass.size.x, dropClass.size.y, dropClass.size.z);
    drop.look = traits.x;
    drop.rank = dropClass.rank.x + dropClass.rank.y * unitFloat(traits.x * 2654435761u);
    return drop;
}
