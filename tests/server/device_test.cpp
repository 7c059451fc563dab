// A device that fails while it draws: the processor takes over, and the server says so.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include "core/Error.h"
#include "gl/Context.h"
#include "io/Plate.h"
#include "server/Engine.h"
#include "server/RawFrame.h"
#include "support/Files.h"

namespace virga::server {
namespace {

bool hasOpenGl()
{
    try {
        const gl::Context context("0");
        return true;
    } catch (const Error&) {
        return false;
    }
}

TEST(Device, ThatFailsWhileItDrawsIsReplacedByTheProcessor)
{
    if (!hasOpenGl()) GTEST_SKIP() << "no OpenGL device";
    const test::TemporaryFolder folder;
    ImageF plate(64, 48, 4, 0.3f);
    io::writeExr(folder / "plate.0000.exr", plate, {"R", "G", "B", "A"}, false);
    Engine engine(folder.path(), "0", "", {});
    SessionDocument document;
    document.platePath = "plate.####.exr";
    document.settings.rate_mm_h = 80;
    const auto session = engine.open(document);
    const auto frameOf = [&](const char* rate) {
        FrameQuery query;
        query.frame = 0;
        query.isFloat = true;
        query.changes = {{"rate", rate}};
        const FrameAnswer answer = session->frame(query, Format::Raw, "", [] { return false; });
        return readRaw(*answer.body);
    };
    const ImageF before = frameOf("80");
    EXPECT_EQ(engine.services().device.fallback(), "");
    EXPECT_EQ(engine.services().device.used().find("processor"), std::string::npos) << engine.services().device.used();

    // What a device that was lost looks like from here: OpenGL reports an error.
    engine.services().queue->run([] { glEnable(0xffff); });
    const ImageF after = frameOf("79");
    EXPECT_NE(engine.services().device.fallback(), "") << "why it is the processor";
    EXPECT_NE(engine.services().device.used().find("processor"), std::string::npos) << engine.services().device.used();
    const ImageF again = frameOf("80");
    ASSERT_EQ(again.size(), before.size());
    for (std::size_t i = 0; i < again.size(); ++i) ASSERT_NEAR(again.data()[i], before.data()[i], 1e-4);
    EXPECT_EQ(after.size(), before.size());
}

}  // namespace
}  // namespace virga::server
