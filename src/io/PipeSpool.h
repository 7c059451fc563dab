// What comes down a pipe, kept in a file.
//
// A frame is asked for by number, and in any order: the light is made from frames of the whole plate before the first
// one is rendered, --frames may go backwards, and how many frames there are has to be known at the start. A stream that
// is read once and forward has none of that, so it is spooled: read to its end into a file first. Time stamps, MP4
// with its table at the end, sound and timecode then work as for any file. The price is disk space for one copy of
// what was sent, and that rendering starts when the sender has ended.
#pragma once

#include <string>

namespace virga::io {

/// Whether `path` is "-" (standard input), a named pipe or a socket: something that can be read once only.
bool isPipe(const std::string& path);

/// A file in $TMPDIR (/tmp) that never has a name, so that nothing is left behind however the process ends.
class PipeSpool {
public:
    /// Reads all that comes. "-" that is a file (`virga rain - < clip.mp4`) is used in place.
    /// Throws Error(Input) if standard input is a terminal, if nothing comes or reading fails, Error(Output) naming the
    /// folder if there is no room.
    explicit PipeSpool(const std::string& path);
    ~PipeSpool();
    PipeSpool(const PipeSpool&) = delete;
    PipeSpool& operator=(const PipeSpool&) = delete;

    /// A path that opens it anew, for this process, as long as this object lives.
    std::string path() const;

private:
    int file_ = -1;
};

}  // namespace virga::io
