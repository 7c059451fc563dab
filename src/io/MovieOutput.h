// The container of a movie while it is being written: where the packets go, and what is left if the program is killed.
//
// The movie lies under its temporary name (AtomicFile.h) in a form that plays up to the last finished group of
// pictures. Matroska, NUT, MPEG-TS, AVI and MXF are such a form by nature. MP4 and MOV have their table at the end and
// are nothing without it, so they are written as fragments (ISO 14496-12, 8.8: one fragment a group of pictures) and
// rewritten when whole into the plain file with its table in front that editors expect. What that costs: the file is
// written three times (fragments, plain, table moved to the front), and for a while the folder holds it twice. If there
// is no room for that, the fragments are delivered, with a warning: they play as well.
//
// Standard output (`-`) takes containers that need no way back: NUT, Matroska, WebM, MPEG-TS, Y4M, and MP4 and MOV as
// fragments.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "io/AtomicFile.h"
#include "io/Libav.h"

struct AVDictionary;

namespace virga::io {

/// The path that means standard output.
inline constexpr const char* standardOutput = "-";

class MovieOutput {
public:
    /// `container`: FFmpeg's name of a container or the end of a file's name ("matroska", "mkv"); empty: by the path.
    /// Throws Error(Output) for a path that is no movie's, Error(InvalidArgument) for a container that nobody knows or
    /// that standard output cannot take.
    MovieOutput(const std::string& path, const std::string& container);

    /// Streams and metadata are added here before begin().
    AVFormatContext& context() { return *context_; }
    const AVFormatContext& context() const { return *context_; }
    /// As sentences name it.
    const std::string& name() const { return name_; }
    bool is(const char* muxer) const;
    bool isIsoMedia() const;
    bool isMatroska() const;
    /// Whether chapters that are added just before finish() still get in; else before begin().
    bool takesLateChapters() const { return isMatroska() || isRewritten(); }

    /// Makes the file, so that what cannot be written is known before anything is rendered. Throws Error(Output).
    void open();
    /// Writes the header. `trackTimescale`: ticks a second of the video track, for MP4 and MOV; 0: as the muxer thinks.
    void begin(int trackTimescale);
    /// Takes what the packet refers to. Throws Error(Output).
    void write(AVPacket& packet);
    /// Completes the file and gives it its name.
    void finish();

    /// Throws Error(Output) for a negative result of FFmpeg's.
    void check(int result) const;

private:
    bool isPipe() const { return isPipe_; }
    bool isRewritten() const { return isIsoMedia() && !isPipe(); }
    void tagColor(AVDictionary** options) const;
    /// Gives the whole file its name, as a plain one if that can be made of it.
    void deliver();
    /// Writes the fragments once more as a plain file; false if that fails, with the reason in `problem`.
    bool rewrite(AtomicFile& plain, std::string& problem);

    std::string path_, name_;
    bool isPipe_;
    std::optional<AtomicFile> file_;      // nothing: standard output, or not opened
    std::vector<std::string> leftovers_;  // of earlier runs: they play, so they stay until this one's movie is whole
    libav::Output context_;
    int trackTimescale_ = 0;
    struct Ends {
        std::optional<std::int64_t> first;    // decoding time of the first packet
        std::int64_t last = 0, duration = 0;  // of the last one
    };
    std::vector<Ends> ends_;  // of each stream; fragments do not keep them
};

}  // namespace virga::io
