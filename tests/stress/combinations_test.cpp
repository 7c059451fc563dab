// Shots chosen by chance over the whole parameter table: each renders a frame in which every law holds, or is refused
// in a sentence. VIRGA_STRESS_COUNT and VIRGA_STRESS_SEED make it longer and other (scripts/stress.sh);
// VIRGA_STRESS_ONLY renders one of them.
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>

#include "core/Log.h"
#include "stress/Combination.h"

namespace virga::stress {
namespace {

std::uint32_t fromEnvironment(const char* name, std::uint32_t standard)
{
    const char* text = std::getenv(name);
    return text == nullptr || *text == 0 ? standard : std::uint32_t(std::strtoul(text, nullptr, 10));
}

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

TEST(Combinations, RenderLawfullyOrAreRefused)
{
    log::setLevel(log::Level::Quiet);
    std::signal(SIGALRM, endOfPatience);
    const Files files;
    const std::uint32_t count = fromEnvironment("VIRGA_STRESS_COUNT", 200),
                        seed = fromEnvironment("VIRGA_STRESS_SEED", 1),
                        only = fromEnvironment("VIRGA_STRESS_ONLY", count);
    const bool isOne = only < count || std::getenv("VIRGA_STRESS_ONLY") != nullptr;
    std::uint32_t rendered = 0, refused = 0;
    for (std::uint32_t number = isOne ? only : 0; number < (isOne ? only + 1 : count); ++number) {
        const Combination made = combination(seed, number, files);
        std::strncpy(atWork, made.description.c_str(), sizeof atWork - 1);
        alarm(longest_s);
        try {
            shot::Compositor compositor(made.settings, made.shot,
                                        {.wanted = {.layers = made.layers}, .device = "cpu", .shaderFolder = {}},
                                        {.forLight = {}, .forGrade = {made.plate}});
            io::PlateFrame plate;
            plate.number = made.frame;
            plate.pixels = made.plate;
            const bool isPassThrough = compositor.plan().isPassThrough();
            const io::RenderedFrame frame = compositor.render(std::move(plate));
            // What nothing is done to may hold anything.
            const std::string broken = isPassThrough ? "" : brokenLaw(frame, made.ceiling, made.isOpaque);
            EXPECT_EQ(broken, "") << made.description;
            ++rendered;
        } catch (const Error& error) {
            EXPECT_TRUE(error.code() == ErrorCode::InvalidArgument || error.code() == ErrorCode::Input)
                << error.what() << "\n"
                << made.description;
            if (isOne || std::getenv("VIRGA_STRESS_TELL") != nullptr) std::printf("refused: %s\n", error.what());
            ++refused;
        } catch (const std::exception& exception) {
            ADD_FAILURE() << exception.what() << "\n" << made.description;
        }
        if (isOne) std::printf("%s\n", made.description.c_str());
    }
    alarm(0);
    std::printf("%u rendered, %u refused\n", rendered, refused);
    EXPECT_TRUE(isOne || rendered > count / 2) << "too few to mean something";
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
