#include "io/PictureChannels.h"

#include <algorithm>
#include <string_view>

#include "core/Error.h"
#include "core/Words.h"

namespace virga::io {

namespace {

bool isSame(std::string_view a, std::string_view b) { return lowerCase(std::string(a)) == lowerCase(std::string(b)); }

int channelNamed(const PartChannels& part, const std::string& name)
{
    const auto found = std::find_if(part.channels.begin(), part.channels.end(),
                                    [&](const std::string& channel) { return isSame(channel, name); });
    return found == part.channels.end() ? -1 : int(found - part.channels.begin());
}

bool contains(const std::vector<std::string>& names, std::string_view name)
{
    return std::any_of(names.begin(), names.end(), [&](const std::string& n) { return isSame(n, name); });
}

/// R, G and B that belong together.
struct Colours {
    std::string layer;  ///< before ".R", less the view
    std::string part;   ///< the part's name less its view; empty if the file has but one part
    std::string view;
    PictureChannels channels;

    /// For --layer; empty for the plain picture of a file with one part.
    const std::string& name() const { return layer.empty() ? part : layer; }
    bool isCalled(const std::string& wanted) const
    {
        return isSame(layer, wanted) || (layer.empty() ? isSame(part, wanted) : isSame(part + "." + layer, wanted));
    }
};

/// "beauty.left" in the view left is the left picture of beauty.
std::string withoutView(std::string name, const std::string& view)
{
    if (!view.empty() && isSame(name, view)) return {};
    if (!view.empty() && name.size() > view.size() + 1 && isSame(name.substr(name.size() - view.size()), view) &&
        (name[name.size() - view.size() - 1] == '.' || name[name.size() - view.size() - 1] == '_'))
        name.resize(name.size() - view.size() - 1);
    return name;
}

std::vector<Colours> coloursIn(const std::vector<PartChannels>& parts)
{
    std::vector<Colours> found;
    for (std::size_t p = 0; p < parts.size(); ++p) {
        const PartChannels& part = parts[p];
        if (part.isDeep) continue;
        for (const std::string& name : part.channels) {
            const std::size_t dot = name.rfind('.');
            const std::string before = dot == std::string::npos ? "" : name.substr(0, dot + 1);
            if (!isSame(name.substr(before.size()), "R")) continue;
            Colours c;
            c.channels = {int(p), channelNamed(part, before + "R"), channelNamed(part, before + "G"),
                          channelNamed(part, before + "B"), channelNamed(part, before + "A")};
            if (c.channels.green < 0 || c.channels.blue < 0) continue;
            if (before.empty()) c.channels.alpha = part.alpha;
            c.layer = before.substr(0, before.empty() ? 0 : before.size() - 1);
            c.view = part.view;
            if (!part.views.empty()) {
                const std::size_t last = c.layer.rfind('.');
                const std::string end = c.layer.substr(last == std::string::npos ? 0 : last + 1);
                const bool isNamed = contains(part.views, end);
                c.view = isNamed ? end : part.views[0];
                if (isNamed) c.layer.resize(last == std::string::npos ? 0 : last);
            }
            if (parts.size() > 1) c.part = withoutView(part.name, c.view);
            found.push_back(std::move(c));
        }
    }
    return found;
}

/// The channel that is a grey picture, -1 if there is none.
PictureChannels greyOf(const std::vector<PartChannels>& parts, const std::string& view, const std::string& path)
{
    const auto grey = [](std::size_t part, int channel, int alpha) {
        return PictureChannels{int(part), channel, channel, channel, alpha == channel ? -1 : alpha};
    };
    for (std::size_t p = 0; p < parts.size(); ++p) {
        if (parts[p].isDeep || (!view.empty() && !isSame(parts[p].view, view))) continue;
        if (const int luminance = channelNamed(parts[p], "Y"); luminance >= 0)
            return grey(p, luminance, parts[p].alpha);
    }
    const PartChannels& part = parts[0];
    const int count = int(part.channels.size()), colors = count - (part.alpha >= 0 ? 1 : 0);
    const std::string& first = part.channels[0];
    const bool isDepth = isSame(first.substr(first.rfind('.') + 1), "Z");
    if (colors < 3 && !isDepth && !part.isDeep) return grey(0, part.alpha == 0 && count > 1 ? 1 : 0, part.alpha);
    // Formats without names for their channels have colours first.
    if (colors < 3 || (first != "R" && !lowerCase(first).starts_with("channel")))
        throw Error(ErrorCode::Input, "{}: holds no colours, but {}", path, fmt::join(part.channels, ", "));
    return {0, 0, 1, 2, part.alpha > 2 ? part.alpha : -1};
}

void addNew(std::vector<std::string>& names, const std::string& name)
{
    if (!name.empty() && !contains(names, name)) names.push_back(name);
}

std::string listed(const std::vector<std::string>& names)
{
    return names.empty() ? "it has none" : fmt::format("there are {}", fmt::join(names, ", "));
}

}  // namespace

std::vector<std::string> layersIn(const std::vector<PartChannels>& parts)
{
    std::vector<std::string> names;
    for (const Colours& c : coloursIn(parts)) addNew(names, c.name());
    return names;
}

std::vector<std::string> viewsIn(const std::vector<PartChannels>& parts)
{
    std::vector<std::string> names;
    for (const PartChannels& part : parts) {
        for (const std::string& view : part.views) addNew(names, view);
        addNew(names, part.view);
    }
    return names;
}

PictureChannels choosePicture(const std::vector<PartChannels>& parts, const PictureChoice& choice,
                              const std::string& path)
{
    const std::vector<std::string> views = viewsIn(parts);
    if (!choice.view.empty() && !contains(views, choice.view))
        throw Error(ErrorCode::Input, "{}: has no view '{}'; {}", path, choice.view, listed(views));
    const std::string view = !choice.view.empty() || views.empty() ? choice.view : views[0];

    std::vector<Colours> all = coloursIn(parts);
    std::erase_if(all, [&](const Colours& c) { return !view.empty() && !c.view.empty() && !isSame(c.view, view); });
    std::vector<std::string> names;
    for (const Colours& c : all) addNew(names, c.name());
    if (!choice.layer.empty()) {
        for (const Colours& c : all)
            if (c.isCalled(choice.layer)) return c.channels;
        throw Error(ErrorCode::Input, "{}: has no layer '{}'; {}", path, choice.layer, listed(names));
    }
    if (all.empty()) return greyOf(parts, view, path);

    const auto ofView = [&](const PartChannels& part) {
        return view.empty() || part.view.empty() || isSame(part.view, view);
    };
    const auto firstPart = int(std::find_if(parts.begin(), parts.end(), ofView) - parts.begin());
    std::vector<Colours> plain;
    for (const Colours& c : all)
        if (c.layer.empty()) plain.push_back(c);
    if (!plain.empty() && (plain.size() == 1 || plain[0].channels.part == firstPart)) return plain[0].channels;
    if (all.size() == 1) return all[0].channels;
    std::vector<Colours> whole;
    for (const Colours& c : all)
        for (const char* usual : {"rgba", "combined", "beauty"})
            if (isSame(c.name().substr(c.name().rfind('.') + 1), usual)) whole.push_back(c);
    if (whole.size() == 1) return whole[0].channels;
    throw Error(ErrorCode::Input, "{}: holds the layers {}; choose with --layer", path, fmt::join(names, ", "));
}

std::vector<std::string> besidePicture(const std::vector<PartChannels>& parts, const PictureChannels& picture)
{
    std::vector<std::string> names;
    const PartChannels& own = parts[std::size_t(picture.part)];
    for (std::size_t i = 0; i < own.channels.size(); ++i)
        if (!picture.holds(int(i))) names.push_back(own.channels[i]);
    for (std::size_t p = 0; p < parts.size(); ++p)
        if (int(p) != picture.part)
            names.push_back(fmt::format("part {} ({})", parts[p].name.empty() ? std::to_string(p) : parts[p].name,
                                        fmt::join(parts[p].channels, " ")));
    return names;
}

}  // namespace virga::io
