// Which pictures a movie has: frame n is the n-th in the order of showing, whatever the codec's order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "io/MovieInput.h"

namespace virga::io {

struct Picture {
    std::int64_t time = 0;        ///< presentation, in the stream's time base; a count if the index countsPictures
    std::int64_t decodeTime = 0;  ///< AV_NOPTS_VALUE if the container has none
    std::int64_t duration = 0;
    std::size_t order = 0;  ///< of decoding, counted from 0
    bool isKey = false;
    bool isDamaged = false;  ///< the packet is cut off or known to be wrong
};

struct PictureIndex {
    std::vector<Picture> pictures;  ///< in the order of showing, without those that an edit list hides
    bool countsPictures = false;    ///< no time stamps: pictures are counted, and reached from the start alone
    bool isPlain = true;            ///< every packet is one of `pictures`, whole, and its time stamp is its own
    bool hasChecksums = false;      ///< FFV1 packets that carry a CRC

    /// The last key picture that is shown at `index` or before, `earlier` keys before that one; null before the first.
    const Picture* keyFor(std::size_t index, int earlier) const;
    /// The last picture that may build on the one at `index`: the one before the next key picture.
    std::size_t lastBuiltOn(std::size_t index) const;
};

/// Reads all packets of the stream, to the end of the file; nothing is decoded. Leaves `input` at its end. Warns of a
/// file that has fewer pictures than it promises. Throws Error(Input) if there is no picture.
PictureIndex listPictures(MovieInput& input);

}  // namespace virga::io
