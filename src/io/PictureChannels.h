// Which channels of an image file are the picture: its parts, layers and views by their names. No pixels here.
//
// EXR names: "R"; "diffuse.R" in the layer diffuse; "right.R" or "diffuse.right.R" in the view right, if the header's
// multiView lists it, whose first view needs no name (OpenEXR, "Multi-View OpenEXR", 2007). A part of a file with
// several has a name and perhaps a view (OpenEXR 2, "Multi-part files").
#pragma once

#include <array>
#include <string>
#include <vector>

namespace virga::io {

/// What the header of one part says of its channels.
struct PartChannels {
    std::string name, view;
    std::vector<std::string> views;     ///< multiView, the default view first
    std::vector<std::string> channels;  ///< in order
    int alpha = -1;                     ///< the channel that is alpha by the format's rules
    bool isDeep = false;
};

/// What the user asks for (`--layer`, `--view`); empty: the usual one.
struct PictureChoice {
    std::string layer, view;
};

/// The picture: indices of channels of one part. Grey: all three colours are the same one. alpha: -1 if there is none.
struct PictureChannels {
    int part = 0;
    int red = 0, green = 0, blue = 0, alpha = -1;
    bool isGrey() const { return red == green; }
    bool holds(int channel) const { return channel == red || channel == green || channel == blue || channel == alpha; }
};

/// choice.layer: its name, or that of a part whose R, G and B have no layer. Empty: those without a layer in the first
/// part, else the only ones, else the ones that programs call rgba, beauty or Combined. choice.view: empty for the
/// default view, that of the first part. Without R, G and B luminance ("Y") or the one or two channels that there are.
/// Throws Error(Input) naming `path` and listing what there is.
PictureChannels choosePicture(const std::vector<PartChannels>& parts, const PictureChoice& choice,
                              const std::string& path);

/// Names for `--layer` and `--view`, in the order of the file.
std::vector<std::string> layersIn(const std::vector<PartChannels>& parts);
std::vector<std::string> viewsIn(const std::vector<PartChannels>& parts);

/// What the file holds beside the picture: channels of its part by name, then other parts: "part depth (Z)".
std::vector<std::string> besidePicture(const std::vector<PartChannels>& parts, const PictureChannels& picture);

}  // namespace virga::io
