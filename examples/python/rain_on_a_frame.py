#!/usr/bin/env python3
"""A notebook's first cell, as a script: a picture in, rain on it, a picture out.

    VIRGA_LIBRARY=build/release/lib/libvirga.so examples/python/rain_on_a_frame.py street.png rainy.png 40

Debian: python3-numpy, python3-openimageio.
"""
import sys

import numpy as np
import OpenImageIO as oiio

import virga

source, target, rate = sys.argv[1], sys.argv[2], float(sys.argv[3]) if len(sys.argv) > 3 else 25.0

picture = oiio.ImageBuf(source)
if picture.has_error:
    sys.exit(f"{source}: {picture.geterror()}")
plate = np.ascontiguousarray(picture.get_pixels(oiio.UINT8)[:, :, :3])

shot = virga.Shot(width=plate.shape[1], height=plate.shape[0], fps=24, rate=rate, wind=(2, 0))
rainy = shot.render(1, plate)

out = oiio.ImageBuf(oiio.ImageSpec(rainy.shape[1], rainy.shape[0], 3, oiio.UINT8))
out.set_pixels(oiio.ROI(), rainy)
if not out.write(target):
    sys.exit(f"{target}: {out.geterror()}")
changed = np.mean(np.any(rainy != plate, axis=2))
print(f"{target}: {rate:g} mm/h on {changed:.0%} of the pixels, drawn by the {shot.device}")
