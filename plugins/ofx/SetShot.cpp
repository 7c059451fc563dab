#include "SetShot.h"

#include "Host.h"
#include "Panel.h"

namespace virga::ofxplugin {

void needs(virga_error code)
{
    if (code != VIRGA_OK) throw Failure(ofx::statFailed, virga_error_sentence());
}

SetShot::SetShot(int width, int height, double fps) : width_(width), height_(height), fps_(fps)
{
    virga_shot* shot = nullptr;
    needs(virga_shot_create(width, height, fps, &shot));
    shot_.reset(shot);
}

void SetShot::set(const std::vector<std::string>& texts)
{
    texts_.resize(texts.size());
    for (std::size_t i = 0; i < texts.size(); ++i) {
        // A row that was never set has the table's default.
        if (texts_[i] == texts[i]) continue;
        needs(virga_shot_set(get(), panel()[i].parameter->name, texts[i].c_str()));
        texts_[i] = texts[i];
    }
}

}  // namespace virga::ofxplugin
