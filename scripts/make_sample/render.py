"""Blender's entry: blender --background --factory-startup --python render.py -- WHAT OUT [options]

WHAT is `plate` (the patch of the sphere that the move sees, light), `depth` (the same patch, ray length, one sharp
ray a pixel), `env` (the whole sphere), `car` (a folder: the patches that the moving car changes), or `points` (3-D
points found by casting rays, for the check in post.py).
"""

import argparse
import json
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy  # noqa: E402
import numpy as np  # noqa: E402

import camera  # noqa: E402
import scene as street_scene  # noqa: E402
from geometry import to_blender  # noqa: E402


def settings(scene, samples, seed):
    scene.render.engine = "CYCLES"
    c = scene.cycles
    c.device = "CPU"
    c.samples, c.seed = samples, seed
    c.use_adaptive_sampling = False
    c.use_denoising = False
    c.max_bounces, c.diffuse_bounces, c.glossy_bounces = 6, 3, 3
    c.transmission_bounces, c.transparent_max_bounces = 2, 6
    c.sample_clamp_indirect = 2.5
    c.blur_glossy = 0.5
    c.caustics_reflective = False
    c.pixel_filter_type = "BLACKMAN_HARRIS"
    c.filter_width = 1.5
    scene.view_settings.view_transform = "Raw"
    scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    scene.render.image_settings.color_depth = "32"
    scene.render.image_settings.exr_codec = "ZIP"
    scene.render.use_persistent_data = False
    scene.world.cycles.sampling_method = "MANUAL"
    scene.world.cycles.sample_map_resolution = 1024
    layer = scene.view_layers[0]
    layer.use_pass_combined = True
    layer.use_pass_z = True
    # A shop window ends the depth: the rain is in the street, not in the shop.
    layer.pass_alpha_threshold = 0.0


def cast_points(scene, count=400):
    """World points that random rays from the camera hit, as our (x, y, z)."""
    rng = np.random.default_rng(5)
    graph = bpy.context.evaluated_depsgraph_get()
    found = []
    while len(found) < count:
        frame = int(rng.integers(0, camera.FRAMES))
        i, j = int(rng.integers(0, camera.WIDTH)), int(rng.integers(0, camera.HEIGHT))
        _, world = camera.rays(frame)
        d = world[j, i] / np.linalg.norm(world[j, i])
        hit, where, _, _, _, _ = scene.ray_cast(graph, to_blender(camera.POSITION), to_blender(d))
        if hit:
            found.append({"frame": frame, "point": [where[0], where[2], -where[1]]})
    return found


def sharp(scene):
    """One ray through the centre of each pixel: for depth."""
    scene.cycles.samples = 1
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.filter_width = 0.01
    scene.cycles.max_bounces = 0


def render_patch(scene, lens, patch, size, path):
    street_scene.aim(lens, *patch)
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)


def render_car(scene, lens, folder, samples, scale, depth_scale, frames):
    """The moving car's patch of each frame, light and then depth. Whole files only: each is written to a temporary
    name first, and those that exist are not rendered again."""
    os.makedirs(folder, exist_ok=True)
    things = street_scene.moving_car()
    left, right, bottom, top = camera.field()
    # Only the car moves: keep everything else on the device between renders.
    scene.render.use_persistent_data = True
    scene.view_layers[0].cycles.denoising_store_passes = True

    def job(frame, kind, pixels_per_degree):
        path = os.path.join(folder, f"{kind}.{frame:04d}.exr")
        if os.path.exists(path):
            return
        width, height = camera.panorama_size(pixels_per_degree, camera.field())
        c0, c1, r0, r1 = camera.car_patch(frame, (width, height))
        lon, lat = (right - left) / width, (top - bottom) / height
        patch = (left + c0 * lon, left + c1 * lon, top - r1 * lat, top - r0 * lat)
        street_scene.drive(things, camera.car_front(frame), camera.CAR_LENGTH)
        render_patch(scene, lens, patch, (c1 - c0, r1 - r0), os.path.join(folder, "part.exr"))
        os.replace(os.path.join(folder, "part.exr"), path)

    for frame in frames:
        scene.cycles.seed = 1000 + frame
        job(frame, "light", scale)
    sharp(scene)
    for frame in frames:
        job(frame, "depth", depth_scale)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("what", choices=("plate", "depth", "env", "points", "car"))
    parser.add_argument("out")
    parser.add_argument("--samples", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scale", type=float, default=camera.LIGHT_SCALE, help="pixels per degree")
    parser.add_argument("--frames", type=int, default=camera.FRAMES, help="car: stop before this frame")
    args = parser.parse_args(sys.argv[sys.argv.index("--") + 1:])

    scene = street_scene.build()
    if args.what == "points":
        with open(args.out, "w") as out:
            json.dump(cast_points(scene), out)
        return
    settings(scene, args.samples, args.seed)
    patch = (-180.0, 180.0, -90.0, 90.0) if args.what == "env" else camera.field()
    lens = street_scene.panoramic_camera(scene, camera.POSITION, *patch)
    path = os.path.abspath(args.out)
    if args.what == "car":
        render_car(scene, lens, path, args.samples, camera.LIGHT_SCALE, camera.DEPTH_SCALE, range(args.frames))
        return
    scale = camera.DEPTH_SCALE if args.what == "depth" else args.scale
    if args.what == "depth":
        sharp(scene)
    if args.what == "plate":
        scene.view_layers[0].cycles.denoising_store_passes = True
    render_patch(scene, lens, patch, camera.panorama_size(scale, patch), path)


main()
