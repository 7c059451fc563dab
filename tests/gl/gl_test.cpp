#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "gl/Context.h"
#include "gl/Objects.h"
#include "gl/PassTimer.h"
#include "gl/Program.h"
#include "support/Files.h"

namespace virga::gl {
namespace {

using test::sentenceOf;
using test::TemporaryFolder;

TEST(Device, TheSoftwareRendererGivesA45CoreContext)
{
    const Context context("cpu");
    EXPECT_TRUE(context.device().isSoftware);
    EXPECT_FALSE(context.device().renderer.empty());
    GLint major = 0, minor = 0, profile = 0;
    glGetIntegerv(GL_MAJOR_VERSION, &major);
    glGetIntegerv(GL_MINOR_VERSION, &minor);
    glGetIntegerv(GL_CONTEXT_PROFILE_MASK, &profile);
    EXPECT_GE(10 * major + minor, 45);
    EXPECT_TRUE(profile & GL_CONTEXT_CORE_PROFILE_BIT);
    EXPECT_NO_THROW(context.check("nothing"));
}

TEST(Device, EachListedOneCanBeAskedForByNumber)
{
    const std::vector<DeviceInfo> devices = listDevices();
    ASSERT_FALSE(devices.empty());
    for (const DeviceInfo& device : devices)
        EXPECT_EQ(Context(std::to_string(device.index)).device().renderer, device.renderer);
}

TEST(Device, WordsThatAreNoneAreRefused)
{
    for (const char* word : {"", "cuda", "-1", "1.5", "1000", "cpu "}) {
        EXPECT_FALSE(isDeviceName(word)) << word;
        EXPECT_SAYS(sentenceOf(ErrorCode::InvalidArgument, [&] { Context context{std::string(word)}; }),
                    std::string("'") + word + "'");
    }
    EXPECT_SAYS(sentenceOf(ErrorCode::Graphics, [] { Context context("999"); }), "--device 999");
    for (const char* word : {"auto", "cpu", "gpu", "0", "12"}) EXPECT_TRUE(isDeviceName(word)) << word;
}

TEST(Device, OneContextAfterAnother)
{
    for (int i = 0; i < 3; ++i) {
        const Context context("cpu");
        const Buffer buffer(16);
        EXPECT_NO_THROW(context.check("a buffer"));
    }
}

class OnDevice : public testing::Test {
protected:
    Context context{"cpu"};
};

TEST_F(OnDevice, CheckNamesThePlaceAndTheFault)
{
    glCreateBuffers(-1, nullptr);
    const std::string said = sentenceOf(ErrorCode::Graphics, [&] { context.check("making buffers"); });
    EXPECT_SAYS(said, "making buffers");
    EXPECT_SAYS(said, "invalid value");
    EXPECT_NO_THROW(context.check("said once"));
}

TEST_F(OnDevice, BuffersGiveBackTheirBytes)
{
    std::vector<std::uint32_t> data(1000);
    std::iota(data.begin(), data.end(), 7u);
    Buffer buffer(data.size() * 4);
    buffer.upload(std::span<const std::uint32_t>(data));
    std::vector<std::uint32_t> back(data.size());
    buffer.download(back.data(), buffer.bytes());
    EXPECT_EQ(back, data);

    const std::uint32_t one = 99;
    buffer.upload(&one, 4, 4 * 500);
    buffer.download(back.data(), 4 * 3, 4 * 499);
    EXPECT_EQ(back[0], data[499]);
    EXPECT_EQ(back[1], 99u);
    EXPECT_EQ(back[2], data[501]);

    buffer.clear();
    buffer.download(back.data(), buffer.bytes());
    EXPECT_TRUE(std::all_of(back.begin(), back.end(), [](std::uint32_t word) { return word == 0; }));

    Buffer filled(data.size() * 4, 0, data.data());
    filled.download(back.data(), filled.bytes());
    EXPECT_EQ(back, data);
    context.check("buffers");
}

TEST_F(OnDevice, BuffersGrowAndNeverShrink)
{
    Buffer buffer;
    buffer.reserve(100);
    const GLuint name = buffer.name();
    buffer.reserve(50);
    EXPECT_EQ(buffer.name(), name);
    EXPECT_EQ(buffer.bytes(), 100u);
    buffer.reserve(200);
    EXPECT_EQ(buffer.bytes(), 200u);
    context.check("reserve");
}

TEST_F(OnDevice, ObjectsAreDeletedOnceByTheirLastOwner)
{
    GLuint name = 0, texture = 0;
    {
        Buffer first(16);
        name = first.name();
        Buffer second(std::move(first));
        EXPECT_EQ(second.name(), name);
        EXPECT_EQ(first.name(), 0u);
        Texture map = Texture::make2D(GL_R32F, 4, 4);
        texture = map.name();
        const Texture moved = std::move(map);
        EXPECT_FALSE(bool(map));
        EXPECT_TRUE(glIsBuffer(name) && glIsTexture(texture));
    }
    EXPECT_FALSE(glIsBuffer(name) || glIsTexture(texture));
    context.check("owners");
}

// A texture goes up, a program reads it and writes a buffer, the buffer comes down: every float as it was, NaN's place
// taken by values that a device must keep (denormals may go).
TEST_F(OnDevice, TextureThroughProgramToBuffer)
{
    const TemporaryFolder folder;
    folder.write("copy.comp",
                 "layout(local_size_x = 8, local_size_y = 8) in;\n"
                 "layout(binding = 3) uniform sampler2D source;\n"
                 "layout(std430, binding = 2) writeonly buffer Result { vec4 result[]; };\n"
                 "uniform uint scale;\n"
                 "void main()\n"
                 "{\n"
                 "    ivec2 at = ivec2(gl_GlobalInvocationID.xy);\n"
                 "    if (at.x >= WIDTH || at.y >= HEIGHT) return;\n"
                 "    result[at.y * WIDTH + at.x] = texelFetch(source, at, 0) * float(scale);\n"
                 "}\n");
    constexpr int width = 21, height = 13;
    std::vector<float> pixels(4 * width * height);
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = std::ldexp(1 + float(i) / 2048, int(i % 60) - 30);
    pixels[5] = -3.5f;
    pixels[9] = INFINITY;
    Texture texture = Texture::make2D(GL_RGBA32F, width, height);
    texture.setFilter(GL_NEAREST);
    texture.upload(GL_RGBA, GL_FLOAT, pixels.data());
    EXPECT_EQ(texture.width(), width);
    EXPECT_EQ(texture.format(), GLenum(GL_RGBA32F));

    const Program program("copy.comp", {{"WIDTH", "21"}, {"HEIGHT", "13"}}, folder.path());
    Buffer result(pixels.size() * 4);
    texture.bind(3);
    result.bindStorage(2);
    program.set("scale", 2);
    program.set("nobodyReadsThis", 5);
    program.dispatch(groupsFor(width, 8), groupsFor(height, 8));
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    std::vector<float> back(pixels.size());
    result.download(back.data(), result.bytes());
    for (std::size_t i = 0; i < pixels.size(); ++i) EXPECT_EQ(back[i], 2 * pixels[i]) << i;
    context.check("round trip");
}

TEST_F(OnDevice, IndirectDispatchReadsItsCounts)
{
    const TemporaryFolder folder;
    folder.write("count.comp",
                 "layout(local_size_x = 1) in;\n"
                 "layout(std430, binding = 0) buffer Result { uint count; };\n"
                 "void main() { atomicAdd(count, 1u); }\n");
    const Program program("count.comp", {}, folder.path());
    const std::uint32_t arguments[] = {1, 1, 1, 0, 3, 5, 2};
    const Buffer counts(sizeof arguments, 0, arguments);
    Buffer result(4);
    result.clear();
    result.bindStorage(0);
    program.dispatchIndirect(counts.name(), 16);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    std::uint32_t count = 0;
    result.download(&count, 4);
    EXPECT_EQ(count, 30u);
}

TEST_F(OnDevice, TimerNamesPassesInOrder)
{
    PassTimer timer;
    for (int frame = 0; frame < 2; ++frame) {
        timer.begin();
        timer.mark("one");
        timer.mark("two");
        const auto times = timer.collect();
        ASSERT_EQ(times.size(), 2u);
        EXPECT_EQ(times[0].first, "one");
        EXPECT_EQ(times[1].first, "two");
        EXPECT_GE(times[0].second, 0);
        EXPECT_GE(times[1].second, 0);
    }
}

TEST_F(OnDevice, EveryEmbeddedPassCompilesAsItStands)
{
    for (const EmbeddedShader& shader : embeddedShaders()) {
        const std::string path(shader.path);
        if (!path.ends_with(".comp")) continue;
        EXPECT_NO_THROW(Program(path, {})) << path;
    }
}

TEST_F(OnDevice, ABrokenShaderIsNamedWithFileAndLine)
{
    const TemporaryFolder folder;
    folder.write("broken.comp",
                 "// a comment\n"
                 "#include \"part.glsl\"\n"
                 "layout(local_size_x = 1) in;\n"
                 "void main()\n"
                 "{\n"
                 "    int fine = 1;\n"
                 "#ifdef BROKEN_HERE\n"
                 "    int wrong = noSuchName;\n"
                 "#endif\n"
                 "    halved(fine);\n"
                 "}\n");
    folder.write("part.glsl",
                 "float halved(int x)\n"
                 "{\n"
                 "#ifdef BROKEN_THERE\n"
                 "    return noSuchThing;\n"
                 "#endif\n"
                 "    return 0.5 * float(x);\n"
                 "}\n");
    EXPECT_NO_THROW(Program("broken.comp", {}, folder.path()));
    const auto said = [&](const char* define) {
        return sentenceOf(ErrorCode::Graphics, [&] {
            Program("broken.comp", {{define, "1"}, {"MORE", "2"}}, folder.path());
        });
    };
    EXPECT_SAYS(said("BROKEN_HERE"), "broken.comp:8: ");  // after an #include: the line must not be off by its length
    EXPECT_SAYS(said("BROKEN_HERE"), "noSuchName");
    EXPECT_SAYS(said("BROKEN_THERE"), "part.glsl:4: ");
}

TEST(ShaderSource, IncludesEachFileOnceAndNumbersItsLines)
{
    const TemporaryFolder folder;
    folder.write("a.comp", "one\n#include \"b.glsl\"\ntwo\n  #include \"c.glsl\"\nthree\n");
    folder.write("b.glsl", "b\n#include \"c.glsl\"\nbb\n");
    folder.write("c.glsl", "c\n");
    const ShaderSource source = loadShader("a.comp", {{"X", "1"}, {"Y", ""}}, folder.path());
    EXPECT_EQ(source.files, (std::vector<std::string>{"a.comp", "b.glsl", "c.glsl"}));
    EXPECT_EQ(source.text,
              "#version 450 core\n#define X 1\n#define Y \n"
              "#line 1 0\none\n#line 1 1\nb\n#line 1 2\nc\n#line 3 1\nbb\n#line 3 0\ntwo\n#line 5 0\nthree\n");
}

TEST(ShaderSource, ACircleOfIncludesEnds)
{
    const TemporaryFolder folder;
    folder.write("a.glsl", "#include \"b.glsl\"\na\n");
    folder.write("b.glsl", "#include \"a.glsl\"\nb\n");
    EXPECT_EQ(loadShader("a.glsl", {}, folder.path()).files.size(), 2u);
}

TEST(ShaderSource, AMissingFileIsNamed)
{
    const TemporaryFolder folder;
    folder.write("a.comp", "#include \"gone.glsl\"\n");
    const std::string said = sentenceOf(ErrorCode::Graphics, [&] { loadShader("a.comp", {}, folder.path()); });
    EXPECT_SAYS(said, "gone.glsl");
    EXPECT_SAYS(said, folder.path());
    EXPECT_SAYS(sentenceOf(ErrorCode::Graphics, [] { loadShader("gone.comp", {}); }), "gone.comp");
}

TEST(ShaderSource, EmbeddedIncludesResolve)
{
    const ShaderSource source = loadShader("pass_composite.comp", {{"FOG", ""}});
    EXPECT_EQ(source.files[0], "pass_composite.comp");
    EXPECT_NE(std::find(source.files.begin(), source.files.end(), "shared/frame.glsl"), source.files.end());
    EXPECT_EQ(source.text.find("#include"), std::string::npos);
}

TEST(ShaderSource, LogsOfBothDriversAreExplained)
{
    const ShaderSource source{"", {"pass_a.comp", "common_b.glsl"}};
    EXPECT_EQ(explainShaderLog("1:23(5): error: `x' undeclared\n0:4(1): warning\n", source),
              "common_b.glsl:23: error: `x' undeclared\npass_a.comp:4: warning\n");
    EXPECT_EQ(explainShaderLog("0(12) : error C1008: undefined variable \"x\"\n1(3) : error\n", source),
              "pass_a.comp:12: error C1008: undefined variable \"x\"\ncommon_b.glsl:3: error\n");
    EXPECT_EQ(explainShaderLog("7:1(1): error\n", source), "7:1: error\n");  // a file nobody knows keeps its number
    EXPECT_EQ(explainShaderLog("no place at all", source), "no place at all");
}

}  // namespace
}  // namespace virga::gl
