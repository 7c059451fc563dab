// Adds the strokes to the accumulators. SMALL: one invocation a stroke; else a column of work groups a stroke, a row an
// invocation, for the few that cover many pixels.
#include "common_frame.glsl"
#include "strokes_splat.glsl"

layout(local_size_x = 64) in;

layout(std430, binding = 3) readonly buffer Strokes { Stroke strokes[]; };
layout(std430, binding = 6) readonly buffer Lists
{
    uint smallGroups, smallY, smallZ, smallCount;
    uint largeGroups, largeY, largeZ, largeCount;
};

void main()
{
#ifdef SMALL
    if (gl_GlobalInvocationID.x >= smallCount) return;
    Stroke stroke = strokes[gl_GlobalInvocationID.x];
    Walk walk = walkOf(stroke);
    if (stroke.look.w > 0.0) {
        for (int row = walk.rows.x; row < walk.rows.y; ++row)
            splatRow(stroke, walk, row, blurredShare(stroke, walk, row));
        return;
    }
    float before = massBefore(stroke, walk, float(walk.rows.x));
    for (int row = walk.rows.x; row < walk.rows.y; ++row) {
        float after = massBefore(stroke, walk, float(row) + 1.0);
        splatRow(stroke, walk, row, after - before);
        before = after;
    }
#else
    Stroke stroke = strokes[frame.picture.w - 1u - gl_WorkGroupID.x];
    Walk walk = walkOf(stroke);
    int first = walk.rows.x + int(gl_GlobalInvocationID.y * gl_WorkGroupSize.x + gl_LocalInvocationID.x);
    for (int row = first; row < walk.rows.y; row += int(gl_NumWorkGroups.y * gl_WorkGroupSize.x))
        splatRow(stroke, walk, row, blurredShare(stroke, walk, row));
#endif
}
