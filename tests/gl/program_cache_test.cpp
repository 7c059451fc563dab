// Programs that are kept as the driver's binaries.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/Error.h"
#include "gl/Context.h"
#include "gl/Objects.h"
#include "gl/Program.h"
#include "support/Files.h"

namespace virga::gl {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

constexpr const char* shader = R"(
layout(local_size_x = 1) in;
layout(std430, binding = 0) buffer Out { uint value; };
void main() { value = NUMBER; }
)";

std::uint32_t valueOf(const Program& program)
{
    Buffer buffer(sizeof(std::uint32_t));
    buffer.clear();
    buffer.bindStorage(0);
    program.dispatch(1);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    std::uint32_t value = 0;
    buffer.download(&value, sizeof value);
    return value;
}

class ProgramCache : public testing::Test {
protected:
    ProgramCache() : places(folder.path())
    {
        folder.write("number.comp", shader);
        places.programs = KeptFiles(folder / "kept");
    }
    Program program(const char* number) const { return {"number.comp", {{"NUMBER", number}}, places}; }
    std::vector<fs::path> files() const
    {
        std::vector<fs::path> found;
        if (fs::exists(folder / "kept"))
            for (const auto& entry : fs::directory_iterator(folder / "kept")) found.push_back(entry.path());
        return found;
    }

    const TemporaryFolder folder;
    const Context context;
    ShaderPlaces places;
};

TEST_F(ProgramCache, GivesTheProgramOfTheTextAndDefines)
{
    EXPECT_EQ(valueOf(program("7u")), 7u);
    if (files().empty()) GTEST_SKIP() << context.device().renderer << " gives no binaries";
    EXPECT_EQ(valueOf(program("8u")), 8u);
    EXPECT_EQ(files().size(), 2u);
    EXPECT_EQ(valueOf(program("7u")), 7u);
    EXPECT_EQ(valueOf(program("8u")), 8u);
    EXPECT_EQ(files().size(), 2u);
    context.check("programs that were kept");
    // The text counts, not the name.
    folder.write("number.comp", std::string(shader) + "// a word more\n");
    EXPECT_EQ(valueOf(program("7u")), 7u);
    EXPECT_EQ(files().size(), 3u);
}

// A binary that the driver does not take is not used: here one whose file is whole, but not what is in it.
TEST_F(ProgramCache, CompilesWhereTheBinaryIsOfNoUse)
{
    valueOf(program("7u"));
    if (files().empty()) GTEST_SKIP() << context.device().renderer << " gives no binaries";
    std::ifstream in(files()[0], std::ios::binary);
    const std::string file((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    const std::size_t keyBytes = std::size_t(*reinterpret_cast<const std::uint64_t*>(file.data() + 8));
    const KeptFiles kept(folder / "kept");
    const std::string name = file.substr(32, keyBytes);
    const std::string whole = kept.load("program", name).value();
    for (const std::string& wrong : {std::string("x"), std::string(100, 'x'), whole.substr(0, whole.size() / 2),
                                     whole.substr(0, 4) + std::string(whole.size() - 4, 'x')}) {
        kept.store("program", name, wrong);
        EXPECT_EQ(valueOf(program("7u")), 7u);
        context.check("a binary that is none");
        EXPECT_EQ(kept.load("program", name), whole) << "kept anew";
    }
}

TEST_F(ProgramCache, ErrorsAreThoseOfTheText)
{
    for (int i = 0; i < 2; ++i) try {
            program("no_such_number");
            FAIL() << "it compiles";
        } catch (const Error& error) {
            EXPECT_NE(std::string(error.what()).find("number.comp:4"), std::string::npos) << error.what();
        }
    EXPECT_TRUE(files().empty());
}

}  // namespace
}  // namespace virga::gl
