// What all passes of one frame share. Compiled by GLSL (std430) and C++ (shared/alias.h); rows of 16 bytes.

/// Entries of the fog table: optical depth at depths d with d / (d + scale) = 0, 1/255, ... 1. The veil table has as many
/// pairs: optical depth, and the same weighted with the light that the fog in front lets through.
const int fogTableSize = 256;

struct FrameConstants {
    mat4 cameraFromWorldOpen;   // rotation alone; places are given from the camera
    mat4 cameraFromWorldClose;
    vec4 lens;       // x: focal length at open [px]; y: at close [px]; z, w: optical axis on the picture [px]
    vec4 range;      // x: near [m]; y: far [m]; z: visibility threshold / opacity; w: opacity multiplier
    vec4 focus;      // x: aperture diameter [m]; y: 1 / focus distance [1/m]; z: exposure [s]; w: fogTableScale of the fog table [m]
    uvec4 picture;   // x: width; y: height; z: drops listed; w: room for strokes
    vec4 fogColor;   // rgb: airlight if w = 1; w = 0: the light that a drop returns
    vec4 boost;      // x: background boost c; y: 1 paper's C + cB, 0 energy-keeping C + c(B - Blow); z: optical depth at infinity; w: focal length that visibility is judged by, the whole frame's at full scale [px]
    vec4 grade;      // x: darken; y: desaturate; z: blur sigma at infinite depth [px]; w: depth scale of the blur [m]
    vec4 atlas;      // x: groups; y: variants; z: first bead cycles; w: groups per octave
    vec4 atlasSize;  // x: texels across; y: texels along; z: tile width / drop diameter; w: largest footprint of a small stroke [px]
    vec4 splash;     // x: events per cell of edge splashGrid.x and slot; y: lifetime [s]; z: size multiplier; w: time in slots, fraction
    vec4 splashGrid; // x: smallest cell edge [m]; y, z: camera's x, z from the corner of its coarsest cell [m]; w: pixels to one of the full picture's, at most 1
    uvec4 splashKey;  // x: seed; y, z: coarsest cell that the camera is in; w: most splashes a picture may list
    uvec4 splashTime; // x: time slot; y: subdivisions of the coarsest cell, log2; z, w: -
    vec4 splashDrop; // x, y: least, largest diameter of drops that splash [m]; z: slope of sizes [1/m]; w: greatest depth [m]
    uvec4 lights;     // x: number of lamps; y: pixels from one node of the light grid to the next (FrameTargets sets it); z, w: -
    vec4 medium;      // x: extinction of the air around lamps [1/m]; y: matte value under which strokes are thinned / opacity; z, w: entry of the veil table where no depth is known
    vec4 lut;         // x: delta, y: maximum of the colour transfer's encoding; z: nodes a side; w: -
};

/// A drop's way across the picture while the shutter is open.
struct Stroke {
    vec4 path;   // x, y: start; z, w: end [px]
    vec4 body;   // x: half width, defocus included [px]; y: what the drop covers, in pixels times exposures; z, w: depth at start, end [m]
    vec4 look;   // x: matte layer + 1, negative if mirrored; y: share of its light that the fog in front lets through; z: drop width / full width; w: blur along the path [px]
#ifdef LIGHTS
    vec4 lamps;  // rgb: radiance that the drop returns of the scene's lamps, fog in front taken off; w: -
#endif
};

/// A lamp, small against its distance.
struct PointLight {
    vec4 place;      // xyz: from the camera at shutter open, world axes [m]; w: radius [m]
    vec4 intensity;  // rgb: radiant intensity, scene-linear radiance times area [m^2]; w: -
};
