#include "Panel.h"

#include <algorithm>
#include <charconv>
#include <climits>
#include <cstring>
#include <sstream>

#include "Host.h"

namespace virga::ofxplugin {

namespace {

/// Ends of the slider where the range allowed is far wider than what is turned; the value where "auto" is the default.
struct Feel {
    const char* name;
    double least, most, start;
};
constexpr Feel feels[] = {
    {"rate", 0, 100, 0},
    {"strokes", 100, 200000, 20000},
    {"drop-size", 0.2, 5, 0},
    {"speed", 0, 3, 0},
    {"wind", -15, 15, 0},
    {"gust", 0, 5, 0},
    {"turbulence", 0, 3, 0},
    {"opacity", 0, 20, 0},
    {"near", 0.1, 20, 0},
    {"far", 10, 500, 0},
    {"threshold", 0.001, 0.1, 0},
    {"seed", 0, 1000, 0},
    {"shutter", 0, 360, 180},
    {"exposure", 0, 0.04, 0.005},
    {"fov", 5, 120, 60},
    {"focus", 0.5, 100, 0},
    {"fstop", 1, 32, 0},
    {"sensor-width", 5, 40, 0},
    {"camera-scale", 0.01, 100, 0},
    {"camera-offset", -1000, 1000, 0},
    {"fps", 1, 120, 24},
    {"first-frame", 0, 10000, 0},
    {"env-yaw", -180, 180, 0},
    {"env-pitch", -90, 90, 0},
    {"env-gain", 0, 10, 0},
    {"env-order", 0, 32, 12},
    {"env-frames", 0, 16, 0},
    {"light-radiance", 1, 100, 10},
    {"sky", 0, 5, 1},
    {"background-boost", 0, 1, 0},
    {"depth-scale", 0.001, 10, 0},
    {"depth-offset", -10, 10, 0},
    {"depth-range", 0, 1000, 0},
    {"depth-baseline", 0, 1, 0},
    {"depth-first-frame", 0, 10000, 0},
    {"depth-no-value", 0, 1000, 0},
    {"fog", 0, 0.05, 0.002},
    {"fog-color", 0, 1, 0.5},
    {"fog-distance", 1, 500, 0},
    {"blur", 0, 10, 0},
    {"blur-distance", 1, 200, 0},
    {"splashes", 0, 5, 0},
    {"splash-size", 0.2, 5, 0},
};

constexpr const char* fileRows[] = {"mattes", "camera", "env", "lights", "depth", "grade-from"};

std::size_t numbersOf(const virga_parameter& p)
{
    return p.type == VIRGA_TWO_NUMBERS ? 2 : p.type == VIRGA_COLOR_OR_AUTO ? 3 : 1;
}

PanelRow makeRow(const virga_parameter& p)
{
    PanelRow row{&p, p.name, "", {}, false, {}, p.least, p.most};
    std::replace(row.name.begin(), row.name.end(), '-', '_');
    if (p.type == VIRGA_NUMBER_OR_AUTO || p.type == VIRGA_COLOR_OR_AUTO) row.autoName = row.name + "_auto";
    if (p.choices != nullptr) {
        std::istringstream words(p.choices);
        for (std::string word; std::getline(words, word, '|');) row.words.push_back(word);
        const auto at = std::find(row.words.begin(), row.words.end(), p.default_text);
        row.start[0] = at == row.words.end() ? 0 : double(at - row.words.begin());
    }
    row.isFile = std::any_of(std::begin(fileRows), std::end(fileRows),
                             [&](const char* name) { return std::strcmp(name, p.name) == 0; });
    for (std::size_t i = 0; i < numbersOf(p) && i < p.default_count; ++i) row.start[i] = p.default_numbers[i];
    for (const Feel& feel : feels) {
        if (std::strcmp(feel.name, p.name) != 0) continue;
        row.displayLeast = std::max(feel.least, p.least);
        row.displayMost = std::min(feel.most, p.most);
        if (p.default_count == 0) std::fill_n(row.start, numbersOf(p), std::clamp(feel.start, p.least, p.most));
    }
    for (std::size_t i = 0; i < numbersOf(p) && p.choices == nullptr; ++i) {
        row.displayLeast = std::min(row.displayLeast, row.start[i]);
        row.displayMost = std::max(row.displayMost, row.start[i]);
    }
    return row;
}

std::string labelOf(std::string name)
{
    std::replace(name.begin(), name.end(), '-', ' ');
    name[0] = char(std::toupper(static_cast<unsigned char>(name[0])));
    return name;
}

/// A number as virga reads it back to the same value.
std::string numberText(double value)
{
    char text[32];
    const auto end = std::to_chars(text, text + sizeof text, value);
    return {text, end.ptr};
}

/// "how much rain falls [mm/h], 0 to 2000".
std::string hintOf(const virga_parameter& p)
{
    std::string hint = p.help;
    const bool isNumber = p.type != VIRGA_SWITCH && p.type != VIRGA_TEXT;
    if (*p.unit != '\0') hint += std::string(" [") + (std::strcmp(p.unit, "x") == 0 ? "multiplier" : p.unit) + "]";
    if (isNumber) hint += ", " + numberText(p.least) + " to " + numberText(p.most);
    return hint;
}

class Definer {
public:
    explicit Definer(OfxParamSetHandle set) : set_(set) {}

    Properties define(const char* type, const std::string& name, const std::string& label,
                      const std::string& hint) const
    {
        OfxPropertySetHandle handle = nullptr;
        if (host().parameter().paramDefine(set_, type, name.c_str(), &handle) != ofx::statOk)
            throw Failure(ofx::statFailed, "the host does not define the parameter '" + name + "'");
        const Properties control(handle);
        control.set(ofx::prop::label, label);
        control.set(ofx::prop::hint, hint);
        if (!group_.empty()) control.set(ofx::prop::parent, group_);
        return control;
    }
    void openGroup(const std::string& name, bool isOpen)
    {
        group_.clear();
        const Properties group = define(ofx::value::paramGroup, "group_" + name, labelOf(name), "");
        group.set(ofx::prop::groupOpen, isOpen ? 1 : 0);
        group_ = "group_" + name;
    }
    void choice(const char* name, const char* label, const char* hint, std::span<const char* const> words) const
    {
        const Properties control = define(ofx::value::paramChoice, name, label, hint);
        for (std::size_t i = 0; i < words.size(); ++i) control.set(ofx::prop::choiceOption, words[i], int(i));
        control.set(ofx::prop::defaultValue, 0);
        control.set(ofx::prop::animates, 0);
    }

private:
    OfxParamSetHandle set_;
    std::string group_;
};

const char* controlType(const PanelRow& row)
{
    switch (row.parameter->type) {
        case VIRGA_SWITCH: return ofx::value::paramBoolean;
        case VIRGA_WHOLE_NUMBER: return ofx::value::paramInteger;
        case VIRGA_TEXT: return row.words.empty() ? ofx::value::paramString : ofx::value::paramChoice;
        case VIRGA_TWO_NUMBERS: return ofx::value::paramDouble2D;
        case VIRGA_COLOR_OR_AUTO: return ofx::value::paramRgb;
        case VIRGA_NUMBER:
        case VIRGA_NUMBER_OR_AUTO: break;
    }
    return ofx::value::paramDouble;
}

int whole(double value) { return int(std::clamp(value, double(INT_MIN), double(INT_MAX))); }

void defineRow(const Definer& definer, const PanelRow& row)
{
    const virga_parameter& p = *row.parameter;
    if (!row.autoName.empty()) {
        const Properties toggle = definer.define(ofx::value::paramBoolean, row.autoName, labelOf(p.name) + ": auto",
                                                 "auto, instead of the value below. " + hintOf(p));
        toggle.set(ofx::prop::defaultValue, p.default_count == 0 ? 1 : 0);
    }
    const Properties control = definer.define(controlType(row), row.name, labelOf(p.name), hintOf(p));
    switch (p.type) {
        case VIRGA_SWITCH: control.set(ofx::prop::defaultValue, row.start[0] != 0 ? 1 : 0); break;
        case VIRGA_WHOLE_NUMBER:
            control.set(ofx::prop::least, whole(p.least));
            control.set(ofx::prop::most, whole(p.most));
            control.set(ofx::prop::displayLeast, whole(row.displayLeast));
            control.set(ofx::prop::displayMost, whole(row.displayMost));
            control.set(ofx::prop::defaultValue, whole(row.start[0]));
            break;
        case VIRGA_TEXT:
            if (!row.words.empty()) {
                for (std::size_t i = 0; i < row.words.size(); ++i)
                    control.set(ofx::prop::choiceOption, row.words[i], int(i));
                control.set(ofx::prop::defaultValue, int(row.start[0]));
            } else {
                control.set(ofx::prop::stringMode,
                            row.isFile ? ofx::value::stringFilePath : ofx::value::stringSingleLine);
                // Patterns such as z.####.exr name no file that exists.
                if (row.isFile) control.set(ofx::prop::filePathExists, 0);
                control.set(ofx::prop::defaultValue, p.default_text);
            }
            control.set(ofx::prop::animates, 0);
            break;
        case VIRGA_NUMBER:
        case VIRGA_NUMBER_OR_AUTO:
        case VIRGA_TWO_NUMBERS:
        case VIRGA_COLOR_OR_AUTO: {
            const bool isColor = p.type == VIRGA_COLOR_OR_AUTO;
            for (std::size_t i = 0; i < numbersOf(p); ++i) {
                control.set(ofx::prop::defaultValue, row.start[i], int(i));
                if (isColor) continue;  // hosts have their own range for colours
                control.set(ofx::prop::least, p.least, int(i));
                control.set(ofx::prop::most, p.most, int(i));
                control.set(ofx::prop::displayLeast, row.displayLeast, int(i));
                control.set(ofx::prop::displayMost, row.displayMost, int(i));
            }
            if (isColor) break;
            control.set(ofx::prop::digits, row.displayMost - row.displayLeast < 1 ? 4 : 2);
            control.set(ofx::prop::increment, (row.displayMost - row.displayLeast) / 200);
            if (std::strcmp(p.name, "wind") == 0) {
                control.set(ofx::prop::dimensionLabel, "x", 0);
                control.set(ofx::prop::dimensionLabel, "z", 1);
            }
            break;
        }
    }
}

}  // namespace

std::span<const PanelRow> panel()
{
    static const std::vector<PanelRow> rows = [] {
        std::vector<PanelRow> made;
        for (std::size_t i = 0; i < virga_parameter_count(); ++i) {
            const virga_parameter& p = *virga_parameter_at(i);
            if (std::strcmp(p.group, "file") != 0) made.push_back(makeRow(p));
        }
        return made;
    }();
    return rows;
}

void definePanel(OfxParamSetHandle set)
{
    Definer definer(set);
    std::string group;
    for (const PanelRow& row : panel()) {
        if (group != row.parameter->group) {
            group = row.parameter->group;
            definer.openGroup(group, group == "rain");
        }
        defineRow(definer, row);
    }
    definer.openGroup("picture", false);
    const char* const outputs[] = {"Rain over the plate", "Rain alone", "Splashes alone", "Fog alone", "Graded plate"};
    definer.choice(control::output, "Output",
                   "what comes out: the finished picture, or one layer of it; rain over (splashes over (fog over the "
                   "graded plate)) is the picture",
                   outputs);
    const char* const frames[] = {"The source's region", "The project's format"};
    definer.choice(
        control::frame, "Frame is",
        "what the camera sees: the lens's axis goes through its middle, the field of view over its width. "
        "The project's format for sources with overscan, and those whose region changes; it rains in the overscan "
        "too",
        frames);
    const char* const pixels[] = {"As the host says, else by bit depth", "Scene-linear", "Video (sRGB)",
                                  "As named below"};
    definer.choice(control::pixels, "Pixels are",
                   "what the source's numbers mean. Where the host does not say, float and half are taken for "
                   "scene-linear, 8 and 16 bits for video",
                   pixels);
    const Properties name =
        definer.define(ofx::value::paramString, control::colourSpace, "Colour space",
                       "name of the source's colour space, as 'virga info --colorspaces' lists them");
    name.set(ofx::prop::stringMode, ofx::value::stringSingleLine);
    name.set(ofx::prop::defaultValue, "");
    name.set(ofx::prop::animates, 0);
}

PanelValues::PanelValues(OfxParamSetHandle set) : set_(set)
{
    for (const PanelRow& row : panel()) {
        values_.push_back(find(row.name.c_str()));
        autos_.push_back(row.autoName.empty() ? nullptr : find(row.autoName.c_str()));
    }
}

OfxParamHandle PanelValues::find(const char* name) const
{
    OfxParamHandle handle = nullptr;
    if (host().parameter().paramGetHandle(set_, name, &handle, nullptr) != ofx::statOk || handle == nullptr)
        throw Failure(ofx::statFailed, std::string("the host has lost the parameter '") + name + "'");
    return handle;
}

std::vector<std::string> PanelValues::texts(OfxTime time) const
{
    const auto get = host().parameter().paramGetValueAtTime;
    const auto needs = [](OfxStatus status, const PanelRow& row) {
        if (status != ofx::statOk)
            throw Failure(ofx::statFailed, "the host does not give the value of '" + row.name + "'");
    };
    std::vector<std::string> all;
    for (std::size_t i = 0; i < values_.size(); ++i) {
        const PanelRow& row = panel()[i];
        int isAuto = 0;
        if (autos_[i] != nullptr) needs(get(autos_[i], time, &isAuto), row);
        if (isAuto != 0) {
            all.push_back("auto");
            continue;
        }
        int n = 0;
        char* text = nullptr;
        double v[3] = {};
        switch (row.parameter->type) {
            case VIRGA_SWITCH:
                needs(get(values_[i], time, &n), row);
                all.push_back(n != 0 ? "true" : "false");
                break;
            case VIRGA_WHOLE_NUMBER:
                needs(get(values_[i], time, &n), row);
                all.push_back(std::to_string(n));
                break;
            case VIRGA_TEXT:
                if (row.words.empty()) {
                    needs(get(values_[i], time, &text), row);
                    all.push_back(text != nullptr ? text : "");
                } else {
                    needs(get(values_[i], time, &n), row);
                    all.push_back(row.words[std::size_t(std::clamp(n, 0, int(row.words.size()) - 1))]);
                }
                break;
            case VIRGA_NUMBER:
            case VIRGA_NUMBER_OR_AUTO:
                needs(get(values_[i], time, v), row);
                all.push_back(numberText(v[0]));
                break;
            case VIRGA_TWO_NUMBERS:
                needs(get(values_[i], time, v, v + 1), row);
                all.push_back(numberText(v[0]) + "," + numberText(v[1]));
                break;
            case VIRGA_COLOR_OR_AUTO:
                needs(get(values_[i], time, v, v + 1, v + 2), row);
                all.push_back(numberText(v[0]) + "," + numberText(v[1]) + "," + numberText(v[2]));
                break;
        }
    }
    return all;
}

int PanelValues::choice(const char* name, OfxTime time) const
{
    int value = 0;
    host().parameter().paramGetValueAtTime(find(name), time, &value);
    return value;
}

std::string PanelValues::text(const char* name, OfxTime time) const
{
    char* value = nullptr;
    host().parameter().paramGetValueAtTime(find(name), time, &value);
    return value != nullptr ? value : "";
}

}  // namespace virga::ofxplugin
