#include <gtest/gtest.h>

#include "io/Helpers.h"
#include "io/PictureChannels.h"

namespace virga::io {
namespace {

PartChannels part(std::vector<std::string> channels, std::string name = "", std::string view = "",
                  std::vector<std::string> views = {})
{
    PartChannels p{std::move(name), std::move(view), std::move(views), std::move(channels), -1, false};
    for (std::size_t i = 0; i < p.channels.size(); ++i)
        if (p.channels[i] == "A") p.alpha = int(i);
    return p;
}

/// "0: R G B A" for what is chosen, or the sentence.
std::string chosen(const std::vector<PartChannels>& parts, const PictureChoice& choice = {})
{
    try {
        const PictureChannels c = choosePicture(parts, choice, "f.exr");
        const auto& names = parts[std::size_t(c.part)].channels;
        std::string text = std::to_string(c.part) + ":";
        for (const int i : {c.red, c.green, c.blue, c.alpha})
            if (i >= 0) text += " " + names[std::size_t(i)];
        return text;
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::Input);
        return error.what();
    }
}

TEST(PictureChannels, PlainColoursInWhateverOrder)
{
    EXPECT_EQ(chosen({part({"A", "B", "G", "R", "Z"})}), "0: R G B A");
    EXPECT_EQ(chosen({part({"r", "g", "b"})}), "0: r g b");
    EXPECT_EQ(chosen({part({"R", "G", "B", "spec.R", "spec.G", "spec.B"})}), "0: R G B");
    EXPECT_EQ(chosen({part({"channel0", "channel1", "channel2", "channel3"})}), "0: channel0 channel1 channel2");
}

TEST(PictureChannels, Layers)
{
    const auto layers = part({"Z", "diff.R", "diff.G", "diff.B", "spec.R", "spec.G", "spec.B", "spec.A", "half.R"});
    EXPECT_EQ(chosen({layers}, {"spec", ""}), "0: spec.R spec.G spec.B spec.A");
    EXPECT_EQ(chosen({layers}, {"DIFF", ""}), "0: diff.R diff.G diff.B");
    EXPECT_EQ(chosen({layers}), "f.exr: holds the layers diff, spec; choose with --layer");
    EXPECT_EQ(chosen({layers}, {"half", ""}), "f.exr: has no layer 'half'; there are diff, spec");
    EXPECT_EQ(chosen({part({"Z", "only.R", "only.G", "only.B"})}), "0: only.R only.G only.B");
    EXPECT_EQ(chosen({part({"a.Combined.R", "a.Combined.G", "a.Combined.B", "a.D.R", "a.D.G", "a.D.B"})}),
              "0: a.Combined.R a.Combined.G a.Combined.B");
    EXPECT_EQ(layersIn({layers}), (std::vector<std::string>{"diff", "spec"}));
}

TEST(PictureChannels, PartsAreLayersByTheirNames)
{
    const std::vector<PartChannels> parts = {part({"Z"}, "depth"), part({"R", "G", "B"}, "diff"),
                                             part({"R", "G", "B", "A"}, "beauty"), part({"x.R", "x.G", "x.B"}, "more")};
    EXPECT_EQ(chosen(parts), "2: R G B A");  // called beauty
    EXPECT_EQ(chosen(parts, {"diff", ""}), "1: R G B");
    EXPECT_EQ(chosen(parts, {"x", ""}), "3: x.R x.G x.B");
    EXPECT_EQ(chosen(parts, {"more.x", ""}), "3: x.R x.G x.B");
    EXPECT_EQ(chosen({parts[1], parts[2]}), "0: R G B");  // the first part has colours: it is the picture
    EXPECT_EQ(chosen({parts[0], parts[1]}), "1: R G B");  // no other has
    EXPECT_EQ(layersIn(parts), (std::vector<std::string>{"diff", "beauty", "x"}));
}

TEST(PictureChannels, ViewsOfChannelsAndOfParts)
{
    const auto both = part(
        {"R", "G", "B", "right.R", "right.G", "right.B", "d.right.R", "d.right.G", "d.right.B", "d.R", "d.G", "d.B"},
        "", "", {"left", "right"});
    EXPECT_EQ(chosen({both}), "0: R G B");
    EXPECT_EQ(chosen({both}, {"", "left"}), "0: R G B");
    EXPECT_EQ(chosen({both}, {"", "right"}), "0: right.R right.G right.B");
    EXPECT_EQ(chosen({both}, {"d", "right"}), "0: d.right.R d.right.G d.right.B");
    EXPECT_EQ(chosen({both}, {"d", ""}), "0: d.R d.G d.B");
    EXPECT_EQ(chosen({both}, {"", "middle"}), "f.exr: has no view 'middle'; there are left, right");
    // Without multiView "right" is a layer like any other.
    EXPECT_EQ(chosen({part({"R", "G", "B", "right.R", "right.G", "right.B"})}, {"right", ""}),
              "0: right.R right.G right.B");

    const std::vector<PartChannels> parts = {part({"R", "G", "B"}, "rgb.left", "left"), part({"Z"}, "z.left", "left"),
                                             part({"R", "G", "B"}, "rgb.right", "right"),
                                             part({"R", "G", "B"}, "d_right", "right")};
    EXPECT_EQ(chosen(parts), "0: R G B");
    EXPECT_EQ(chosen(parts, {"", "Right"}), "2: R G B");
    EXPECT_EQ(chosen(parts, {"d", "right"}), "3: R G B");
    EXPECT_EQ(chosen(parts, {"rgb", "right"}), "2: R G B");
    EXPECT_EQ(viewsIn(parts), (std::vector<std::string>{"left", "right"}));
}

TEST(PictureChannels, GreyAndWhatIsNoPicture)
{
    EXPECT_EQ(chosen({part({"Y"})}), "0: Y Y Y");
    EXPECT_EQ(chosen({part({"Y", "A"})}), "0: Y Y Y A");
    EXPECT_EQ(chosen({part({"A", "I"})}), "0: I I I A");
    EXPECT_EQ(chosen({part({"Z"}, "z"), part({"Y"}, "grey")}), "1: Y Y Y");
    EXPECT_EQ(chosen({part({"Z"})}), "f.exr: holds no colours, but Z");
    EXPECT_EQ(chosen({part({"u", "v", "w"})}), "f.exr: holds no colours, but u, v, w");
    PartChannels deep = part({"R", "G", "B"}, "deep");
    deep.isDeep = true;
    EXPECT_EQ(chosen({deep, part({"R", "G", "B"}, "flat")}), "1: R G B");
}

TEST(PictureChannels, WhatIsBesideThePicture)
{
    const std::vector<PartChannels> parts = {part({"R", "G", "B", "Z"}, "rgb"), part({"x", "y"}, "motion")};
    EXPECT_EQ(besidePicture(parts, choosePicture(parts, {}, "f.exr")),
              (std::vector<std::string>{"Z", "part motion (x y)"}));
}

}  // namespace
}  // namespace virga::io
