// Contexts and programs that a thread shares.
#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <string>

#include "core/Counters.h"
#include "core/Error.h"
#include "gl/Objects.h"
#include "gl/Program.h"
#include "gl/SharedContexts.h"
#include "support/Files.h"

namespace virga::gl {
namespace {

constexpr const char* shader = R"(
layout(local_size_x = 1) in;
layout(std430, binding = 0) buffer Out { uint value; };
layout(location = 0) uniform uint addend;
void main() { value = NUMBER + addend; }
)";

std::uint32_t valueOf(const Program& program, GLuint addend)
{
    Buffer buffer(sizeof(std::uint32_t));
    buffer.clear();
    buffer.bindStorage(0);
    program.set("addend", addend);
    program.dispatch(1);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    std::uint32_t value = 0;
    buffer.download(&value, sizeof value);
    return value;
}

class SharedContextsTest : public testing::Test {
protected:
    SharedContextsTest() { folder.write("number.comp", shader); }
    Program program(const char* number) const { return {"number.comp", {{"NUMBER", number}}, {folder.path()}}; }
    const test::TemporaryFolder folder;
};

TEST_F(SharedContextsTest, OpenADeviceOnceWhateverItIsCalled)
{
    const SharedContexts contexts;
    const std::uint64_t before = counters().contexts;
    const auto byWord = SharedContexts::open("cpu");
    const auto again = SharedContexts::open("cpu");
    const auto byNumber = SharedContexts::open(std::to_string(byWord->device().index));
    EXPECT_EQ(byWord, again);
    EXPECT_EQ(byWord, byNumber);
    EXPECT_LE(counters().contexts - before, 2u);  // the number was opened to be known
    EXPECT_EQ(Context::current(), byWord.get());
    EXPECT_EQ(valueOf(program("7u"), 0), 7u);  // and the context that stayed is the one in use
}

TEST_F(SharedContextsTest, WithoutThemEachIsItsOwn)
{
    const auto one = SharedContexts::open("cpu"), other = SharedContexts::open("cpu");
    EXPECT_NE(one, other);
}

TEST_F(SharedContextsTest, CompileATextOnce)
{
    const SharedContexts contexts;
    const auto context = SharedContexts::open("cpu");
    const std::uint64_t before = counters().programs;
    const Program first = program("7u");
    EXPECT_EQ(counters().programs - before, 1u);
    {
        const Program second = program("7u");
        EXPECT_EQ(second.name(), first.name());
        EXPECT_EQ(valueOf(second, 1), 8u);
    }
    EXPECT_EQ(valueOf(first, 2), 9u);  // whoever is done with it leaves it to the others
    EXPECT_EQ(valueOf(program("8u"), 0), 8u);
    EXPECT_EQ(counters().programs - before, 2u);
    context->check("shared programs");
}

// Programs of one context are no use in another, and each dies in its own.
TEST_F(SharedContextsTest, KeepProgramsOfEachContextApart)
{
    const Context apart("cpu");
    {
        const SharedContexts contexts;
        const auto shared = SharedContexts::open("cpu");
        EXPECT_EQ(valueOf(program("7u"), 0), 7u);
        apart.makeCurrent();
        EXPECT_EQ(valueOf(program("7u"), 0), 7u);
        shared->makeCurrent();
        EXPECT_EQ(valueOf(program("7u"), 3), 10u);
        shared->check("the shared one");
    }
    apart.makeCurrent();
    EXPECT_EQ(valueOf(program("7u"), 1), 8u);
    apart.check("the one apart");
}

// A device that is not there is looked for once.
TEST_F(SharedContextsTest, SayTheSameTwiceOfADeviceThatIsNotThere)
{
    const SharedContexts contexts;
    std::string sentences[2];
    for (std::string& sentence : sentences) {
        try {
            SharedContexts::open("99");
            ADD_FAILURE() << "device 99";
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::Graphics);
            sentence = error.what();
        }
    }
    EXPECT_EQ(sentences[0], sentences[1]);
    EXPECT_NE(sentences[0].find("99"), std::string::npos);
    EXPECT_THROW(SharedContexts::open("fast"), Error);
}

}  // namespace
}  // namespace virga::gl
