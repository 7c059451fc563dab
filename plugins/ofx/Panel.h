// The parameter table as the controls of an effect, and the controls back as the texts of virga_shot_set.
//
// A control is named as its row with '_' for '-' ("drop_size"), which hosts save projects by. Rows that may be "auto"
// have a switch NAME_auto beside the value. Words to choose from are choices, files are file paths, the group "file" is
// left out: the host reads and writes. What stands in "controls of the plug-in's own" is no row of the table.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "abi/Ofx.h"
#include "virga/virga.h"

namespace virga::ofxplugin {

/// One row of the table that has controls.
struct PanelRow {
    const virga_parameter* parameter;
    std::string name;                ///< of the control
    std::string autoName;            ///< of the switch; empty: it has none
    std::vector<std::string> words;  ///< to choose from, if any
    bool isFile = false;
    double start[3] = {};                      ///< what the control stands at
    double displayLeast = 0, displayMost = 0;  ///< ends of the slider, within least and most
};

/// Made once, in the table's order.
std::span<const PanelRow> panel();

namespace control {
inline constexpr const char *output = "output", *frame = "frame", *pixels = "pixels", *colourSpace = "colour_space";
enum Output { beauty, rain, splash, fog, gradedPlate };
enum Frame { ofSource, ofProject };
enum Pixels { asTold, linear, video, named };
}  // namespace control

/// Defines all controls, in groups.
void definePanel(OfxParamSetHandle set);

/// What stands on an instance's panel.
class PanelValues {
public:
    /// Looks the controls up. Throws Failure if the host does not have one that was defined.
    explicit PanelValues(OfxParamSetHandle set);

    /// One text a row, in panel()'s order, as virga_shot_set takes it.
    std::vector<std::string> texts(OfxTime time) const;
    int choice(const char* name, OfxTime time) const;        ///< of control::output, frame, pixels
    std::string text(const char* name, OfxTime time) const;  ///< of control::colourSpace

private:
    OfxParamHandle find(const char* name) const;
    OfxParamSetHandle set_;
    std::vector<OfxParamHandle> values_, autos_;  // of panel(); null where there is no switch
};

}  // namespace virga::ofxplugin
