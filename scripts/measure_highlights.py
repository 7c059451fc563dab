"""What `virga env` puts back of light that 8 bits cut off: the table in docs/env.md.

    VIRGA=build/test/bin/virga VIRGA_FOOTAGE_DIR=/footage python3 scripts/measure_highlights.py

Each panorama of high dynamic range in VIRGA_FOOTAGE_DIR/hdri is exposed as a photograph is (a geometric mean of 0.18), cut
off at white, written as 8-bit sRGB, and repaired. What drops return (virga model radiance) is compared with what they
return under the whole panorama, over directions spread evenly.
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import OpenImageIO as oiio

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def read(path):
    pixels = oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT)
    return pixels[..., :3].astype(np.float64)


def write(path, pixels, kind):
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, kind)
    out = oiio.ImageOutput.create(str(path))
    assert out and out.open(str(path), spec), oiio.geterror()
    assert out.write_image(np.ascontiguousarray(pixels, np.float32)), out.geterror()
    out.close()


def evenDirections(count):
    """A spiral from pole to pole (Vogel 1979)."""
    y = 1 - 2 * (np.arange(count) + 0.5) / count
    angle = np.arange(count) * 2.399963229728653
    r = np.sqrt(1 - y * y)
    return np.stack([r * np.cos(angle), y, r * np.sin(angle)], -1)


def measure(virga, hdri, directions=500):
    """clipped, estimated, given: (mean, root mean square error) of the luminance that drops return, over the true mean."""
    pixels = read(hdri)
    weight = np.sin((np.arange(pixels.shape[0]) + 0.5) / pixels.shape[0] * np.pi)[:, None]
    luminance = pixels @ LUMINANCE
    gain = 0.18 / np.exp((np.log(luminance + 1e-4) * weight).sum() / (weight.sum() * pixels.shape[1]))
    pixels, luminance = pixels * gain, luminance * gain
    beyond = np.where(luminance > 1, luminance, 0) * weight
    light = float((beyond * luminance).sum() / beyond.sum())  # what a user would say of the light: its light's mean
    cut = np.minimum(pixels, 1)
    coded = np.where(cut <= 0.0031308, 12.92 * cut, 1.055 * cut ** (1 / 2.4) - 0.055)

    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        write(folder / "true.exr", pixels, "float")
        write(folder / "clipped.exr", cut, "float")
        write(folder / "photo.png", coded, "uint8")
        (folder / "directions.json").write_text(json.dumps(evenDirections(directions).tolist()))

        def run(*arguments):
            done = subprocess.run([virga, *arguments, "--quiet", "--json"], cwd=folder, check=True, capture_output=True)
            return json.loads(done.stdout)

        estimate = run("env", "photo.png", "-o", "estimated.exr", "--preview", "none")
        run("env", "photo.png", "-o", "given.exr", "--preview", "none", "--light-radiance", str(light))
        returned = {name: np.array(run("model", "radiance", "--env", name + ".exr", "--directions",
                                       "directions.json")["radiance"]) @ LUMINANCE
                    for name in ("true", "clipped", "estimated", "given")}
    mean = returned["true"].mean()
    result = {name: (returned[name].mean() / mean, np.sqrt(((returned[name] - returned["true"]) ** 2).mean()) / mean)
              for name in ("clipped", "estimated", "given")}
    result["share"] = estimate["repaired"]["clipped_share"]
    return result


def main():
    virga = str(pathlib.Path(os.environ["VIRGA"]).resolve())
    folder = pathlib.Path(os.environ["VIRGA_FOOTAGE_DIR"]) / "hdri"
    print("| panorama | cut off | mean: as it is | estimated | given | RMS: as it is | estimated | given |")
    print("|---|---|---|---|---|---|---|---|")
    for hdri in sorted(folder.glob("*.exr")):
        if "original" in hdri.name:
            continue
        m = measure(virga, hdri)
        print(f"| {hdri.stem} | {100 * m['share']:.0f} % | " +
              " | ".join(f"{m[name][k]:.2f}" for k in (0, 1) for name in ("clipped", "estimated", "given")) + " |")


if __name__ == "__main__":
    sys.exit(main())
