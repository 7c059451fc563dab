#include "io/ColorConversion.h"

#include <OpenColorIO/OpenColorIO.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "core/Error.h"
#include "core/Words.h"

namespace virga::io {

namespace OCIO = OCIO_NAMESPACE;

namespace {

constexpr double d65x = 0.3127, d65y = 0.3290;
constexpr Primaries rec709{"Linear Rec.709", {0.640, 0.330}, {0.300, 0.600}, {0.150, 0.060}, {d65x, d65y}};
constexpr Primaries rec601at525{"Linear Rec.601 525", {0.630, 0.340}, {0.310, 0.595}, {0.155, 0.070}, {d65x, d65y}};
constexpr Primaries rec601at625{"Linear Rec.601 625", {0.640, 0.330}, {0.290, 0.600}, {0.150, 0.060}, {d65x, d65y}};
constexpr Primaries rec2020{"Linear Rec.2020", {0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, {d65x, d65y}};
constexpr Primaries p3d65{"Linear P3-D65", {0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, {d65x, d65y}};
// AMPAS S-2014-004 and TB-2014-004.
constexpr Primaries ap1{"ACEScg", {0.713, 0.293}, {0.165, 0.830}, {0.128, 0.044}, {0.32168, 0.33767}};
constexpr Primaries ap0{"ACES2065-1", {0.7347, 0.2653}, {0.0, 1.0}, {0.0001, -0.0770}, {0.32168, 0.33767}};

std::string lowerCase(std::string_view text)
{
    std::string result(text);
    std::transform(result.begin(), result.end(), result.begin(), [](unsigned char c) { return std::tolower(c); });
    return result;
}

using Matrix3 = std::array<std::array<double, 3>, 3>;

Matrix3 multiply(const Matrix3& a, const Matrix3& b)
{
    Matrix3 result{};
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
            for (std::size_t k = 0; k < 3; ++k) result[i][j] += a[i][k] * b[k][j];
    return result;
}

Matrix3 inverse(const Matrix3& m)
{
    Matrix3 result{};
    double determinant = 0;
    for (std::size_t i = 0; i < 3; ++i)
        determinant += m[0][i] * (m[1][(i + 1) % 3] * m[2][(i + 2) % 3] - m[1][(i + 2) % 3] * m[2][(i + 1) % 3]);
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
            result[j][i] = (m[(i + 1) % 3][(j + 1) % 3] * m[(i + 2) % 3][(j + 2) % 3] -
                            m[(i + 1) % 3][(j + 2) % 3] * m[(i + 2) % 3][(j + 1) % 3]) /
                           determinant;
    return result;
}

/// XYZ of the three primaries in its columns, scaled so that (1,1,1) is the white with Y = 1. SMPTE RP 177.
Matrix3 xyzFromRgb(const Primaries& p)
{
    const double* corners[3] = {p.red, p.green, p.blue};
    Matrix3 m{};
    for (std::size_t i = 0; i < 3; ++i) {
        m[0][i] = corners[i][0] / corners[i][1];
        m[1][i] = 1;
        m[2][i] = (1 - corners[i][0] - corners[i][1]) / corners[i][1];
    }
    const double white[3] = {p.white[0] / p.white[1], 1, (1 - p.white[0] - p.white[1]) / p.white[1]};
    const Matrix3 inverted = inverse(m);
    for (std::size_t i = 0; i < 3; ++i) {
        double share = 0;
        for (std::size_t k = 0; k < 3; ++k) share += inverted[i][k] * white[k];
        for (std::size_t row = 0; row < 3; ++row) m[row][i] *= share;
    }
    return m;
}

/// Bradford adaptation to the white of ACES (Lam 1985, as in ICC.1:2010 annex E).
Matrix3 adaptToAcesWhite(const Primaries& p)
{
    const Matrix3 bradford{{{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};
    const auto cone = [&](const double white[2]) {
        const double xyz[3] = {white[0] / white[1], 1, (1 - white[0] - white[1]) / white[1]};
        std::array<double, 3> result{};
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t k = 0; k < 3; ++k) result[i] += bradford[i][k] * xyz[k];
        return result;
    };
    const auto from = cone(p.white), to = cone(ap0.white);
    Matrix3 scale{};
    for (std::size_t i = 0; i < 3; ++i) scale[i][i] = to[i] / from[i];
    return multiply(inverse(bradford), multiply(scale, bradford));
}

OCIO::TransformRcPtr toAces(const Primaries& p)
{
    const Matrix3 m = multiply(inverse(xyzFromRgb(ap0)), multiply(adaptToAcesWhite(p), xyzFromRgb(p)));
    std::array<double, 16> values{};
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) values[4 * i + j] = m[i][j];
    values[15] = 1;
    const auto transform = OCIO::MatrixTransform::Create();
    transform->setMatrix(values.data());
    return transform;
}

/// Our configuration. Its spaces hold linear light of each set of primaries and what has no curve of ours; curves are
/// applied by Curve.h before and after, which is faster and knows HLG.
OCIO::ConstConfigRcPtr ownConfig()
{
    static const OCIO::ConstConfigRcPtr made = [] {
        const auto config = OCIO::Config::Create();
        config->setVersion(2, 1);
        const auto add = [&](const char* name, const OCIO::TransformRcPtr& toReference, bool isData) {
            const auto space = OCIO::ColorSpace::Create();
            space->setName(name);
            space->setIsData(isData);
            if (toReference) space->setTransform(toReference, OCIO::COLORSPACE_DIR_TO_REFERENCE);
            config->addColorSpace(space);
        };
        for (const Primaries* p : {&ap0, &ap1, &rec709, &rec601at525, &rec601at625, &rec2020, &p3d65})
            add(p->linearName, p == &ap0 ? nullptr : toAces(*p), false);
        for (const char* style : {"ACEScct_to_ACES2065-1", "ACEScc_to_ACES2065-1"}) {
            const auto transform = OCIO::BuiltinTransform::Create();
            transform->setStyle(style);
            add(std::string(style).substr(0, std::string(style).find('_')).c_str(), transform, false);
        }
        add("raw", nullptr, true);
        config->setRole("aces_interchange", ap0.linearName);
        config->setRole(OCIO::ROLE_SCENE_LINEAR, rec709.linearName);
        config->setRole(OCIO::ROLE_DEFAULT, "raw");
        config->setRole(OCIO::ROLE_DATA, "raw");
        return config;
    }();
    return made;
}

/// The configuration that $OCIO names, or null. Read once.
OCIO::ConstConfigRcPtr userConfig()
{
    static const OCIO::ConstConfigRcPtr read = []() -> OCIO::ConstConfigRcPtr {
        const char* path = std::getenv("OCIO");
        if (path == nullptr || *path == '\0') return nullptr;
        try {
            return OCIO::Config::CreateFromFile(path);
        } catch (const OCIO::Exception& problem) {
            throw Error(ErrorCode::Input, "{}: the colour configuration that $OCIO names cannot be read: {}", path,
                        problem.what());
        }
    }();
    return read;
}

/// A space found by name: in one of the configurations, or one of ours that is a curve over linear primaries.
struct Found {
    OCIO::ConstConfigRcPtr config;
    std::string spaceName;  // in `config`
    Curve curve = Curve::Linear;
    bool isUsers = false;
    bool isData = false;
};

std::vector<std::string> allNames()
{
    std::vector<std::string> names;
    if (const auto config = userConfig())
        for (int i = 0; i < config->getNumColorSpaces(); ++i) names.emplace_back(config->getColorSpaceNameByIndex(i));
    for (const NamedSpace& space : ownColorspaces()) names.emplace_back(space.name);
    names.insert(names.end(), {"ACEScct", "ACEScc"});
    return names;
}

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

Found find(const std::string& name)
{
    if (const auto config = userConfig())
        if (const auto space = config->getColorSpace(name.c_str()))
            return {config, space->getName(), Curve::Linear, true, space->isData()};
    if (const NamedSpace* own = findOwnColorspace(name)) {
        const bool isData = own->primaries == nullptr;
        return {ownConfig(), isData ? "raw" : own->primaries->linearName, own->curve, false, isData};
    }
    if (const auto space = ownConfig()->getColorSpace(name.c_str()))
        return {ownConfig(), space->getName(), Curve::Linear, false, space->isData()};

    const std::vector<std::string> names = allNames();
    if (name == "list") throw Error(ErrorCode::InvalidArgument, "the colour spaces are {}", fmt::join(names, ", "));
    throw Error(ErrorCode::InvalidArgument, "colour space '{}' is not known; near it are {}; 'list' names all {}", name,
                fmt::join(nearestNames(name, names), ", "), names.size());
}

class IdentityTransform final : public ColorTransform {
public:
    void apply(float*, float*, float*, std::size_t) const override {}
    bool isIdentity() const override { return true; }
};

class CurveTransform final : public ColorTransform {
public:
    CurveTransform(Curve curve, bool decode) : curve_(curve), decode_(decode) {}
    void apply(float* red, float* green, float* blue, std::size_t count) const override
    {
        for (float* values : {red, green, blue}) (decode_ ? decodeCurve : encodeCurve)(curve_, values, count);
    }

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

}  // namespace

const std::vector<NamedSpace>& ownColorspaces()
{
    static const std::vector<NamedSpace> spaces = {
        {"sRGB", Curve::Srgb, &rec709},
        {"Rec.709 camera", Curve::Rec709Camera, &rec709},
        {"Rec.709 BT.1886", Curve::Bt1886, &rec709},
        {"Rec.709 gamma 2.2", Curve::Gamma22, &rec709},
        {"Rec.709 gamma 2.8", Curve::Gamma28, &rec709},
        {"Linear Rec.709", Curve::Linear, &rec709},
        {"Cineon", Curve::Cineon, &rec709},
        {"Rec.601 525", Curve::Srgb, &rec601at525},
        {"Linear Rec.601 525", Curve::Linear, &rec601at525},
        {"Rec.601 625", Curve::Srgb, &rec601at625},
        {"Linear Rec.601 625", Curve::Linear, &rec601at625},
        {"Display P3", Curve::Srgb, &p3d65},
        {"P3-D65 gamma 2.6", Curve::Gamma26, &p3d65},
        {"P3-D65 PQ", Curve::Pq, &p3d65},
        {"Linear P3-D65", Curve::Linear, &p3d65},
        {"Rec.2020", Curve::Srgb, &rec2020},
        {"Rec.2020 camera", Curve::Rec709Camera, &rec2020},
        {"Rec.2020 BT.1886", Curve::Bt1886, &rec2020},
        {"Rec.2020 PQ", Curve::Pq, &rec2020},
        {"Rec.2020 HLG", Curve::Hlg, &rec2020},
        {"Linear Rec.2020", Curve::Linear, &rec2020},
        {"ACEScg", Curve::Linear, &ap1},
        {"ACES2065-1", Curve::Linear, &ap0},
        {"raw", Curve::Linear, nullptr},
    };
    return spaces;
}

const NamedSpace* findOwnColorspace(std::string_view name)
{
    const std::string wanted = lowerCase(name);
    // Words that people type for the same things.
    static const std::array<std::pair<const char*, const char*>, 8> synonyms = {{{"rec.709", "srgb"},
                                                                                 {"rec709", "srgb"},
                                                                                 {"linear", "linear rec.709"},
                                                                                 {"lin_rec709", "linear rec.709"},
                                                                                 {"scene_linear", "linear rec.709"},
                                                                                 {"data", "raw"},
                                                                                 {"lin_rec2020", "linear rec.2020"},
                                                                                 {"lin_srgb", "linear rec.709"}}};
    const auto synonym =
        std::find_if(synonyms.begin(), synonyms.end(), [&](const auto& s) { return wanted == s.first; });
    for (const NamedSpace& space : ownColorspaces())
        if (lowerCase(space.name) == (synonym == synonyms.end() ? wanted : synonym->second)) return &space;
    return nullptr;
}

const NamedSpace* findOwnColorspace(Curve curve, std::string_view linearName)
{
    for (const NamedSpace& space : ownColorspaces())
        if (space.primaries != nullptr && space.curve == curve && linearName == space.primaries->linearName)
            return &space;
    return nullptr;
}

const Primaries* findPrimaries(const float chromaticities[8])
{
    for (const Primaries* p : {&rec709, &rec601at525, &rec601at625, &rec2020, &p3d65, &ap1, &ap0}) {
        const double* corners[4] = {p->red, p->green, p->blue, p->white};
        bool near = true;
        for (int i = 0; i < 8; ++i) near = near && std::fabs(double(chromaticities[i]) - corners[i / 2][i % 2]) < 0.002;
        if (near) return p;
    }
    return nullptr;
}

const Primaries* primariesOf(const std::string& colorspace)
{
    const NamedSpace* own = findOwnColorspace(colorspace);
    const bool isUsers = userConfig() && userConfig()->getColorSpace(colorspace.c_str());
    return own != nullptr && !isUsers ? own->primaries : nullptr;
}

std::string resolveColorspace(const std::string& name)
{
    const Found found = find(name);
    if (found.isUsers) return found.spaceName;
    if (const NamedSpace* own = findOwnColorspace(name)) return own->name;
    return found.spaceName;
}

std::string colorspaceFromFileRules(const std::string& path)
{
    const auto config = userConfig();
    if (!config) return {};
    std::size_t rule = 0;
    const std::string space = config->getColorSpaceFromFilepath(path.c_str(), rule);
    // The last rule is the default one, which every file matches.
    return rule + 1 < config->getFileRules()->getNumEntries() ? space : std::string();
}

std::string workingColorspace(const std::string& colorspace)
{
    const Found found = find(colorspace);
    if (found.isData) return resolveColorspace(colorspace);
    if (found.isUsers) {
        const auto linear = found.config->getColorSpace(OCIO::ROLE_SCENE_LINEAR);
        return linear ? linear->getName() : found.spaceName;
    }
    // Of our own spaces only those without a curve of ours (ACEScct, ACEScc) are not linear in their own primaries.
    return findOwnColorspace(colorspace) != nullptr ? found.spaceName : std::string(ap1.linearName);
}

std::shared_ptr<const ColorTransform> makeColorTransform(const std::string& from, const std::string& to)
{
    const Found source = find(from), target = find(to);
    const bool sameSpace = source.config == target.config && source.spaceName == target.spaceName;
    if (source.isData || target.isData || (sameSpace && source.curve == target.curve))
        return std::make_shared<IdentityTransform>();
    if (sameSpace && target.curve == Curve::Linear) return std::make_shared<CurveTransform>(source.curve, true);
    if (sameSpace && source.curve == Curve::Linear) return std::make_shared<CurveTransform>(target.curve, false);
    try {
        const auto processor = source.config == target.config
                                   ? source.config->getProcessor(source.spaceName.c_str(), target.spaceName.c_str())
                                   : OCIO::Config::GetProcessorFromConfigs(source.config, source.spaceName.c_str(),
                                                                           target.config, target.spaceName.c_str());
        return std::make_shared<ProcessorTransform>(
            source.curve, processor->getOptimizedCPUProcessor(OCIO::OPTIMIZATION_LOSSLESS), target.curve);
    } catch (const OCIO::Exception& problem) {
        throw Error(ErrorCode::InvalidArgument, "there is no way from colour space '{}' to '{}': {}", from, to,
                    problem.what());
    }
}

}  // namespace virga::io
