#include "io/Helpers.h"

#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <random>
#include <sstream>

namespace virga::io::test {

namespace fs = std::filesystem;

TemporaryFolder::TemporaryFolder()
{
    static int count = 0;
    path_ = fs::temp_directory_path() / fmt::format("virga_io_test.{}.{}", getpid(), ++count);
    fs::create_directories(path_);
}

TemporaryFolder::~TemporaryFolder()
{
    std::error_code ignored;
    fs::permissions(path_, fs::perms::owner_all, ignored);
    fs::remove_all(path_, ignored);
}

std::string run(const std::string& command)
{
    std::string output;
    FILE* pipe = popen(command.c_str(), "r");
    if (pipe == nullptr) {
        ADD_FAILURE() << command;
        return output;
    }
    std::array<char, 4096> buffer;
    while (std::size_t count = std::fread(buffer.data(), 1, buffer.size(), pipe)) output.append(buffer.data(), count);
    EXPECT_EQ(pclose(pipe), 0) << command;
    return output;
}

void makeMovie(const std::string& path, const std::string& arguments, int frames, const std::string& size,
               const std::string& source, const std::string& rate)
{
    // Counting pictures would make ffmpeg cut the sound where the last one came, so sound is given with a duration.
    const std::string length = arguments.find(" -t ") == std::string::npos ? fmt::format("-frames:v {}", frames) : "";
    run(fmt::format("ffmpeg -v error -y -f lavfi -i {}=size={}:rate={},noise=alls=30:allf=t:all_seed=7 {} {} '{}'",
                    source, size, rate, arguments, length, path));
}

void expectSameFrames(const std::vector<std::pair<std::string, std::string>>& pairs)
{
    std::string inputs, maps;
    int count = 0;
    for (const auto& [a, b] : pairs) {
        inputs += fmt::format(" -i '{}' -i '{}'", a, b);
        maps += fmt::format(" -map {}:v -map {}:v", count, count + 1);
        count += 2;
    }
    std::istringstream lines(
        run(fmt::format("ffmpeg -v error{}{} -fps_mode passthrough -f streamhash -hash md5 -", inputs, maps)));
    std::vector<std::string> hashes;
    for (std::string line; std::getline(lines, line);) hashes.push_back(line.substr(line.find("MD5=")));
    ASSERT_EQ(hashes.size(), 2 * pairs.size());
    for (std::size_t i = 0; i < pairs.size(); ++i)
        EXPECT_EQ(hashes[2 * i], hashes[2 * i + 1]) << pairs[i].first << " and " << pairs[i].second;
}

std::vector<std::string> frameHashes(const std::string& path, const std::string& arguments)
{
    std::istringstream lines(run(fmt::format(
        "ffmpeg -v error -noautorotate -i '{}' -map 0:v:0 -fps_mode passthrough {} -f framemd5 -", path, arguments)));
    std::vector<std::string> hashes;
    for (std::string line; std::getline(lines, line);)
        if (!line.empty() && line[0] != '#') hashes.push_back(line.substr(line.rfind(' ') + 1));
    return hashes;
}

std::size_t copyPlate(const std::string& from, const std::string& to, const WriteOptions& write,
                      const ReadOptions& read, const std::vector<FrameNumber>& frames)
{
    const auto reader = openPlate(from, read);
    const auto writer = createPlateWriter(to, *reader, write);
    const auto& wanted = frames.empty() ? reader->info().frames : frames;
    reader->schedule(wanted);
    std::size_t count = 0;
    for (const FrameNumber number : wanted) {
        auto frame = reader->read(number);
        if (!frame) continue;
        writer->write({number, std::move(frame->pixels), {}, frame->extras});
        ++count;
    }
    writer->finish();
    return count;
}

ImageF noise(int width, int height, int channels, float low, float high, std::uint32_t seed)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> color(low, high), unit(0.0f, 1.0f);
    ImageF image(width, height, channels);
    for (std::size_t i = 0; i < image.size(); ++i) image.data()[i] = i % 4 == 3 ? unit(random) : color(random);
    return image;
}

bool sameBits(ConstImageViewF a, ConstImageViewF b)
{
    if (a.width() != b.width() || a.height() != b.height() || a.channels() != b.channels()) return false;
    for (int y = 0; y < a.height(); ++y)
        if (std::memcmp(a.row(y), b.row(y), std::size_t(a.width()) * std::size_t(a.channels()) * sizeof(float)) != 0)
            return false;
    return true;
}

std::string footage(const std::string& name)
{
    const char* folder = std::getenv("VIRGA_FOOTAGE_DIR");
    if (folder == nullptr) return {};
    const fs::path path = fs::path(folder) / name;
    return fs::exists(path) ? path.string() : std::string();
}

}  // namespace virga::io::test
