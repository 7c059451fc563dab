#include "passes/PlanesPass.h"

#include <algorithm>
#include <cassert>
#include <cstring>

namespace virga::passes {
namespace {

constexpr GLuint layoutIndex = 1, codesIndex = 2;  // as common_planes.glsl; the stroke pass has them again later

using Family = PlanarFormat::Family;

int samplesPerWord(const PlanarFormat& format) { return 4 / format.bytesPerSample(); }

/// Width and height of a plane, in samples.
std::array<int, 2> sizeOf(const PlanarFormat& format, int plane, int width, int height)
{
    const bool isChroma = format.family == Family::Yuv && (plane == 1 || plane == 2);
    if (!isChroma) return {width, height};
    return {(width + (1 << format.chromaShiftX) - 1) >> format.chromaShiftX,
            (height + (1 << format.chromaShiftY) - 1) >> format.chromaShiftY};
}

/// Planes one after the other, rows of whole words.
template <class Byte>
shared::PlanesLayout layoutOf(const BasicCodedPlanes<Byte>& p, std::size_t& words)
{
    shared::PlanesLayout layout{};
    words = 0;
    for (int plane = 0; plane < p.format.planes(); ++plane) {
        const auto [width, height] = sizeOf(p.format, plane, p.picture.width, p.picture.height);
        const int perWord = samplesPerWord(p.format), stride = (width + perWord - 1) / perWord;
        layout.first[plane] = std::uint32_t(words);
        layout.stride[plane] = std::uint32_t(stride);
        words += std::size_t(stride) * std::size_t(height);
    }
    layout.size = {p.picture.width, p.picture.height, 0, 0};
    const auto top = float((1 << p.format.bits) - 1), unit = float(1 << (p.format.bits - 8));
    const bool isFull = p.coding.fullRange;
    layout.luma = {isFull ? 0.0f : 16 * unit, 1 / (isFull ? top : 219 * unit), top, 0};
    layout.chroma = {128 * unit, 1 / (isFull ? top : 224 * unit), top, 0};
    layout.alpha = {0, 1 / top, top, 0};
    const double kr = p.coding.kr, kb = p.coding.kb, kg = 1 - kr - kb;
    layout.weights = p.coding.isYCgCo ? glm::vec4(0.25f, 0.5f, 0.25f, 0) : glm::vec4(kr, kg, kb, 0);
    layout.fromChroma = {2 * (1 - kr), 2 * (1 - kb), -2 * (1 - kb) * kb / kg, -2 * (1 - kr) * kr / kg};
    layout.curve = {p.curve.power, p.curve.offset, p.curve.slope, p.curve.toe};
    layout.site = {p.chroma.x.site, p.chroma.y.site, 0, 0};
    return layout;
}

template <class Byte>
gl::Defines definesOf(const BasicCodedPlanes<Byte>& p)
{
    gl::Defines defines = {{"BITS", std::to_string(p.format.bits)},
                           {"SHIFT_X", std::to_string(p.format.chromaShiftX)},
                           {"SHIFT_Y", std::to_string(p.format.chromaShiftY)}};
    const auto add = [&](bool wanted, const char* word) {
        if (wanted) defines.emplace_back(word, "");
    };
    add(p.format.family == Family::Rgb, "FAMILY_RGB");
    add(p.format.family == Family::Grey, "FAMILY_GREY");
    add(p.format.hasAlpha, "ALPHA");
    add(p.coding.isYCgCo, "YCGCO");
    add(p.chroma.x.isInterpolated && p.format.chromaShiftX > 0, "SMOOTH_X");
    add(p.chroma.y.isInterpolated && p.format.chromaShiftY > 0, "SMOOTH_Y");
    return defines;
}

template <class Byte>
bool isAlike(const BasicCodedPlanes<Byte>& a, const BasicCodedPlanes<Byte>& b)
{
    const auto axis = [](const ChromaAxis& x, const ChromaAxis& y) {
        return x.isInterpolated == y.isInterpolated && x.site == y.site;
    };
    return a.format == b.format && a.coding == b.coding && axis(a.chroma.x, b.chroma.x) &&
           axis(a.chroma.y, b.chroma.y) && a.curve.power == b.curve.power && a.curve.offset == b.curve.offset &&
           a.curve.slope == b.curve.slope && a.curve.toe == b.curve.toe && a.picture.width == b.picture.width &&
           a.picture.height == b.picture.height;
}

/// Calls copy(row in the picture, row in the words, bytes) for every row of every plane.
template <class Byte, class Copy>
void forRows(const BasicCodedPlanes<Byte>& p, std::uint8_t* words, const Copy& copy)
{
    for (int plane = 0; plane < p.format.planes(); ++plane) {
        const auto [width, height] = sizeOf(p.format, plane, p.picture.width, p.picture.height);
        const int perWord = samplesPerWord(p.format);
        const auto bytes = std::size_t(width) * std::size_t(p.format.bytesPerSample());
        Byte* row = p.picture.planes[std::size_t(plane)];
        for (int y = 0; y < height; ++y) {
            copy(row, words, bytes);
            row += p.picture.strides[std::size_t(plane)];
            words += 4 * std::size_t((width + perWord - 1) / perWord);
        }
    }
}

}  // namespace

bool convertsOnDevice(const PlanarFormat& format)
{
    constexpr int mostBits = 12;
    return format.bits <= mostBits;
}

PlanesIn::PlanesIn(const ConstCodedPlanes& like, const std::string& shaderFolder)
    : like_(like), program_("pass_planes_in.comp", definesOf(like), shaderFolder)
{
    std::size_t words = 0;
    const shared::PlanesLayout layout = layoutOf(like, words);
    layout_ = gl::Buffer(sizeof layout, 0, &layout);
    codes_ = gl::Buffer(4 * words, 0);
    for (Slot& slot : slots_) slot.codes = gl::MappedBuffer(4 * words, gl::MappedBuffer::Way::ToDevice);
}

bool PlanesIn::fits(const ConstCodedPlanes& picture) const { return isAlike(picture, like_); }

void PlanesIn::run(const ConstCodedPlanes& picture, const FrameTargets& targets)
{
    assert(fits(picture) && targets.width() == picture.picture.width && targets.height() == picture.picture.height);
    Slot& slot = slots_[next_++ % transfersInFlight];
    slot.used.wait();
    forRows(picture, slot.codes.data(),
            [](const std::uint8_t* from, std::uint8_t* to, std::size_t bytes) { std::memcpy(to, from, bytes); });
    glCopyNamedBufferSubData(slot.codes.name(), codes_.name(), 0, 0, GLsizeiptr(codes_.bytes()));
    slot.used.place();
    layout_.bindStorage(layoutIndex);
    codes_.bindStorage(codesIndex);
    targets.plate.bindImage(0, GL_WRITE_ONLY);
    program_.dispatch(gl::groupsFor(targets.width(), 16), gl::groupsFor(targets.height(), 16));
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
}

PlanesOut::PlanesOut(const CodedPlanes& like, const std::string& shaderFolder)
    : like_(like), program_("pass_planes_out.comp", definesOf(like), shaderFolder)
{
    std::size_t words = 0;
    const shared::PlanesLayout layout = layoutOf(like, words);
    layout_ = gl::Buffer(sizeof layout, 0, &layout);
    codes_ = gl::Buffer(4 * words, 0);
    for (Slot& slot : slots_) slot.codes = gl::MappedBuffer(4 * words, gl::MappedBuffer::Way::FromDevice);
}

bool PlanesOut::fits(const CodedPlanes& picture) const { return isAlike(picture, like_); }

void PlanesOut::run(const FrameTargets& targets)
{
    assert(next_ - oldest_ < transfersInFlight);
    Slot& slot = slots_[next_++ % transfersInFlight];
    layout_.bindStorage(layoutIndex);
    codes_.bindStorage(codesIndex);
    const int columns = samplesPerWord(like_.format) << like_.format.chromaShiftX;
    program_.dispatch(gl::groupsFor(targets.width(), 8 * columns),
                      gl::groupsFor(targets.height(), 8 << like_.format.chromaShiftY));
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
    glCopyNamedBufferSubData(codes_.name(), slot.codes.name(), 0, 0, GLsizeiptr(codes_.bytes()));
    slot.done.place();
    glFlush();  // so that the device begins before anybody waits
}

void PlanesOut::finish(const CodedPlanes& picture)
{
    assert(oldest_ < next_ && fits(picture));
    Slot& slot = slots_[oldest_++ % transfersInFlight];
    slot.done.wait();
    forRows(picture, slot.codes.data(),
            [](std::uint8_t* to, const std::uint8_t* from, std::size_t bytes) { std::memcpy(to, from, bytes); });
}

}  // namespace virga::passes
