"""Rain on numpy arrays: libvirga through ctypes. One file, to be copied beside a notebook; docs/library.md is the tour.

    import numpy as np, virga
    shot = virga.Shot(width=1280, height=720, fps=24)
    shot["rate"] = 40                                  # the parameters of docs/parameters.md
    beauty = shot.render(1001, plate)                  # height x width x 3 or 4: float (scene-linear) or uint8 (sRGB)
    beauty, layers = shot.render(1001, plate, layers=("rain", "fog"))
"""
import ctypes
import os
from ctypes import POINTER, Structure, byref, c_char_p, c_double, c_int, c_int64, c_size_t, c_ssize_t, c_uint64, c_void_p

import numpy as np

LIBRARY = os.environ.get("VIRGA_LIBRARY", "libvirga.so.0.1")
RGBA, RGB, GREY = 0, 1, 3
FLOAT, HALF, UINT8, UINT16 = 0, 1, 2, 3
SAMPLES = {"float32": FLOAT, "float16": HALF, "uint8": UINT8, "uint16": UINT16}
LAYERS = ("rain", "splash", "fog", "graded_plate")
CANCELLED = 130


class Window(Structure):
    _fields_ = [(name, c_int) for name in ("x", "y", "width", "height")]


class Picture(Structure):
    """virga_picture, field by field."""
    _fields_ = [("struct_size", c_size_t), ("layout", c_int), ("samples", c_int), ("significant_bits", c_int),
                ("window", Window), ("planes", c_void_p * 4), ("row_stride", c_ssize_t * 4),
                ("pixel_stride", c_ssize_t), ("color_space", c_char_p), ("is_straight", c_int), ("matrix", c_int),
                ("is_full_range", c_int), ("siting", c_int)]


Progress = ctypes.CFUNCTYPE(c_int, c_void_p, c_double)


class Request(Structure):
    """virga_request, field by field."""
    _fields_ = [("struct_size", c_size_t), ("frame", c_double), ("scale", c_double), ("region", Window),
                ("plate", POINTER(Picture)), ("depth", POINTER(Picture)), ("beauty", POINTER(Picture)),
                ("rain", POINTER(Picture)), ("splash", POINTER(Picture)), ("fog", POINTER(Picture)),
                ("graded_plate", POINTER(Picture)), ("progress", Progress), ("user", c_void_p), ("priority", c_int),
                ("plate_content", c_uint64)]


class Parameter(Structure):
    """virga_parameter, field by field."""
    _fields_ = [("name", c_char_p), ("group", c_char_p), ("unit", c_char_p), ("type", c_int), ("least", c_double),
                ("most", c_double), ("default_text", c_char_p), ("choices", c_char_p), ("help", c_char_p),
                ("default_numbers", c_double * 3), ("default_count", c_size_t)]


class Error(Exception):
    """What the library says, as a sentence; `code` is virga_error's."""

    def __init__(self, code, sentence):
        super().__init__(sentence)
        self.code = code


def _load():
    lib = ctypes.CDLL(LIBRARY)
    shot, picture, request = c_void_p, POINTER(Picture), POINTER(Request)
    signatures = {
        "virga_error_sentence": (c_char_p, []),
        "virga_version": (c_char_p, []),
        "virga_parameter_count": (c_size_t, []),
        "virga_parameter_at": (POINTER(Parameter), [c_size_t]),
        "virga_shot_create": (c_int, [c_int, c_int, c_double, POINTER(c_void_p)]),
        "virga_shot_release": (None, [shot]),
        "virga_shot_set": (c_int, [shot, c_char_p, c_char_p]),
        "virga_shot_set_document": (c_int, [shot, c_char_p]),
        "virga_shot_get": (c_int, [shot, c_char_p, POINTER(c_char_p)]),
        "virga_shot_set_device": (c_int, [shot, c_char_p]),
        "virga_shot_device": (c_int, [shot, POINTER(c_char_p)]),
        "virga_shot_add_plate_sample": (c_int, [shot, c_int64, picture]),
        "virga_shot_samples_wanted": (c_int, [shot, c_int64, c_int64, POINTER(c_int64), c_size_t, POINTER(c_size_t)]),
        "virga_shot_set_environment": (c_int, [shot, picture]),
        "virga_shot_frame_size": (c_int, [shot, c_double, POINTER(c_int), POINTER(c_int)]),
        "virga_shot_render": (c_int, [shot, request]),
        "virga_shot_cancel": (c_int, [shot]),
    }
    for name, (result, arguments) in signatures.items():
        function = getattr(lib, name)
        function.restype, function.argtypes = result, arguments
    return lib


_lib = _load()


def _check(code):
    if code != 0:
        raise Error(code, _lib.virga_error_sentence().decode())


def parameters():
    """The table: name -> (group, unit, default, help)."""
    rows = (_lib.virga_parameter_at(i).contents for i in range(_lib.virga_parameter_count()))
    return {row.name.decode(): tuple(text.decode() for text in (row.group, row.unit, row.default_text, row.help))
            for row in rows}


def _picture(array, name, window=None):
    """The description of an array's own memory: no copy, whatever its row stride."""
    kind = SAMPLES.get(array.dtype.name)
    channels = array.shape[2] if array.ndim == 3 else 1
    layout = {1: GREY, 3: RGB, 4: RGBA}.get(channels)
    if kind is None or layout is None or array.ndim not in (2, 3):
        raise ValueError(f"{name}: an array of {array.shape}, {array.dtype}; must be height x width [x 3 or 4] of "
                         f"{', '.join(SAMPLES)}")
    if array.ndim == 3 and array.strides[2] != array.itemsize:
        raise ValueError(f"{name}: its channels do not lie side by side; numpy.ascontiguousarray makes them")
    picture = Picture(struct_size=ctypes.sizeof(Picture), layout=layout, samples=kind)
    picture.window = Window(*window) if window else Window(0, 0, array.shape[1], array.shape[0])
    picture.planes[0] = array.ctypes.data
    picture.row_stride[0] = array.strides[0]
    picture.pixel_stride = array.strides[1]
    integers = kind in (UINT8, UINT16)
    picture.color_space = b"sRGB" if integers else None
    picture.is_straight = integers
    return picture


class Shot:
    """Settings and a frame size. Frames come in any order; any thread may ask."""

    def __init__(self, width, height, fps=24.0, device="auto", **settings):
        self._shot = c_void_p()
        _check(_lib.virga_shot_create(width, height, fps, byref(self._shot)))
        _check(_lib.virga_shot_set_device(self._shot, device.encode()))
        for name, value in settings.items():
            self[name.replace("_", "-")] = value

    def __del__(self):
        if getattr(self, "_shot", None):
            _lib.virga_shot_release(self._shot)

    def __setitem__(self, name, value):
        if isinstance(value, (tuple, list)):
            value = ",".join(map(repr, value))
        text = str(value).lower() if isinstance(value, bool) else str(value)
        _check(_lib.virga_shot_set(self._shot, name.encode(), text.encode()))

    def __getitem__(self, name):
        text = c_char_p()
        _check(_lib.virga_shot_get(self._shot, name.encode(), byref(text)))
        return text.value.decode()

    def apply(self, document):
        """A settings document, TOML or JSON."""
        _check(_lib.virga_shot_set_document(self._shot, document.encode()))

    @property
    def device(self):
        text = c_char_p()
        _check(_lib.virga_shot_device(self._shot, byref(text)))
        return text.value.decode()

    def samples_wanted(self, first, last):
        """Frames of the plate first..last to be given to add_sample: one light for all frames, as `virga rain` has."""
        frames, count = (c_int64 * 64)(), c_size_t()
        _check(_lib.virga_shot_samples_wanted(self._shot, first, last, frames, 64, byref(count)))
        return list(frames[:min(count.value, 64)])

    def add_sample(self, frame, plate):
        _check(_lib.virga_shot_add_plate_sample(self._shot, frame, byref(_picture(plate, "plate"))))

    def set_environment(self, panorama):
        """An equirectangular panorama, or None."""
        picture = None if panorama is None else byref(_picture(panorama, "panorama"))
        _check(_lib.virga_shot_set_environment(self._shot, picture))

    def render(self, frame, plate, depth=None, layers=(), region=None, scale=1.0, progress=None):
        """Rain over `plate`, an array of the same kind as it; with `layers` also a dictionary of float RGBA arrays.

        region    (x, y, width, height) of the scaled frame
        depth     height x width, metres (or as the parameters depth-... say), of any size
        progress  called with the share done; False ends the frame, which raises Error with code CANCELLED
        """
        request = Request(struct_size=ctypes.sizeof(Request), frame=frame, scale=scale)
        x, y, width, height = region or (0, 0, plate.shape[1], plate.shape[0])
        request.region = Window(x, y, width, height) if region else Window()
        beauty = np.empty((height, width) + plate.shape[2:], plate.dtype)
        made = {name: np.empty((height, width, 4), np.float32) for name in layers}
        pictures = {"plate": _picture(plate, "plate"), "beauty": _picture(beauty, "beauty", (x, y, width, height))}
        if depth is not None:
            pictures["depth"] = _picture(depth, "depth")
        for name, array in made.items():
            if name not in LAYERS:
                raise ValueError(f"no layer is called '{name}': must be one of {', '.join(LAYERS)}")
            pictures[name] = _picture(array, name, (x, y, width, height))
        for name, picture in pictures.items():
            setattr(request, name, ctypes.pointer(picture))
        if progress is not None:
            request.progress = Progress(lambda user, done: 1 if progress(done) is False else 0)
        _check(_lib.virga_shot_render(self._shot, byref(request)))
        return (beauty, made) if layers else beauty

    def cancel(self):
        _check(_lib.virga_shot_cancel(self._shot))
