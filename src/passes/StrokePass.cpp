#include "passes/StrokePass.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "passes/StrokeMattes.h"

namespace virga::passes {
namespace {

/// Footprints up to this are walked by one invocation; more rows or columns are shared by a work group [px^2].
constexpr float largestSmallFootprint = 1024;
/// Columns of work groups that share the rows of a stroke larger than that: a drop right before the lens has thousands.
constexpr std::uint32_t groupsPerLargeStroke = 16;

/// As pass_emit_strokes.comp has it. Large groups queue less at the counters that the whole device shares.
std::size_t emitGroupSize(const Features& features) { return features.software ? 64 : 256; }

gl::Defines definesOf(const Features& features, std::initializer_list<const char*> more = {})
{
    gl::Defines defines;
    if (features.fog) defines.emplace_back("FOG", "");
    if (features.depth) defines.emplace_back("DEPTH", "");
    if (features.nearest) defines.emplace_back("NEAREST", "");
    if (features.lights) defines.emplace_back("LIGHTS", "");
    if (features.cameraMotion) defines.emplace_back("CAMERA_MOTION", "");
    if (!features.software) defines.emplace_back("GROUPED", "");
    for (const char* word : more) defines.emplace_back(word, "");
    return defines;
}

}  // namespace

StrokePass::StrokePass(const Features& features, const matte::StrokeAtlas& atlas, const gl::ShaderPlaces& places)
    : features_(features), atlas_(atlas), emit_("pass_emit_strokes.comp", definesOf(features), places),
      splatSmall_("pass_splat_strokes.comp", definesOf(features, {"SMALL"}), places),
      splatLarge_("pass_splat_strokes.comp", definesOf(features), places), lists_(8 * sizeof(std::uint32_t))
{
    if (features.nearest) {
        motionSmall_ = gl::Program("pass_splat_strokes.comp", definesOf(features, {"NEAREST_MOTION", "SMALL"}), places);
        motionLarge_ = gl::Program("pass_splat_strokes.comp", definesOf(features, {"NEAREST_MOTION"}), places);
    }
    const std::vector<float> prefix = normalisedPrefix(atlas_);
    alongPrefix_ = gl::Buffer(prefix.size() * sizeof(float), 0, prefix.data());
    mattes_ = gl::Texture::make2DArray(GL_R32F, atlas_.width, atlas_.height, atlas_.count());
    mattes_.upload(GL_RED, GL_FLOAT, rowDensities(atlas_).data());
}

void StrokePass::describe(shared::FrameConstants& constants, const particles::CellList& list) const
{
    constants.picture.z = std::uint32_t(list.drops);
    constants.picture.w = std::uint32_t(std::max<std::size_t>(list.drops, 1));
    constants.atlas = {float(atlas_.groups), float(atlas_.variants), atlas_.firstBeadCycles, atlas_.groupsPerOctave};
    constants.atlasSize = {float(atlas_.width), float(atlas_.height), atlas_.acrossDiameters, largestSmallFootprint};
}

void StrokePass::run(const FrameTargets& targets, const particles::CellList& list, gl::PassTimer& timer)
{
    constexpr std::array<std::uint32_t, 8> noStrokes = {0, 1, 1, 0, 0, groupsPerLargeStroke, 1, 0};
    lists_.upload(noStrokes.data(), sizeof noStrokes);
    lists_.bindStorage(StrokeListsIndex);
    if (features_.nearest) {
        constexpr float infinity = std::numeric_limits<float>::infinity();
        glClearNamedBufferData(targets.nearestDepth.name(), GL_R32F, GL_RED, GL_FLOAT, &infinity);
        glClearNamedBufferData(targets.nearestMotion.name(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
    }
    if (list.cells.empty()) return;

    const std::size_t wavesBytes = sizeof list.waves;
    const std::size_t classesBytes = list.classes.size() * sizeof(shared::DropClass);
    cells_.reserve(list.cells.size() * sizeof(shared::Cell));
    classes_.reserve(wavesBytes + classesBytes);
    strokes_.reserve(list.drops * (features_.lights ? shared::litStrokeBytes : sizeof(shared::Stroke)));
    blocks_.reserve(list.blocks.size() * sizeof(std::uint32_t));
    cells_.upload(std::span(list.cells));
    blocks_.upload(std::span(list.blocks));
    classes_.upload(list.waves.data(), wavesBytes);
    classes_.upload(list.classes.data(), classesBytes, wavesBytes);
    cells_.bindStorage(CellsIndex);
    blocks_.bindStorage(BlocksIndex);
    classes_.bindStorage(ClassesIndex);
    strokes_.bindStorage(StrokesIndex);
    alongPrefix_.bindStorage(AlongPrefixIndex);
    mattes_.bind(MattesUnit);

    timer.mark("list");

    // One invocation a drop; work groups in rows that no device finds too long.
    const std::size_t groups = (list.drops + emitGroupSize(features_) - 1) / emitGroupSize(features_);
    emit_.set("cellCount", GLuint(list.cells.size()));
    emit_.dispatch(GLuint(std::min<std::size_t>(groups, 65535)), GLuint((groups + 65534) / 65535));
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT);
    timer.mark("drops");
    splat(splatSmall_, splatLarge_);
    if (features_.nearest) {
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        splat(motionSmall_, motionLarge_);
    }
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    timer.mark("strokes");
}

void StrokePass::splat(const gl::Program& small, const gl::Program& large) const
{
    small.dispatchIndirect(lists_.name(), 0);
    large.dispatchIndirect(lists_.name(), 4 * sizeof(std::uint32_t));
}

std::size_t StrokePass::strokeCount() const
{
    std::array<std::uint32_t, 8> lists{};
    lists_.download(lists.data(), sizeof lists);
    return strokesIn(lists.data());
}

void StrokePass::copyCount(GLuint buffer, std::size_t offset) const
{
    glCopyNamedBufferSubData(lists_.name(), buffer, 0, GLintptr(offset), GLsizeiptr(countBytes));
}

std::size_t StrokePass::strokesIn(const void* count)
{
    std::array<std::uint32_t, 8> lists{};
    std::memcpy(lists.data(), count, sizeof lists);
    return std::size_t(lists[3]) + lists[7];
}

}  // namespace virga::passes
