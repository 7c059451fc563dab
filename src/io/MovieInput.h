// A movie's container, opened, with one of its video streams chosen.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/Libav.h"
#include "io/PipeSpool.h"

struct AVStream;

namespace virga::io {

/// Indices of the streams that are video, in the order of the file. Pictures that are attached to sound (covers) and
/// thumbnails are not.
std::vector<int> videoStreamsOf(const AVFormatContext& container);

class MovieInput {
public:
    /// path    a file, "-" for standard input, or a named pipe; what can be read only once is spooled (PipeSpool.h)
    /// number  which of the video streams, counted from 0; nothing: the one that is marked as default, else the one
    /// with
    ///         most frames or bits
    /// Throws Error(Input) for what is missing, empty, a folder, no movie, without video or cut off before its first
    /// picture; Error(InvalidArgument) for a number that it does not have.
    MovieInput(const std::string& path, std::optional<int> number);

    /// From the first packet again.
    void reopen();

    const std::string& name() const { return name_; }  ///< for sentences: as the user gave it, or "standard input"
    std::string path() const { return spool_ ? spool_->path() : name_; }  ///< opens the same bytes again
    AVFormatContext* container() const { return container_.get(); }
    AVStream* stream() const;
    int streamIndex() const { return streamIndex_; }

    /// The stream's next packet that holds anything; false after the last one, or where the file breaks off.
    bool read(AVPacket& packet);

private:
    void chooseStream(std::optional<int> number);

    std::string name_;
    std::unique_ptr<PipeSpool> spool_;
    libav::Input container_;
    int streamIndex_ = -1;
};

}  // namespace virga::io
