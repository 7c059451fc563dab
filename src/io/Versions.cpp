#include "io/Versions.h"

#include <OpenColorIO/OpenColorIO.h>
#include <OpenImageIO/imageio.h>
extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

namespace virga::io {

std::map<std::string, std::string> libraryVersions()
{
    const auto dotted = [](unsigned version) {
        return std::to_string(version >> 16) + "." + std::to_string((version >> 8) & 0xff) + "." +
               std::to_string(version & 0xff);
    };
    return {{"OpenImageIO", OIIO_NAMESPACE::get_string_attribute("version")},
            {"OpenColorIO", OCIO_NAMESPACE::GetVersion()},
            {"libavcodec", dotted(avcodec_version())},
            {"libavformat", dotted(avformat_version())}};
}

}  // namespace virga::io
