#include "Filter.h"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <sstream>

namespace virga::frei0r {

void Filter::set(int index, double value)
{
    if (index < 0 || index >= int(values_.size()) || index == settings) return;
    const std::lock_guard turn(turn_);
    if (values_[std::size_t(index)] == value) return;  // hosts set everything again for every frame
    values_[std::size_t(index)] = value;
    if (index != timeUnit) shot_.reset();
}

void Filter::set(int index, const char* text)
{
    if (index != settings || text == nullptr) return;
    const std::lock_guard turn(turn_);
    if (settings_ == text) return;
    settings_ = text;
    shot_.reset();
}

double Filter::number(int index) const
{
    const std::lock_guard turn(turn_);
    return index < 0 || index >= int(values_.size()) ? 0 : values_[std::size_t(index)];
}

const char* Filter::text(int index) const { return index == settings ? settings_.c_str() : ""; }

void Filter::complain(const std::string& sentence)
{
    if (sentence == said_) return;
    said_ = sentence;
    std::fprintf(stderr, "virga: %s\n", sentence.c_str());
}

/// A shot with all that is set. Each frame is lit by itself: no other is known.
virga_error Filter::prepare()
{
    virga_shot* made = nullptr;
    virga_error error = virga_shot_create(width_, height_, 25, &made);
    std::unique_ptr<virga_shot, Release> shot(made);
    if (error == VIRGA_OK && !settings_.empty()) {
        std::ifstream file(settings_);
        std::ostringstream document;
        if (!file || !(document << file.rdbuf())) {
            complain(settings_ + ": cannot be read");
            return VIRGA_ERROR_INPUT;
        }
        error = virga_shot_set_document(shot.get(), document.str().c_str());
    }
    for (std::size_t i = 0; i < values_.size() && error == VIRGA_OK; ++i) {
        const Control& control = controls()[i];
        // fps has no default in the table: the filter's own stands unless the file has one.
        const bool isLeft = values_[i] == control.start && (i != framesPerSecond || !settings_.empty());
        if (control.parameter != nullptr && !isLeft)
            error = virga_shot_set(shot.get(), control.parameter, textOf(control, values_[i]).c_str());
    }
    if (error == VIRGA_OK)
        shot_ = std::move(shot);
    else
        complain(virga_error_sentence());
    return error;
}

void Filter::update(double time, double unit, const std::uint32_t* in, std::uint32_t* out)
{
    const std::lock_guard turn(turn_);
    if (values_[timeUnit] > 0) unit = values_[timeUnit] > 0.75 ? milliseconds : seconds;

    if (shot_ || prepare() == VIRGA_OK) {
        double fps = 25;
        std::size_t count = 0;
        virga_picture plate = virga_picture_default();
        plate.samples = VIRGA_UINT8;
        plate.is_straight = 1;
        plate.color_space = "sRGB";
        virga_picture beauty = plate;
        plate.planes[0] = const_cast<std::uint32_t*>(in);  // read only
        beauty.planes[0] = out;
        virga_request request = virga_request_default();
        request.plate = &plate;
        request.beauty = &beauty;
        if (virga_shot_get_numbers(shot_.get(), "fps", &fps, 1, &count) == VIRGA_OK) {
            request.frame = std::round(time * unit * fps);
            if (virga_shot_render(shot_.get(), &request) == VIRGA_OK) return;
        }
        complain(virga_error_sentence());
    }
    if (out != in) std::memcpy(out, in, std::size_t(width_) * std::size_t(height_) * sizeof *in);
}

}  // namespace virga::frei0r
