#include "shot/KeptLight.h"

#include <fmt/format.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <type_traits>

namespace virga::shot {
namespace {

constexpr const char* kind = "light";
/// Counts with every change of what is made of a panorama: the program's version does not change with each.
constexpr int revision = 2;

class Packer {
public:
    template <class T>
    void add(const T& value)
    {
        static_assert(std::is_trivially_copyable_v<T>);
        bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    void add(const ImageF& image)
    {
        add(image.width()), add(image.height()), add(image.channels());
        bytes_.append(reinterpret_cast<const char*>(image.data()), image.size() * sizeof(float));
    }
    void add(const std::vector<std::string>& sentences)
    {
        add(sentences.size());
        for (const std::string& sentence : sentences) add(sentence.size()), bytes_ += sentence;
    }
    const std::string& bytes() const { return bytes_; }

private:
    std::string bytes_;
};

/// Reads what Packer wrote. After the end everything is 0 and isWhole() false.
class Unpacker {
public:
    explicit Unpacker(std::string_view bytes) : bytes_(bytes) {}

    template <class T>
    void take(T& value)
    {
        static_assert(std::is_trivially_copyable_v<T>);
        copy(&value, sizeof value);
    }
    void take(ImageF& image)
    {
        int width = 0, height = 0, channels = 0;
        take(width), take(height), take(channels);
        const bool fits = width > 0 && height > 0 && channels == 3 &&
                          std::size_t(width) * std::size_t(height) <= bytes_.size() / (3 * sizeof(float));
        if (!fits) return fail();
        image = ImageF(width, height, channels);
        copy(image.data(), image.size() * sizeof(float));
    }
    void take(std::vector<std::string>& sentences)
    {
        std::size_t count = 0;
        take(count);
        for (std::size_t i = 0; i < count && isWhole_; ++i) {
            std::size_t size = 0;
            take(size);
            if (size > bytes_.size()) return fail();
            sentences.emplace_back(bytes_.substr(0, size));
            bytes_.remove_prefix(size);
        }
    }
    bool isWhole() const { return isWhole_ && bytes_.empty(); }

private:
    void fail() { isWhole_ = false; }
    void copy(void* to, std::size_t size)
    {
        if (size > bytes_.size()) {
            std::memset(to, 0, size);
            return fail();
        }
        std::memcpy(to, bytes_.data(), size);
        bytes_.remove_prefix(size);
    }

    std::string_view bytes_;
    bool isWhole_ = true;
};

std::string bytesOf(const ImageF& image)
{
    return {reinterpret_cast<const char*>(image.data()), image.size() * sizeof(float)};
}

/// But for the panorama. The name stands in what is said, and its end may say how the content is read.
std::string keyOf(const std::string& name, const std::string& content, const environment::DropRadianceOptions& options,
                  const Settings& settings)
{
    return fmt::format("virga {} {}\n{}\n{} {:016x}\n{} {} {} {} {} {} {} {} {}\n{}", VIRGA_VERSION, revision, name,
                       content.size(), contentHash(content), options.order, options.backgroundOrder, options.tolerance,
                       options.paper, options.lights, options.lightThreshold, options.index[0], options.index[1],
                       options.index[2], settings.lightRadiance ? fmt::format("{}", *settings.lightRadiance) : "auto");
}

}  // namespace

std::string keptLightKey(const std::string& path, const environment::DropRadianceOptions& options,
                         const Settings& settings)
{
    const char* ocio = std::getenv("OCIO");
    if (!settings.ocio.empty() || (ocio != nullptr && *ocio != '\0')) return "";
    // A folder has no content, and a pipe would have none left; whoever reads the panorama says what is wrong.
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(path, ignored)) return "";
    std::ifstream file(path, std::ios::binary);
    const std::string content((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    return content.empty() ? "" : keyOf(path, content, options, settings);
}

std::string keptLightKey(const ImageF& panorama, const std::string& name,
                         const environment::DropRadianceOptions& options, const Settings& settings)
{
    return keyOf(name, fmt::format("{} {} ", panorama.width(), panorama.height()) + bytesOf(panorama), options,
                 settings);
}

std::string keptLightKey(std::span<const environment::PlateView> views, const environment::DropRadianceOptions& options,
                         const Settings& settings)
{
    std::string content =
        fmt::format("{} {}", settings.envGain, settings.sky ? fmt::format("{}", *settings.sky) : "auto");
    for (const environment::PlateView& view : views) {
        content += fmt::format("\n{} {} {}", view.plate.width(), view.plate.height(), view.horizontalFov);
        content.append(reinterpret_cast<const char*>(&view.worldFromCamera), sizeof view.worldFromCamera);
        for (int y = 0; y < view.plate.height(); ++y)
            content.append(reinterpret_cast<const char*>(view.plate.row(y)),
                           std::size_t(view.plate.width()) * std::size_t(view.plate.channels()) * sizeof(float));
    }
    return keyOf("plate", content, options, settings);
}

std::optional<KeptLight> loadLight(const KeptFiles& files, const std::string& key)
{
    if (key.empty()) return std::nullopt;
    const std::optional<std::string> bytes = files.load(kind, key);
    if (!bytes) return std::nullopt;
    KeptLight kept;
    environment::DropRadiance& light = kept.light;
    Unpacker from(*bytes);
    from.take(light.radiance), from.take(light.background);
    from.take(light.paper), from.take(light.order), from.take(light.remainder);
    std::size_t lights = 0;
    from.take(lights);
    for (std::size_t i = 0; i < lights && i < bytes->size(); ++i) from.take(light.lights.emplace_back());
    from.take(kept.width), from.take(kept.height);
    from.take(kept.said.warnings), from.take(kept.said.notes);
    return from.isWhole() ? std::optional(std::move(kept)) : std::nullopt;
}

void storeLight(const KeptFiles& files, const std::string& key, const KeptLight& kept)
{
    if (key.empty()) return;
    const environment::DropRadiance& light = kept.light;
    Packer to;
    to.add(light.radiance), to.add(light.background);
    to.add(light.paper), to.add(light.order), to.add(light.remainder);
    to.add(light.lights.size());
    for (const environment::Light& one : light.lights) to.add(one);
    to.add(kept.width), to.add(kept.height);
    to.add(kept.said.warnings), to.add(kept.said.notes);
    files.store(kind, key, to.bytes());
}

}  // namespace virga::shot
