#include "io/ColorConversion.h"

#include <OpenColorIO/OpenColorIO.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <mutex>

#include "core/Error.h"
#include "core/Log.h"
#include "core/Words.h"

namespace virga::io {

namespace OCIO = OCIO_NAMESPACE;

namespace {

/// At most four, nearest first, whatever their case; the beginning of a name is compared as well as the whole.
std::vector<std::string> nearestNames(const std::string& name, std::vector<std::string> names)
{
    const std::string wanted = lowerCase(name);
    const auto distance = [&](const std::string& candidate) {
        const std::string lower = lowerCase(candidate);
        return std::min(editDistance(wanted, lower), editDistance(wanted, lower.substr(0, wanted.size())));
    };
    std::stable_sort(names.begin(), names.end(),
                     [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
    names.resize(std::min<std::size_t>(names.size(), 4));
    return names;
}

/// What OpenColorIO says, as the middle of a sentence of ours.
std::string oneLine(const std::string& text)
{
    std::string line;
    for (const char c : text)
        if (c != '\n')
            line += c;
        else if (!line.empty() && line.back() != ' ')
            line += ' ';
    while (!line.empty() && (line.back() == ' ' || line.back() == '.')) line.pop_back();
    constexpr std::size_t longest = 300;
    return line.size() > longest ? line.substr(0, longest) + "..." : line;
}

/// Once a process: OpenColorIO's own messages go to the detailed log.
void routeMessages()
{
    static std::once_flag once;
    std::call_once(once, [] {
        OCIO::SetLoggingFunction([](const char* message) {
            try {
                if (const std::string text = oneLine(message); !text.empty()) log::writeDetail(text);
            } catch (...) {  // a message that is lost is better than an exception through the library
            }
        });
    });
}

OCIO::MatrixTransformRcPtr matrixTransform(const Matrix3& m)
{
    std::array<double, 16> values{};
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) values[4 * i + j] = m[i][j];
    values[15] = 1;
    const auto transform = OCIO::MatrixTransform::Create();
    transform->setMatrix(values.data());
    return transform;
}

class IdentityTransform final : public ColorTransform {
public:
    void apply(float*, float*, float*, std::size_t) const override {}
    bool isIdentity() const override { return true; }
    std::optional<PowerCurve> power() const override { return PowerCurve(); }
};

class CurveTransform final : public ColorTransform {
public:
    CurveTransform(Curve curve, bool decode) : curve_(curve), decode_(decode) {}
    void apply(float* red, float* green, float* blue, std::size_t count) const override
    {
        for (float* values : {red, green, blue}) (decode_ ? decodeCurve : encodeCurve)(curve_, values, count);
    }
    std::optional<PowerCurve> power() const override { return powerOf(curve_); }

private:
    Curve curve_;
    bool decode_;
};

/// Curve off, through OpenColorIO, curve on.
class ProcessorTransform final : public ColorTransform {
public:
    ProcessorTransform(Curve from, OCIO::ConstCPUProcessorRcPtr processor, Curve to)
        : from_(from), to_(to), processor_(std::move(processor))
    {
    }
    void apply(float* red, float* green, float* blue, std::size_t count) const override
    {
        for (float* values : {red, green, blue}) decodeCurve(from_, values, count);
        if (!processor_->isNoOp()) {
            OCIO::PlanarImageDesc pixels(red, green, blue, nullptr, long(count), 1);
            processor_->apply(pixels);
        }
        for (float* values : {red, green, blue}) encodeCurve(to_, values, count);
    }

private:
    Curve from_, to_;
    OCIO::ConstCPUProcessorRcPtr processor_;
};

/// What joins the user's configuration to ours.
constexpr const char* acesRole = "aces_interchange";

/// A space found by name: one of the user's configuration, or one of ours.
struct Found {
    OCIO::ConstColorSpaceRcPtr users;
    const NamedSpace* own = nullptr;

    std::string name() const { return users ? users->getName() : own->name; }
    bool isData() const { return users ? users->isData() : own->primaries == nullptr; }
    explicit operator bool() const { return users || own != nullptr; }
};

class Config final : public ColorConfig {
public:
    Config(OCIO::ConstConfigRcPtr users, std::string origin) : users_(std::move(users)), origin_(std::move(origin)) {}

    std::string origin() const override { return origin_; }
    bool knows(const std::string& name) const override { return bool(lookUp(name)); }
    std::string resolve(const std::string& name) const override { return find(name).name(); }

    const NamedSpace* equivalent(const std::string& name) const override
    {
        const Found found = find(name);
        if (found.own != nullptr) return found.own;
        if (found.isData()) return findOwnColorspace("raw");
        if (!users_->hasRole(acesRole)) return nullptr;
        // Colours in the user's space, and what they are in ACES2065-1.
        static constexpr float probes[][3] = {
            {0.18f, 0.18f, 0.18f}, {0.7f, 0.1f, 0.2f}, {0.3f, 0.9f, 0.05f}, {0.02f, 0.4f, 0.6f}, {1, 1, 1}};
        std::vector<std::array<float, 3>> aces;
        const auto toAces = transform(found.name(), primaries::ap0.linearName);
        for (const auto& probe : probes) {
            std::array<float, 3> value{probe[0], probe[1], probe[2]};
            toAces->apply(&value[0], &value[1], &value[2], 1);
            aces.push_back(value);
        }
        for (const NamedSpace& space : ownColorspaces()) {
            if (space.primaries == nullptr) continue;
            const Matrix3 m = conversionMatrix(*space.primaries, primaries::ap0);
            double worst = 0;
            for (std::size_t k = 0; k < aces.size(); ++k)
                for (std::size_t i = 0; i < 3; ++i) {
                    double value = 0;
                    for (std::size_t j = 0; j < 3; ++j)
                        value += m[i][j] * decodeCurveExact(space.curve, double(probes[k][j]));
                    worst = std::max(worst, std::fabs(value - double(aces[k][i])));
                }
            if (worst < 1e-4) return &space;
        }
        return nullptr;
    }

    std::string fromFileRules(const std::string& path) const override
    {
        if (!users_) return {};
        std::size_t rule = 0;
        const std::string space = users_->getColorSpaceFromFilepath(path.c_str(), rule);
        // The last rule is the default one, which every file matches.
        return rule + 1 < users_->getFileRules()->getNumEntries() ? resolve(space) : std::string();
    }

    std::string working(const std::string& colorspace) const override
    {
        const Found found = find(colorspace);
        if (found.isData()) return found.name();
        if (found.own != nullptr) return found.own->primaries->linearName;
        const auto linear = users_->getColorSpace(OCIO::ROLE_SCENE_LINEAR);
        if (!linear)
            throw Error(ErrorCode::Input, "{}: has no role scene_linear, so that '{}' has no linear space to work in",
                        origin_, found.name());
        return linear->getName();
    }

    std::shared_ptr<const ColorTransform> transform(const std::string& from, const std::string& to) const override
    {
        const Found source = find(from), target = find(to);
        if (source.isData() || target.isData() || source.name() == target.name())
            return std::make_shared<IdentityTransform>();
        if (source.own != nullptr && target.own != nullptr && source.own->primaries == target.own->primaries) {
            if (target.own->curve == Curve::Linear) return std::make_shared<CurveTransform>(source.own->curve, true);
            if (source.own->curve == Curve::Linear) return std::make_shared<CurveTransform>(target.own->curve, false);
        }
        try {
            const auto processor = processorBetween(source, target);
            return std::make_shared<ProcessorTransform>(
                curveOf(source), processor->getOptimizedCPUProcessor(OCIO::OPTIMIZATION_LOSSLESS), curveOf(target));
        } catch (const OCIO::Exception& problem) {
            throw Error(ErrorCode::InvalidArgument, "there is no way from colour space '{}' to '{}': {}", from, to,
                        oneLine(problem.what()));
        }
    }

    std::vector<Listed> spaces() const override
    {
        std::vector<Listed> result;
        for (int i = 0; users_ && i < users_->getNumColorSpaces(); ++i) {
            const auto space = users_->getColorSpace(users_->getColorSpaceNameByIndex(i));
            Listed listed{space->getName(), space->getFamily(), {}, true};
            for (std::size_t a = 0; a < space->getNumAliases(); ++a) listed.aliases.emplace_back(space->getAlias(a));
            result.push_back(std::move(listed));
        }
        for (const NamedSpace& space : ownColorspaces()) {
            const Found found = lookUp(space.name);
            if (found.users) continue;  // hidden by one of the user's
            result.push_back({space.name, space.family, space.aliases, false});
        }
        return result;
    }

    std::vector<std::pair<std::string, std::string>> roles() const override
    {
        std::vector<std::pair<std::string, std::string>> result;
        for (int i = 0; users_ && i < users_->getNumRoles(); ++i)
            result.emplace_back(users_->getRoleName(i), users_->getRoleColorSpace(i));
        for (const auto& [role, space] : ownRoles())
            if (!users_ || !users_->hasRole(role.c_str())) result.emplace_back(role, resolve(role));
        return result;
    }

private:
    /// Nothing if nobody knows the name.
    Found lookUp(const std::string& name) const
    {
        Found found;
        if (users_) found.users = users_->getColorSpace(name.c_str());
        if (found.users) return found;
        found.own = findOwnColorspace(name);
        if (found.own != nullptr) return found;
        const std::string wanted = lowerCase(name);
        for (const auto& [role, space] : ownRoles())
            if (wanted == role) found.own = findOwnColorspace(space);
        return found;
    }

    Found find(const std::string& name) const
    {
        if (const Found found = lookUp(name)) return found;
        std::vector<std::string> names;
        for (const Listed& space : spaces()) names.push_back(space.name);
        throw Error(ErrorCode::InvalidArgument,
                    "colour space '{}' is not known; near it are {}; 'virga info --colorspaces' lists all {}", name,
                    fmt::join(nearestNames(name, names), ", "), names.size());
    }

    static Curve curveOf(const Found& space) { return space.own != nullptr ? space.own->curve : Curve::Linear; }

    /// Between the linear lights of ours, the user's spaces as they are, or across.
    OCIO::ConstProcessorRcPtr processorBetween(const Found& source, const Found& target) const
    {
        if (source.users && target.users) return users_->getProcessor(source.users, target.users);
        const auto group = OCIO::GroupTransform::Create();
        if (source.users) group->appendTransform(throughInterchange(source.users->getName(), true));
        const Primaries& from = source.own != nullptr ? *source.own->primaries : primaries::ap0;
        const Primaries& to = target.own != nullptr ? *target.own->primaries : primaries::ap0;
        group->appendTransform(matrixTransform(conversionMatrix(from, to)));
        if (target.users) group->appendTransform(throughInterchange(target.users->getName(), false));
        return (users_ ? users_ : OCIO::Config::CreateRaw())->getProcessor(group);
    }

    /// A space of the user's configuration to ACES2065-1 or back.
    OCIO::TransformRcPtr throughInterchange(const char* space, bool toAces) const
    {
        if (!users_->hasRole(acesRole))
            throw OCIO::Exception(
                (origin_ + " has no role aces_interchange, which joins it to the built-in spaces").c_str());
        const auto transform = OCIO::ColorSpaceTransform::Create();
        transform->setSrc(toAces ? space : acesRole);
        transform->setDst(toAces ? acesRole : space);
        transform->setDataBypass(false);
        return transform;
    }

    OCIO::ConstConfigRcPtr users_;  // null: ours alone
    std::string origin_;
};

}  // namespace

std::shared_ptr<const ColorConfig> ColorConfig::builtIn() { return std::make_shared<Config>(nullptr, "built-in"); }

std::shared_ptr<const ColorConfig> ColorConfig::open(const std::string& file)
{
    routeMessages();
    const char* variable = std::getenv("OCIO");
    const std::string path = !file.empty() ? file : variable != nullptr ? variable : "";
    if (path.empty()) return builtIn();
    const std::string origin = path + (file.empty() ? " ($OCIO)" : " (--ocio)");
    std::error_code error;
    if (!path.starts_with("ocio://") && !std::filesystem::is_regular_file(path, error))
        throw Error(ErrorCode::Input, "{}: {}; a colour configuration is a file such as config.ocio", origin,
                    std::filesystem::exists(path, error) ? "is not a file" : "does not exist");
    try {
        const OCIO::ConstConfigRcPtr config = OCIO::Config::CreateFromFile(path.c_str());
        config->validate();
        return std::make_shared<Config>(config, origin);
    } catch (const OCIO::Exception& problem) {
        throw Error(ErrorCode::Input, "{}: is no colour configuration that can be used: {}", origin,
                    oneLine(problem.what()));
    }
}

std::shared_ptr<const ColorTransform> makeColorTransform(const std::string& from, const std::string& to)
{
    return ColorConfig::builtIn()->transform(from, to);
}

namespace {

ColorClaim weigh(const ColorConfig& config, const std::string& flag, const std::string& path,
                 const std::vector<ColorClaim>& said)
{
    if (!flag.empty()) return {config.resolve(flag), "flag"};
    for (const ColorClaim& claim : said)
        if (!claim.isGuess() && config.knows(claim.colorspace))
            return {config.resolve(claim.colorspace), claim.source, claim.doubt};
    if (const std::string ruled = config.fromFileRules(path); !ruled.empty())
        return {ruled, "file rules of " + config.origin()};
    return {config.resolve(said.back().colorspace), said.back().source, said.back().doubt};
}

}  // namespace

ColorClaim chooseColorspace(const ColorConfig& config, const std::string& flag, const std::string& path,
                            const std::vector<ColorClaim>& said)
{
    ColorClaim claim = weigh(config, flag, path, said);
    if (!claim.doubt.empty())
        log::warning("{}: {}; taken for {}, --colorspace says otherwise", path, claim.doubt, claim.colorspace);
    return claim;
}

}  // namespace virga::io
