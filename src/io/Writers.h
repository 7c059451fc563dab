// The two kinds of PlateWriter.
#pragma once

#include <memory>
#include <string>

#include "io/FrameSource.h"

namespace virga::io {

/// Whether a file of this name is a movie for createPlateWriter.
bool isMovieName(const std::string& path);

/// Both throw what createPlateWriter says. `origin` is null for plates that are no movie and must outlive the writer.
std::unique_ptr<PlateWriter> createMovieWriter(const std::string& path, const PlateInfo& plate,
                                               const MovieOrigin* origin, const WriteOptions& options);
std::unique_ptr<PlateWriter> createSequenceWriter(const std::string& path, const PlateInfo& plate,
                                                  const MovieOrigin* origin, const WriteOptions& options);

/// Throws as createMovieWriter does, but makes no file.
void checkMovieWriter(const std::string& path, const PlateInfo& plate, const MovieOrigin* origin,
                      const WriteOptions& options);

/// copyMovie, whose names have been checked.
MovieCopyResult copyMoviePackets(const std::string& path, const MovieOrigin& origin,
                                 const std::vector<FrameNumber>& frames, const std::string& container,
                                 const std::function<bool(std::size_t copied)>& goesOn);

/// What a frame's pixels take up.
std::size_t bytesOf(const RenderedFrame& frame);

/// The space that pictures go out in if nobody asked for one: the plate's own where the file can hold it; its linear
/// light in floating point files; its linear light with the sRGB curve in files of integers or movies.
std::string defaultOutputColorspace(const PlateInfo& plate, bool outputIsFloat);

}  // namespace virga::io
