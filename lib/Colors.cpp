#include "Colors.h"

#include "core/Error.h"

namespace virga::lib {
namespace {

class Nothing final : public io::ColorTransform {
public:
    void apply(float*, float*, float*, std::size_t) const override {}
    bool isIdentity() const override { return true; }
};

}  // namespace

void Colors::use(const std::string& ocio)
{
    if (ocio == ocio_) return;
    ocio_ = ocio;
    config_ = nullptr;
    ways_.clear();
}

const io::ColorConfig& Colors::config()
{
    if (!config_) config_ = io::ColorConfig::open(ocio_);
    return *config_;
}

template <class Found>
auto Colors::named(const std::string& space, const std::string& name, const Found& find)
{
    try {
        return find();
    } catch (const Error& error) {
        throw Error(error.code(), "{}: color_space '{}': {}", name, space, error.what());
    }
}

std::string Colors::working(const std::string& space, const std::string& name)
{
    if (space.empty()) return io::primaries::rec709.linearName;
    return named(space, name, [&] { return config().working(space); });
}

Colors::Way Colors::way(const std::string& from, const std::string& to)
{
    Way& way = ways_[{from, to}];
    if (!way) way = config().transform(from, to);
    return way;
}

Colors::Way Colors::toLinear(const std::string& space, const std::string& name)
{
    static const Way nothing = std::make_shared<Nothing>();
    if (space.empty()) return nothing;
    return named(space, name, [&] { return way(space, config().working(space)); });
}

Colors::Way Colors::toCodes(const std::string& working, const std::string& space, const std::string& name)
{
    if (space.empty()) return toLinear(space, name);
    return named(space, name, [&] { return way(working, space); });
}

}  // namespace virga::lib
