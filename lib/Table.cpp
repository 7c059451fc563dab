#include "Table.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <variant>

#include "core/Error.h"

namespace virga::lib {
namespace {

virga_type typeOf(const shot::Parameter& p)
{
    // In the order of Parameter::member's alternatives.
    constexpr virga_type types[] = {VIRGA_NUMBER, VIRGA_NUMBER_OR_AUTO, VIRGA_WHOLE_NUMBER, VIRGA_SWITCH,
                                    VIRGA_TEXT,   VIRGA_TWO_NUMBERS,    VIRGA_COLOR_OR_AUTO};
    static_assert(std::size(types) == std::variant_size_v<decltype(p.member)>);
    return types[p.member.index()];
}

struct Table {
    std::vector<std::string> defaults;
    std::vector<virga_parameter> rows;

    Table()
    {
        const shot::Settings settings;
        const auto parameters = shot::parameters();
        for (const shot::Parameter& p : parameters) defaults.push_back(shot::toText(settings, p));
        for (std::size_t i = 0; i < parameters.size(); ++i) {
            const shot::Parameter& p = parameters[i];
            virga_parameter row{p.name,    p.group, p.unit, typeOf(p), p.least, p.most, defaults[i].c_str(),
                                p.choices, p.help,  {},     0};
            if (row.type != VIRGA_TEXT) {
                const std::vector<double> numbers = numbersOf(settings, p);
                std::copy(numbers.begin(), numbers.end(), row.default_numbers);
                row.default_count = numbers.size();
            }
            rows.push_back(row);
        }
    }
};

}  // namespace

std::span<const virga_parameter> table()
{
    static const Table made;
    return made.rows;
}

std::vector<double> numbersOf(const shot::Settings& settings, const shot::Parameter& p)
{
    if (typeOf(p) == VIRGA_TEXT) throw Error(ErrorCode::InvalidArgument, "{}: is a text, which has no numbers", p.name);
    const nlohmann::json value = shot::toJson(settings, p);
    if (value.is_string()) return {};  // auto
    if (value.is_boolean()) return {value.get<bool>() ? 1.0 : 0.0};
    if (value.is_array()) return value.get<std::vector<double>>();
    return {value.get<double>()};
}

void setFromNumbers(shot::Settings& settings, const shot::Parameter& p, std::span<const double> numbers)
{
    const virga_type type = typeOf(p);
    const std::size_t wanted = type == VIRGA_TWO_NUMBERS ? 2 : type == VIRGA_COLOR_OR_AUTO ? 3 : 1;
    const bool mayBeAuto = type == VIRGA_NUMBER_OR_AUTO || type == VIRGA_COLOR_OR_AUTO;
    if (type == VIRGA_TEXT)
        throw Error(ErrorCode::InvalidArgument, "{}: is a text and cannot be set from numbers", p.name);
    if (numbers.size() != wanted && !(numbers.empty() && mayBeAuto))
        throw Error(ErrorCode::InvalidArgument, "{}: {} numbers; must be {}{}", p.name, numbers.size(), wanted,
                    mayBeAuto ? ", or none for auto" : "");
    if (numbers.empty()) return shot::setFromText(settings, p, "auto");
    if (type == VIRGA_SWITCH) {
        if (numbers[0] != 0 && numbers[0] != 1)
            throw Error(ErrorCode::InvalidArgument, "{}: {}; must be 0 or 1", p.name, numbers[0]);
        return shot::setFromText(settings, p, numbers[0] != 0 ? "true" : "false");
    }
    if (numbers.size() == 1) return shot::setFromJson(settings, p, numbers[0]);
    shot::setFromJson(settings, p, std::vector<double>(numbers.begin(), numbers.end()));
}

}  // namespace virga::lib
