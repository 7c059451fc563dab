// Which part of a shot each parameter goes into, so that moving a slider makes that part anew and leaves the others.
#pragma once

#include "shot/Parameters.h"

namespace virga::shot {

/// Sets of parts are sums of these.
enum Part : unsigned {
    NoPart = 0,             ///< looked at in each frame, or by who reads and writes files
    TimePart = 1 << 0,      ///< how long a frame is
    CameraPart = 1 << 1,    ///< the track
    RainPart = 1 << 2,      ///< which drops there are, how far they are seen, what fog the rest is
    LightPart = 1 << 3,     ///< the environment, and what drops make of it
    LampsPart = 1 << 4,     ///< lamps in the scene
    DepthPart = 1 << 5,     ///< of the scene
    TransferPart = 1 << 6,  ///< the colour transfer
    MattesPart = 1 << 7,    ///< the strokes' atlas
    FogPart = 1 << 8,       ///< fog and veil as functions of depth
};

/// Everything that is made of the parameter. What is made of those parts in turn is not in it (whatBuildsOn).
unsigned partsOf(const Parameter& parameter);
/// The parts with all that is made of them.
unsigned withWhatBuildsOn(unsigned parts);
/// All parts that are not as they were.
unsigned partsThatDiffer(const Settings& before, const Settings& after);

}  // namespace virga::shot
