"""From renders to samples/: denoise, reproject every frame, check the camera against the scene, encode.

    post.py --work RENDERS --out SAMPLES --passes N

Light is resampled in linear light with a smooth filter; depth is looked up, never averaged, because a depth between
a leaf and the house behind it is a place where nothing is.
"""

import argparse
import json
import os
import subprocess

import cv2
import numpy as np
import OpenImageIO as oiio

import camera

DEPTH_WIDTH, DEPTH_HEIGHT = camera.WIDTH // 2, camera.HEIGHT // 2
DEPTH_BITS = 7      # of half float's 10 bits of mantissa: depth is rounded to within 0.4 %, and compresses
SUBFRAMES = 3       # poses that are averaged over a shutter of 180 degrees


def read(path, *channels):
    """Named channels of an EXR as H x W x C float32; the layer's name in front of them is ignored."""
    image = oiio.ImageBuf(path)
    names = [name.split(".", 1)[1] if name.startswith("ViewLayer.") else name for name in image.spec().channelnames]
    return image.get_pixels(oiio.FLOAT)[..., [names.index(c) for c in channels]]


def write(path, pixels, names, compression):
    height, width, count = pixels.shape
    spec = oiio.ImageSpec(width, height, count, oiio.HALF)
    spec.channelnames = names
    spec.attribute("compression", compression)
    spec.attribute("DateTime", "2000:01:01 00:00:00")   # or OpenImageIO writes the clock, and no two runs agree
    image = oiio.ImageBuf(spec)
    image.set_pixels(oiio.ROI(), np.ascontiguousarray(pixels, np.float32))
    if not image.write(path + ".part.exr"):
        raise RuntimeError(f"{path}: {image.geterror()}")
    os.replace(path + ".part.exr", path)


# --- Denoising -------------------------------------------------------------------------------------------------------

COMBINED = ("Combined.R", "Combined.G", "Combined.B")
ALBEDO = ("Denoising Albedo.R", "Denoising Albedo.G", "Denoising Albedo.B")
NORMAL = ("Denoising Normal.X", "Denoising Normal.Y", "Denoising Normal.Z")


def _nonlocal_means(guides, subjects, variance, features, radius, k):
    """The mean over i of subjects[i], filtered with weights from guides[i]."""
    total = 0.0
    shape = variance.shape[:2]
    sums = [np.zeros_like(variance) for _ in guides]
    weights = [np.zeros(shape, np.float32) for _ in guides]

    def shifted(image, dy, dx):
        return np.roll(image, (-dy, -dx), (0, 1))

    for dy in range(-radius, radius + 1):
        for dx in range(-radius, radius + 1):
            other_variance = shifted(variance, dy, dx)
            allowed = variance + np.minimum(variance, other_variance)
            scale = 1 / (1e-5 + k * k * (variance + other_variance))
            feature = np.zeros(shape, np.float32)
            for image, tolerance in features:
                feature += ((image - shifted(image, dy, dx)) ** 2).sum(-1) / tolerance ** 2
            for i, guide in enumerate(guides):
                distance = ((guide - shifted(guide, dy, dx)) ** 2 - allowed) * scale
                weight = np.exp(-np.maximum(cv2.blur(distance.mean(-1), (5, 5)), 0) - feature)
                sums[i] += weight[..., None] * shifted(subjects[i], dy, dx)
                weights[i] += weight
    for s, w in zip(sums, weights):
        total = total + s / w[..., None]
    return total / len(guides)


def denoise(half_a, half_b, features, radius=5, k=0.55):
    """Non-local means with two half buffers (Rousselle, Knaus & Zwicker 2012): the weights of one half filter the
    other, so noise cannot vote for itself; features (albedo, normal) veto neighbours of another material.
    All float32, H x W x C; returns the filtered mean of the halves. Where there is only one render it is both halves,
    and its noise is judged by how far pixels stray from the median of their neighbours."""
    half_a, half_b = half_a.astype(np.float32), half_b.astype(np.float32)
    if np.array_equal(half_a, half_b):
        stray = half_a - cv2.medianBlur(half_a, 3)
        variance = cv2.blur(np.minimum(stray ** 2, 0.1), (9, 9))
        return _nonlocal_means((half_a,), (half_a,), variance, features, radius, k)
    # Variance of one half, from the difference of the two; pooled, because two values say little.
    variance = cv2.blur((half_a - half_b) ** 2 / 2, (9, 9))
    return _nonlocal_means((half_a, half_b), (half_b, half_a), variance, features, radius, k)


def clean(paths, with_features):
    """Mean of the passes, denoised. Where features exist, albedo is divided out first, so texture is kept."""
    colours = [read(p, *COMBINED) for p in paths]
    # Brightness that no other pass confirms is a firefly.
    if len(colours) > 1:
        ceiling = np.sort(np.stack(colours), 0)[-2] * 2.0 + 0.03
        colours = [np.minimum(c, ceiling) for c in colours]
    if not with_features:
        a, b = (np.log1p(np.mean(colours[i::2] or colours, 0)) for i in (0, 1))
        return np.expm1(denoise(a, b, [], 4))
    albedo = np.mean([read(p, *ALBEDO) for p in paths], 0)
    normal = np.mean([read(p, *NORMAL) for p in paths], 0)
    divisor = np.clip(albedo, 0, 1) + 0.03
    a, b = (np.log1p(np.mean(colours[i::2] or colours, 0) / divisor) for i in (0, 1))
    filtered = denoise(a, b, [(np.sqrt(np.clip(albedo, 0, 1)), 0.09), (normal, 0.5)])
    return np.expm1(filtered) * divisor


# --- Frames ----------------------------------------------------------------------------------------------------------

def patch_coordinates(world, shape, patch):
    """Directions -> (column, row) in the rendered patch; pixel centres are at whole numbers plus a half."""
    lon, lat = (np.degrees(a) for a in camera.longitude_latitude(world))
    height, width = shape[:2]
    return (lon - patch[0]) / (patch[1] - patch[0]) * width, (patch[3] - lat) / (patch[3] - patch[2]) * height


def frame_light(panorama, frame, oversample=2):
    """A frame's scene-linear light: cubic look-ups on a finer grid, then the mean of each pixel's samples, over
    the poses of a 180-degree shutter centred on the frame's time."""
    total = 0.0
    for k in range(SUBFRAMES):
        when = frame + ((k + 0.5) / SUBFRAMES - 0.5) * 0.5
        _, world = camera.rays(when, camera.WIDTH * oversample, camera.HEIGHT * oversample)
        column, row = patch_coordinates(world, panorama.shape, camera.field())
        fine = cv2.remap(panorama, (column - 0.5).astype(np.float32), (row - 0.5).astype(np.float32), cv2.INTER_CUBIC)
        total = total + cv2.resize(fine, (camera.WIDTH, camera.HEIGHT), interpolation=cv2.INTER_AREA)
    return np.maximum(total / SUBFRAMES, 0)


def frame_depth(distances, frame, width=camera.WIDTH, height=camera.HEIGHT):
    """Metres along -z, +inf for sky, from ray lengths by nearest look-up."""
    local, world = camera.rays(frame, width, height)
    column, row = patch_coordinates(world, distances.shape, camera.field())
    ray = distances[np.floor(row).astype(int), np.floor(column).astype(int)]
    depth = ray / np.linalg.norm(local, axis=-1)
    return np.where(ray > 4000, np.inf, depth).astype(np.float32)


def rounded(depth):
    """Depth as a half float with DEPTH_BITS of mantissa, rounded to nearest."""
    drop = 10 - DEPTH_BITS
    code = depth.astype(np.float16).view(np.uint16).astype(np.uint32)
    code = ((code + (1 << (drop - 1))) >> drop << drop).astype(np.uint16).view(np.float16).astype(np.float32)
    return np.where(np.isinf(depth), np.inf, code)


def with_car(panorama, distances, folder, frame):
    """The two panoramas with the moving car of this frame put in. Its patch was rendered with fewer samples, so it
    replaces the still street only where the car, its reflection or its shadow make a difference."""
    patch = clean([os.path.join(folder, f"light.{frame:04d}.exr")], True)
    c0, c1, r0, r1 = camera.car_patch(frame, panorama.shape[1::-1])
    d0, d1, e0, e1 = camera.car_patch(frame, distances.shape[1::-1])
    ray = read(os.path.join(folder, f"depth.{frame:04d}.exr"), "Depth.Z")[..., 0]
    still = panorama[r0:r1, c0:c1]
    assert patch.shape == still.shape and ray.shape == (e1 - e0, d1 - d0)

    solid = (np.abs(ray - distances[e0:e1, d0:d1]) > 0.05).astype(np.float32)
    solid = cv2.resize(solid, patch.shape[1::-1], interpolation=cv2.INTER_AREA)
    difference = cv2.blur(np.abs(patch - still).mean(-1), (7, 7)) / (cv2.blur(still.mean(-1), (7, 7)) + 0.02)
    share = np.clip((difference - 0.12) / 0.2, 0, 1)
    share = np.maximum(cv2.GaussianBlur(cv2.dilate(share, np.ones((5, 5))), (0, 0), 1.5),
                       np.minimum(cv2.dilate((solid > 0).astype(np.float32), np.ones((3, 3))), 1))
    border = np.minimum.outer(np.minimum(np.arange(patch.shape[0]), np.arange(patch.shape[0])[::-1]),
                              np.minimum(np.arange(patch.shape[1]), np.arange(patch.shape[1])[::-1]))
    share = (share * np.clip(border / 6.0, 0, 1))[..., None]
    panorama, distances = panorama.copy(), distances.copy()
    panorama[r0:r1, c0:c1] = (1 - share) * still + share * patch
    distances[e0:e1, d0:d1] = ray
    return panorama, distances


def display(linear):
    """Scene-linear -> display-referred with the sRGB curve (IEC 61966-2-1), clipped at 1; no tone curve."""
    x = np.clip(linear, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


# --- The track, and its proof ----------------------------------------------------------------------------------------

def write_track(path):
    with open(path + ".part", "w") as out:
        for frame in range(camera.FRAMES):
            values = (*camera.POSITION, *camera.angles(frame), camera.VFOV)
            out.write(f"{frame}\t" + "\t".join(f"{v:.6f}" for v in values) + "\n")
    os.replace(path + ".part", path)


def check_track(track, points, depth_at):
    """Project points that Blender found by casting rays through the track as written, and compare their depth with
    the depth frames. Edges and leaves may miss by a pixel; anything wrong with an axis would miss everywhere."""
    rows = np.loadtxt(track)
    errors, offsets = [], []
    for item in points:
        _, tx, ty, tz, rx, ry, rz, vfov = rows[item["frame"]]
        local = camera.world_from_camera(rx, ry, rz).T @ (np.array(item["point"]) - (tx, ty, tz))
        focal = camera.HEIGHT / 2 / np.tan(np.radians(vfov) / 2)
        column = camera.WIDTH / 2 + focal * local[0] / -local[2]
        row = camera.HEIGHT / 2 - focal * local[1] / -local[2]
        offsets.append(max(abs(column % 1 - 0.5), abs(row % 1 - 0.5)))
        measured = depth_at(item["frame"])[min(int(row), camera.HEIGHT - 1), min(int(column), camera.WIDTH - 1)]
        errors.append(abs(measured + local[2]) / -local[2])
    errors = np.array(errors)
    close = float((errors < 0.02).mean())
    print(f"track: {len(errors)} points; off pixel centres by at most {max(offsets):.4f} px; depth error median "
          f"{np.median(errors) * 100:.3f} %, within 2 % for {close * 100:.1f} %")
    if close < 0.93 or max(offsets) > 0.02:
        raise RuntimeError("the camera track and the depth disagree")


# --- Encoding --------------------------------------------------------------------------------------------------------

AMBIENCE = ("anoisesrc=d=4:c=brown:r=48000:a=0.5:seed=7,lowpass=f=420,highpass=f=45,tremolo=f=0.35:d=0.35,"
            "volume=0.16[low];anoisesrc=d=4:c=pink:r=48000:a=0.4:seed=9,bandpass=f=1500:w=900,tremolo=f=0.6:d=0.5,"
            "volume=0.03[air];[low][air]amix=inputs=2:normalize=0,aformat=channel_layouts=stereo")


def encoder(path):
    size = f"{camera.WIDTH}x{camera.HEIGHT}"
    return subprocess.Popen([
        "ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb48le", "-s", size, "-r", str(camera.FPS),
        "-i", "-", "-f", "lavfi", "-i", AMBIENCE,
        "-vf", "scale=out_color_matrix=bt709:out_range=tv:flags=lanczos+accurate_rnd+full_chroma_int:sws_dither=ed,"
               "format=yuv420p",
        "-c:v", "libx264", "-preset", "slow", "-crf", "17", "-threads", "2", "-bf", "2",
        "-color_primaries", "bt709", "-color_trc", "bt709", "-colorspace", "bt709", "-color_range", "tv",
        "-c:a", "aac", "-b:a", "64k", "-t", str(camera.FRAMES / camera.FPS), "-fflags", "+bitexact",
        "-movflags", "+faststart", path], stdin=subprocess.PIPE)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--work", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--passes", type=int, default=2)
    parser.add_argument("--env-passes", type=int, default=1)
    parser.add_argument("--no-car", dest="car", action="store_false")
    parser.add_argument("--preview", help="write a few frames as PNG into this folder")
    args = parser.parse_args()
    work = lambda name: os.path.join(args.work, name)   # noqa: E731
    out = lambda name: os.path.join(args.out, name)     # noqa: E731

    panorama = clean([work(f"plate_{i + 1}.exr") for i in range(args.passes)], True).astype(np.float32)
    distances = read(work("depth.exr"), "Depth.Z")[..., 0]

    write_track(out("street.chan"))
    with open(work("points.json")) as source:
        check_track(out("street.chan"), json.load(source), lambda frame: frame_depth(distances, frame))

    environment = clean([work(f"env_{i + 1}.exr") for i in range(args.env_passes)], False)
    write(out("street_env.exr"), environment, ("R", "G", "B"), "dwaa:25")

    movie = encoder(out("street.part.mp4"))
    for frame in range(camera.FRAMES):
        light, ray = with_car(panorama, distances, work("car"), frame) if args.car else (panorama, distances)
        code = display(frame_light(light, frame))
        movie.stdin.write((code * 65535 + 0.5).astype("<u2").tobytes())
        depth = rounded(frame_depth(ray, frame, DEPTH_WIDTH, DEPTH_HEIGHT))
        write(out(f"street_depth.{frame:04d}.exr"), depth[..., None], ("Z",), "zip:9")
        if args.preview and frame in (0, 48, 95):
            cv2.imwrite(os.path.join(args.preview, f"frame_{frame:04d}.png"),
                        (code[..., ::-1] * 255 + 0.5).astype(np.uint8))
    movie.stdin.close()
    if movie.wait():
        raise RuntimeError("ffmpeg failed")
    os.replace(out("street.part.mp4"), out("street.mp4"))


if __name__ == "__main__":
    main()
