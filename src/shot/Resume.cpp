#include "shot/Resume.h"

#include <sys/stat.h>

#include <string_view>

#include "core/Error.h"
#include "core/Parallel.h"
#include "shot/CameraTrack.h"
#include "shot/Parameters.h"
#include "shot/PlateSamples.h"

namespace virga::shot {
namespace {

/// FNV-1a, 64 bits (Fowler, Noll, Vo). Fields are ended, so that "a","bc" is not "ab","c".
class Fingerprint {
public:
    Fingerprint() = default;
    explicit Fingerprint(std::uint64_t state) : state_(state) {}

    void add(std::string_view text)
    {
        for (const char c : text) add(std::uint8_t(c));
        add(std::uint8_t(0));
    }
    void add(std::int64_t number)
    {
        for (int i = 0; i < 64; i += 8) add(std::uint8_t(std::uint64_t(number) >> i));
    }
    /// Name, size and time of change; of a file that is not there, the name.
    void addFile(const std::string& path)
    {
        add(path);
        struct stat found {};
        if (path.empty() || ::stat(path.c_str(), &found) != 0) return;
        add(std::int64_t(found.st_size));
        add(std::int64_t(found.st_mtim.tv_sec));
        add(std::int64_t(found.st_mtim.tv_nsec));
    }
    std::uint64_t state() const { return state_; }

private:
    void add(std::uint8_t byte) { state_ = (state_ ^ byte) * 0x100000001b3u; }

    std::uint64_t state_ = 0xcbf29ce484222325u;
};

/// Of a pattern every frame that there is.
void addFiles(Fingerprint& print, const std::string& path)
{
    if (path.empty()) return;
    print.addFile(path);
    print.addFile(path + ".json");
    if (!io::isFramePattern(path)) return;
    for (const FrameNumber frame : io::findFrames(path)) print.addFile(io::framePath(path, frame));
}

/// A frame's shutter closes where the next frames' headers say: all of them count for each.
void addPlateCamera(Fingerprint& print, const Settings& settings, const io::PlateInfo& plate)
{
    std::optional<camera::TrackReading> reading;
    try {
        reading = readPlateCamera(settings, plate);
    } catch (const Error&) {  // said where the shot's track is made
    }
    if (!reading) return;
    for (const auto& [frame, pose] : reading->track.poses()) {
        print.add(fmt::format("{} {}", frame, pose.verticalFov.value_or(0)));
        for (int i = 0; i < 3; ++i) {
            const glm::dvec3& axis = pose.worldFromCamera[i];
            print.add(fmt::format("{} {} {} {}", pose.position[i], axis.x, axis.y, axis.z));
        }
    }
}

}  // namespace

FrameFingerprints::FrameFingerprints(const Settings& s, const io::PlateInfo& plate, bool layers, bool half)
    : plate_(plate.path), depth_(s.depth), isPlatePattern_(io::isFramePattern(plate.path)),
      isDepthPattern_(io::isFramePattern(s.depth))
{
    Fingerprint print;
    print.add(VIRGA_VERSION);
    for (const Parameter& p : parameters()) {
        if (std::string_view(p.name) == "on-error") continue;
        print.add(p.name);
        print.add(toText(s, p));
    }
    for (const std::int64_t number : {std::int64_t(layers), std::int64_t(half), std::int64_t(plate.width),
                                      std::int64_t(plate.height), plate.frames.front()})
        print.add(number);
    print.add(fmt::format("{}", plate.fps));
    for (const FrameNumber frame : sampledFrames(plate, s))
        print.addFile(isPlatePattern_ ? io::framePath(plate_, frame) : plate_);
    for (const std::string* file : {&s.env, &s.lights, &s.mattes, &s.camera, &s.gradeFrom, &s.ocio})
        addFiles(print, *file);
    for (const char* file : {"/cameras.txt", "/images.txt"})  // of a COLMAP model
        if (hasCameraFile(s)) addFiles(print, s.camera + file);
    addPlateCamera(print, s, plate);
    common_ = print.state();
}

std::string FrameFingerprints::of(FrameNumber frame) const
{
    Fingerprint print(common_);
    print.add(frame);
    print.addFile(isPlatePattern_ ? io::framePath(plate_, frame) : plate_);
    print.addFile(isDepthPattern_ ? io::framePath(depth_, frame) : depth_);
    return fmt::format("Virga {}, made of {:016x}", VIRGA_VERSION, print.state());
}

std::vector<FrameNumber> framesToMake(const std::vector<FrameNumber>& frames, const std::string& pattern,
                                      const FrameFingerprints& fingerprints)
{
    std::vector<char> isThere(frames.size());
    parallelFor(0, std::ptrdiff_t(frames.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto i = std::size_t(first); i < std::size_t(last); ++i)
            isThere[i] = io::wholeImageSoftware(io::framePath(pattern, frames[i])) == fingerprints.of(frames[i]);
    });
    std::vector<FrameNumber> rest;
    for (std::size_t i = 0; i < frames.size(); ++i)
        if (!isThere[i]) rest.push_back(frames[i]);
    return rest;
}

}  // namespace virga::shot
