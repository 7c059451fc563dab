// What the tests of the OpenFX plug-in share: a plate, a host with the plug-in loaded, the command line's frames.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <set>
#include <thread>

#include "OfxHost.h"
#include "io/ImageFile.h"
#include "io/ImageWrite.h"
#include "virga/virga.h"

namespace virga::test {

namespace fs = std::filesystem;

inline constexpr int width = 96, height = 64, frames = 4;
inline constexpr const char* filter = ofx::value::contextFilter;
inline constexpr const char* general = ofx::value::contextGeneral;

/// A street of sorts: a bright sky, a darker ground, detail, and a patch that moves.
inline ImageF plate(double time)
{
    ImageF image(width, height, 4);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const float sky = y < height / 2 ? 0.9F : 0.15F;
            const float detail = 0.05F * float((x * 7 + y * 13) % 11) / 11;
            const bool isPatch = std::abs(x - 20 - 10 * int(time)) < 6 && std::abs(y - 40) < 6;
            image.at(x, y, 0) = sky * 0.8F + detail + (isPatch ? 0.5F : 0.0F);
            image.at(x, y, 1) = sky * 0.9F + detail;
            image.at(x, y, 2) = sky + detail;
            image.at(x, y, 3) = 1;
        }
    return image;
}

inline void write(const fs::path& path, const ImageF& image, int channels = 4)
{
    const char* const names[] = {"R", "G", "B", "A"};
    io::ImageToWrite file;
    for (int c = 0; c < channels; ++c)
        file.channels.push_back({channels == 1 ? "Z" : names[c], io::SampleType::Float, image.view(), c});
    io::writeImageFile(path.string(), file);
}

inline ImageF read(const fs::path& path)
{
    io::ImageHeader header;
    return io::readCodedRgba(path.string(), header);
}

inline double largestDifference(const ImageF& a, const ImageF& b, int dx = 0, int dy = 0)
{
    double most = 0;
    for (int y = 0; y < a.height(); ++y)
        for (int x = 0; x < a.width(); ++x)
            for (int c = 0; c < 3; ++c)
                most = std::max(most, std::abs(double(a.at(x, y, c)) - double(b.at(x + dx, y + dy, c))));
    return most;
}

/// A host with the plug-in loaded; at the end nothing may have been misused.
class Ofx : public testing::Test {
protected:
    void start(HostKind kind = {})
    {
        stop();
        host_ = std::make_unique<OfxHostOfTests>(kind);
        plugin_ = host_->open(VIRGA_OFX_BINARY);
        ASSERT_NE(plugin_, nullptr) << host_->misuses.front();
        loaded_ = plainAct(ofx::action::load);
    }
    void stop()
    {
        if (!host_) return;
        effects_.clear();
        if (loaded_ == ofx::statOk) {
            EXPECT_EQ(plainAct(ofx::action::unload), ofx::statOk);
        }
        for (const std::string& misuse : host_->misuses) ADD_FAILURE() << misuse;
        host_.reset();
    }
    void TearDown() override
    {
        stop();
        std::error_code error;
        fs::remove_all(folder_, error);
    }
    OfxStatus plainAct(const char* name) { return plugin_->mainEntry(name, nullptr, nullptr, nullptr); }

    HostEffect& effect(const char* context = filter)
    {
        effects_.push_back(std::make_unique<HostEffect>(*host_, *plugin_, context));
        EXPECT_EQ(effects_.back()->describe(), ofx::statOk);
        for (const char* name : {"Source", "Output"}) {
            HostClip& clip = effects_.back()->clip(name);
            clip.region = {0, 0, width, height};
            clip.last = frames - 1;
            clip.frame = plate;
            clip.spareBytes = 8;
        }
        for (const char* name : {"Depth", "Environment"})
            if (effects_.back()->hasClip(name)) effects_.back()->clip(name).isConnected = false;
        return *effects_.back();
    }
    /// As most tests have it: rain alone, so that each pixel's change is a stroke's.
    static void heavyRain(HostEffect& effect)
    {
        effect.set("rate", 80);
        effect.set("seed", 7);
    }

    fs::path folder()
    {
        if (folder_.empty()) {
            std::string pattern = (fs::temp_directory_path() / "virga-ofx-XXXXXX").string();
            folder_ = mkdtemp(pattern.data());
        }
        return folder_;
    }
    /// Frame n of `virga rain` over the same plate.
    std::vector<ImageF> byRain(const std::string& settings)
    {
        for (int n = 0; n < frames; ++n) write(folder() / ("s." + std::to_string(n) + ".exr"), plate(n));
        const std::string command = std::string(VIRGA_PROGRAM) + " rain " + (folder() / "s.%d.exr").string() + " -o " +
                                    (folder() / "r.%d.exr").string() + " --quiet --float --fps 25 --rate 80 --seed 7 " +
                                    settings;
        if (std::system(command.c_str()) != 0) throw std::runtime_error(command);
        std::vector<ImageF> all;
        for (int n = 0; n < frames; ++n) all.push_back(read(folder() / ("r." + std::to_string(n) + ".exr")));
        return all;
    }

    static constexpr OfxRectI whole{0, 0, width, height};
    std::unique_ptr<OfxHostOfTests> host_;
    OfxPlugin* plugin_ = nullptr;
    OfxStatus loaded_ = ofx::statFailed;
    std::vector<std::unique_ptr<HostEffect>> effects_;
    fs::path folder_;
};

}  // namespace virga::test
