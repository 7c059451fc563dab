#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "Command.h"
#include "Interrupt.h"
#include "ProgressBar.h"
#include "core/Error.h"
#include "core/Log.h"
#include "environment/PanoramaLayout.h"
#include "shot/EnvJob.h"

namespace virga::cli {
namespace {

struct EnvArguments {
    CommonFlags common;
    shot::EnvJobOptions job;
    std::string mode = "auto";
};

const char* const examples = R"(Examples:
  virga env street_hdri.exr -o env.exr --yaw 90
  virga env phone_panorama.jpg -o env.exr --light-radiance 20000
  virga env pan.mp4 -o env.exr --track pan.chan
  virga env locked.mp4 -o env.exr --fov 48 --pitch -10
  virga env drive.mp4 -o env.####.exr --every 5
docs/env.md says what becomes of each, and what the report holds)";

void require(bool holds, const char* flag, double value, const char* allowed)
{
    if (!holds) throw Error(ErrorCode::InvalidArgument, "{} '{:g}': must be {}", flag, value, allowed);
}

int env(const EnvArguments& arguments)
{
    shot::EnvJobOptions job = arguments.job;
    const std::optional<shot::EnvMode> mode = shot::envModeNamed(arguments.mode);
    if (!mode)
        throw Error(ErrorCode::InvalidArgument, "--mode '{}': must be auto, panorama, static, pan or loom",
                    arguments.mode);
    job.mode = *mode;
    if (!environment::layoutNamed(job.layout, 1, 1))
        throw Error(ErrorCode::InvalidArgument, "--layout '{}': must be {}", job.layout, environment::layoutNames);
    if (job.fov_deg)
        require(*job.fov_deg > 0 && *job.fov_deg <= 170, "--fov", *job.fov_deg, "over 0 and at most 170 deg");
    require(job.yaw_deg >= -360 && job.yaw_deg <= 360, "--yaw", job.yaw_deg, "-360 to 360 deg");
    require(job.pitch_deg >= -90 && job.pitch_deg <= 90, "--pitch", job.pitch_deg, "-90 to 90 deg");
    require(job.roll_deg >= -180 && job.roll_deg <= 180, "--roll", job.roll_deg, "-180 to 180 deg");
    if (job.lightRadiance)
        require(*job.lightRadiance > 0 && *job.lightRadiance <= 1e9, "--light-radiance", *job.lightRadiance,
                "over 0 and at most 1e9");
    if (job.sky) require(*job.sky >= 0 && *job.sky <= 1e9, "--sky", *job.sky, "0 to 1e9");
    require(job.width >= 64 && job.width <= 16384, "--width", job.width, "64 to 16384 pixels");
    require(job.order >= 0 && job.order <= 128, "--order", job.order, "0 to 128");
    if (job.every) require(*job.every >= 1 && *job.every <= 100000, "--every", *job.every, "1 to 100000 frames");

    noteInterrupts();
    nlohmann::json report;
    {
        ProgressBar bar(arguments.common.quiet);
        report = shot::runEnvJob(job, [&](const shot::Progress& progress) {
            bar.show(progress);
            return isInterrupted() ? shot::Verdict::Stop : shot::Verdict::Continue;
        });
    }
    if (arguments.common.json)
        std::printf("%s\n", report.dump(2, ' ', false, nlohmann::json::error_handler_t::replace).c_str());
    log::info("'{}': {} x {}, {}; drops keep order {} and {} lights of it", job.output,
              report["output_width"].get<int>(), report["output_height"].get<int>(),
              report.contains("fov_deg")
                  ? fmt::format("{} frame{} of {:.1f} degrees", report["frames"].get<int>(),
                                report["frames"].get<int>() == 1 ? "" : "s", report["fov_deg"].get<double>())
                  : report["taken_for"].get<std::string>(),
              report["auto_order"].get<int>(), report["lights"].size());
    if (report.value("stopped", false)) {
        log::warning("stopped on request after {} panoramas; they are whole", report["frames"].get<int>());
        return exitCode(ErrorCode::Interrupted);
    }
    return 0;
}

}  // namespace

Runner addEnvCommand(CLI::App& app, CLI::App*& command)
{
    command = app.add_subcommand("env", "a panorama for --env, from a panorama or from footage");
    command->footer(examples);
    const auto arguments = std::make_shared<EnvArguments>();
    EnvArguments& a = *arguments;
    shot::EnvJobOptions& job = a.job;
    command
        ->add_option("INPUT", job.input, "a panorama, or footage: a movie or a pattern (shot.%04d.exr, shot.####.exr)")
        ->required();
    const char* group = "In and out";
    command->add_option("-o,--output", job.output, "the panorama; a pattern for one every few frames (pano.####.exr)")
        ->required()
        ->type_name("EXR")
        ->group(group);
    command->add_flag("--half", job.half, "write 16-bit half float (default 32-bit float)")->group(group);
    command
        ->add_option("--preview", job.preview,
                     "picture of it and of what drops make of it; none: no picture (default "
                     "OUT_preview.png)")
        ->type_name("PNG")
        ->group(group);
    command
        ->add_option("--colorspace", job.colorspace,
                     "of the input, by name (default by metadata, else a guess; virga info --colorspaces)")
        ->type_name("NAME")
        ->group(group);
    addOcioFlag(*command, job.ocio, group);
    command->add_option("--order", job.order, "of the harmonics' coefficients in the report (default 3; 0 to 128)")
        ->type_name("N")
        ->group(group);
    group = "Direction";
    command->add_option("--yaw", job.yaw_deg, "what is ahead goes so far to the right (default 0; -360 to 360)")
        ->type_name("deg")
        ->group(group);
    command->add_option("--pitch", job.pitch_deg, "and so far up; of footage: the camera's tilt (default 0; -90 to 90)")
        ->type_name("deg")
        ->group(group);
    command->add_option("--roll", job.roll_deg, "and is turned clockwise (default 0; -180 to 180)")
        ->type_name("deg")
        ->group(group);
    group = "Light";
    command
        ->add_option("--light-radiance", job.lightRadiance,
                     "of lights that are cut off at white, in linear units of the input; auto: estimated")
        ->type_name("L")
        ->group(group);
    command->add_option("--sky", job.sky, "radiance of the sky that footage does not show; auto: from the ground")
        ->type_name("L")
        ->group(group);
    group = "Panorama";
    command->add_option("--layout", job.layout, std::string(environment::layoutNames) + " (default auto)")
        ->type_name("NAME")
        ->group(group);
    group = "Footage";
    command->add_option("--mode", a.mode, "auto, panorama, static, pan or loom (default auto)")
        ->type_name("NAME")
        ->group(group);
    command
        ->add_option("--frames", job.frames, "which frames: 1-100, 1-10x2, several separated by commas (default all)")
        ->type_name("RANGE")
        ->group(group);
    command
        ->add_option("--fov", job.fov_deg, "horizontal field of view; auto: estimated where the camera turns, else 60")
        ->type_name("deg")
        ->group(group);
    command->add_option("--every", job.every, "a camera that travels: a panorama every N frames (default 5)")
        ->type_name("N")
        ->group(group);
    command->add_option("--width", job.width, "of panoramas from footage (default 2048; 64 to 16384)")
        ->type_name("px")
        ->group(group);
    command->add_option("--track", job.track, "write the camera's rotations, for 'virga rain --camera'")
        ->type_name("CHAN")
        ->group(group);
    addCommonFlags(*command, a.common);
    return [arguments] { return runCommand(arguments->common, [&](const CommonFlags&) { return env(*arguments); }); };
}

}  // namespace virga::cli
