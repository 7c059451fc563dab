// Shots chosen by chance over the whole parameter table: each renders a frame in which every law holds, or is refused
// in a sentence. VIRGA_STRESS_COUNT and VIRGA_STRESS_SEED make it longer and other (scripts/stress.sh);
// VIRGA_STRESS_ONLY renders one of them.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include "core/Log.h"
#include "stress/Combination.h"
#include "stress/Run.h"

namespace virga::stress {
namespace {

/// No frame of a few pixels takes this long, on any machine; what is at work then is said before the end.
constexpr unsigned longest_s = 120;
char atWork[4096];

void endOfPatience(int)
{
    constexpr char words[] = "takes longer than two minutes: ";
    [[maybe_unused]] ssize_t written = write(STDERR_FILENO, words, sizeof words - 1);
    written = write(STDERR_FILENO, atWork, std::strlen(atWork));
    written = write(STDERR_FILENO, "\n", 1);
    _exit(1);
}

/// Renders shots from number `first` on; how many of them were not refused. A GL error, which is looked for after each
/// frame, is a failure like a law that is broken.
std::uint32_t rendered(std::uint32_t first, std::uint32_t count, const std::string& device)
{
    log::setLevel(log::Level::Quiet);
    std::signal(SIGALRM, endOfPatience);
    const Files files;
    const std::uint32_t seed = fromEnvironment("VIRGA_STRESS_SEED", 1);
    const bool isTold = count == 1 || std::getenv("VIRGA_STRESS_TELL") != nullptr;
    std::uint32_t done = 0;
    for (std::uint32_t number = first; number < first + count; ++number) {
        const Combination made = combination(seed, number, files);
        std::strncpy(atWork, made.description.c_str(), sizeof atWork - 1);
        alarm(longest_s);
        try {
            shot::Compositor compositor(made.settings, made.shot,
                                        {.wanted = {.layers = made.layers}, .device = device, .shaderFolder = {}},
                                        {.forLight = {}, .forGrade = {made.plate}});
            io::PlateFrame plate;
            plate.number = made.frame;
            plate.pixels = made.plate;
            const bool isPassThrough = compositor.plan().isPassThrough();
            const io::RenderedFrame frame = compositor.render(std::move(plate));
            // What nothing is done to may hold anything.
            const std::string broken = isPassThrough ? "" : brokenLaw(frame, made.ceiling, made.isOpaque);
            EXPECT_EQ(broken, "") << made.description;
            ++done;
        } catch (const Error& error) {
            EXPECT_TRUE(error.code() == ErrorCode::InvalidArgument || error.code() == ErrorCode::Input)
                << error.what() << "\n"
                << made.description;
            if (isTold) std::printf("refused: %s\n", error.what());
        } catch (const std::exception& exception) {
            ADD_FAILURE() << exception.what() << "\n" << made.description;
        }
        if (count == 1) std::printf("%s\n", made.description.c_str());
    }
    alarm(0);
    std::printf("%u rendered, %u refused\n", done, count - done);
    return done;
}

/// That of VIRGA_STRESS_ONLY, or `count` of them, of which a share must not be refused for the test to mean something.
void renderLawfully(std::uint32_t first, std::uint32_t count, double share, const std::string& device)
{
    if (const char* only = std::getenv("VIRGA_STRESS_ONLY"); only != nullptr && *only != 0)
        rendered(fromEnvironment("VIRGA_STRESS_ONLY", 0), 1, device);
    else
        EXPECT_GT(rendered(first, count, device), share * count);
}

TEST(Combinations, RenderLawfullyOrAreRefused)
{
    renderLawfully(0, fromEnvironment("VIRGA_STRESS_COUNT", 200), 0.5, "cpu");
}

// The same by shaders. Each shot compiles its own, so there are fewer.
TEST(Combinations, RenderLawfullyThroughShaders)
{
    const auto device = shaderDevice();
    if (!device) GTEST_SKIP() << "no OpenGL device";
    renderLawfully(1000, std::max(fromEnvironment("VIRGA_STRESS_COUNT", 200) / 20, 1u), 0.3, *device);
}

// Beyond its range a setting is refused by name, and stays what it was.
TEST(Combinations, NothingBeyondARangeIsTaken)
{
    for (const shot::Parameter& p : shot::parameters())
        for (const std::string& value : valuesBeyond(p)) {
            shot::Settings settings;
            const std::string before = shot::toText(settings, p);
            const std::string sentence =
                test::sentenceOf(ErrorCode::InvalidArgument, [&] { shot::setFromText(settings, p, value); });
            EXPECT_SAYS(sentence, std::string("--") + p.name) << " " << value;
            EXPECT_SAYS(sentence, "must be");
            EXPECT_EQ(shot::toText(settings, p), before) << p.name << " " << value;
        }
}

}  // namespace
}  // namespace virga::stress
