#include "io/Deinterlacer.h"

extern "C" {
#include <libavfilter/avfilter.h>
#include <libavfilter/buffersink.h>
#include <libavfilter/buffersrc.h>
#include <libavutil/frame.h>
}

#include <memory>

#include "core/Error.h"

namespace virga::io {

using namespace libav;

namespace {

struct FreeGraph {
    void operator()(AVFilterGraph* graph) const noexcept { avfilter_graph_free(&graph); }
};

/// buffer -> bwdif -> buffersink.
struct Graph {
    std::unique_ptr<AVFilterGraph, FreeGraph> graph;
    AVFilterContext *in = nullptr, *out = nullptr;
    int result = 0;  // < 0: why there is none

    Graph(int pixelFormat, int width, int height, bool topFirst) : graph(avfilter_graph_alloc())
    {
        const std::string source = fmt::format("video_size={}x{}:pix_fmt={}:time_base=1/1", width, height, pixelFormat);
        const std::string settings = fmt::format("mode=send_frame:parity={}:deint=all", topFirst ? "tff" : "bff");
        AVFilterContext* filter = nullptr;
        const auto add = [&](AVFilterContext** context, const char* name, const std::string& arguments) {
            if (result >= 0)
                result = avfilter_graph_create_filter(context, avfilter_get_by_name(name), name, arguments.c_str(),
                                                      nullptr, graph.get());
        };
        add(&in, "buffer", source);
        add(&filter, "bwdif", settings);
        add(&out, "buffersink", "");
        if (result >= 0) result = avfilter_link(in, 0, filter, 0);
        if (result >= 0) result = avfilter_link(filter, 0, out, 0);
        // The order of the two would be free, were it not that a conversion that is put between must not be.
        avfilter_graph_set_auto_convert(graph.get(), unsigned(AVFILTER_AUTO_CONVERT_NONE));
        if (result >= 0) result = avfilter_graph_config(graph.get(), nullptr);
    }
};

}  // namespace

Deinterlacer::Deinterlacer(std::string name, int pixelFormat, int width, int height, Scan scan)
    : name_(std::move(name)), pixelFormat_(pixelFormat), width_(width), height_(height), scan_(scan)
{
    const Graph graph(pixelFormat_, width_, height_, scan_ == Scan::TopFirst);
    if (graph.result < 0)
        throw Error(ErrorCode::Input,
                    "{}: --deinterlace: pictures of {}x{} in {} cannot be deinterlaced ({}); planar formats of 3x4 and "
                    "more can",
                    name_, width_, height_, pixelFormatName(pixelFormat_), errorText(graph.result));
}

Frame Deinterlacer::picture(const AVFrame* before, const AVFrame& frame, const AVFrame* after) const
{
    Graph graph(pixelFormat_, width_, height_, scan_ == Scan::TopFirst);
    int result = graph.result, time = 0;
    const auto send = [&](const AVFrame* picture) {
        if (picture == nullptr || result < 0) return;
        const Frame copy(av_frame_clone(picture));
        if (!copy) throw std::bad_alloc();
        copy->pts = time++;
        copy->interlaced_frame = 1;
        result = av_buffersrc_add_frame(graph.in, copy.get());
    };
    send(before);
    send(&frame);
    send(after);
    if (result >= 0) result = av_buffersrc_add_frame(graph.in, nullptr);
    Frame made = makeFrame();
    for (int wanted = before != nullptr ? 1 : 0; result >= 0 && wanted >= 0; --wanted) {
        av_frame_unref(made.get());
        result = av_buffersink_get_frame(graph.out, made.get());
    }
    if (result < 0)
        throw Error(ErrorCode::Internal, "{}: a picture could not be deinterlaced ({})", name_, errorText(result));
    return made;
}

}  // namespace virga::io
