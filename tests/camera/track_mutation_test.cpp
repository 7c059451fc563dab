// 10,000 seeded mutations of good tracks through the entry that libFuzzer has (tests/fuzz/track_fuzz.cpp), which ends
// the program at anything that is neither a track of finite poses nor a sentence.
#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using namespace std::string_literals;

/// Choice byte and text.
const std::string seeds[] = {
    "\x10"
    "1 0 2 0 -5 30 0 40\n2 0.5 2 -1 -5 33 0 40\n# end\n"s,
    "\0"
    "1 1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1 40\n2 1 0 0 5 0 1 0 6 0 0 1 8 0 0 0 1 40\n"s,
    "\x06"
    "{\"frames\": [{\"frame\": 7, \"matrix\": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[1,2,3,1]], \"vfov_deg\": 40}]}"s,
    "\x08"
    "{\"1001\": [1,0,0,5,0,1,0,6,0,0,1,7,0,0,0,1]}"s,
    "\x01"
    "# lenses\n1 OPENCV 640 480 500 501 320 240 0.1 -0.01 0 0\n"
    "\0"
    "1 1 0 0 0 0.5 -1 2 1 a/frame_0001.png\n10 20 -1\n2 0.7071 0 0.7071 0 0 0 0 1 frame_0002.png\n\n"s,
};

TEST(TrackMutations, AreTracksOrSentences)
{
    std::mt19937 random(11);
    constexpr char bytes[] = "0123456789.-+eE[]{}\",: \n\t#nanif\xff\x00";
    for (int i = 0; i < 10'000; ++i) {
        std::string input = seeds[std::size_t(i) % std::size(seeds)];
        for (int change = int(random() % 5); change > 0; --change) {
            const std::size_t at = random() % input.size(), length = 1 + random() % 8;
            const char byte = bytes[random() % (sizeof bytes - 1)];
            switch (random() % 4) {
                case 0: input[at] = byte; break;
                case 1: input.insert(at, 1, byte); break;
                case 2: input += input.substr(at, length); break;
                default: input.erase(at, length); break;
            }
            if (input.empty()) input.push_back(0);
        }
        LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(input.data()), input.size());
    }
}

}  // namespace
