"""Who may include whom: the floors of docs/design.md, and the folders that may name each outside library.

    floors.py ROOT          checks ROOT/src, lib, cli and plugins; prints what is wrong, one line each, and fails
    floors.py --self-test   checks that the rules catch what they are for
"""

import pathlib
import re
import sys

FLOORS = {
    "core": 0,
    "camera": 1, "optics": 1, "plot": 1, "rainfall": 1, "sh": 1,
    "environment": 2, "particles": 2, "matte": 2, "depth": 2, "grade": 2, "io": 2, "gl": 2,
    "passes": 3, "reference": 3,
    "shot": 4,
    "bench": 5, "server": 5,
    "lib": 6, "cli": 6,
    "plugins": 7,
}

# Library: (what its includes look like, folders whose .cpp files may name it, folders whose headers may as well).
# io/Libav.h is not seen outside io: nothing but io links FFmpeg.
LIBRARIES = {
    "FFmpeg": (r"lib(av\w+|sw\w+)/", {"io"}, {"io"}),
    "OpenImageIO": (r"OpenImageIO/|OpenEXR/|Imath/", {"io"}, set()),
    "OpenColorIO": (r"OpenColorIO/", {"io"}, set()),
    "OpenCV": (r"opencv2?/", {"matte", "grade", "environment", "io"}, set()),
    "OpenGL": (r"epoxy/|GL/|EGL/|GLES\d/", {"gl", "passes", "shot"}, {"gl", "passes", "shot"}),
    "cpp-httplib": (r"httplib\.h", {"server"}, set()),
    "oneTBB": (r"tbb/|oneapi/", {"core"}, set()),
}

DEPENDS = re.compile(r"virga_floor\(\s*(\w+)\s+DEPENDS\s+([\w\s]*?)(?:PUBLIC|PRIVATE|\))")
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)


def closure(depends, folder):
    """The folders that `folder` links, itself among them."""
    seen, todo = set(), [folder]
    while todo:
        name = todo.pop()
        if name not in seen:
            seen.add(name)
            todo += depends.get(name, [])
    return seen


def faults(path, text, depends):
    """Sentences on what the file at `path`, below the root, includes but may not.
    depends: folder -> folders that its CMakeLists.txt names; a folder that is not there may include any lower floor."""
    parts = pathlib.PurePosixPath(path).parts
    folder = parts[1] if parts[0] == "src" else parts[0]
    if folder not in FLOORS:
        yield f"{path}: folder '{folder}' is not in docs/design.md's table of floors (tests/house/floors.py)"
        return
    for _, name in INCLUDE.findall(text):
        other = name.split("/")[0]
        if folder == "plugins" and "/" in name and other in FLOORS:
            yield f"{path}: includes {name}: plug-ins see include/virga/virga.h alone"
        elif "/" in name and other in FLOORS and other != folder:
            if FLOORS[other] >= FLOORS[folder]:  # neighbours on one floor do not know each other
                yield (f"{path}: includes {name}: floor {FLOORS[folder]} ({folder}) may not include "
                       f"floor {FLOORS[other]} ({other})")
            elif folder in depends and other not in closure(depends, folder):
                yield f"{path}: includes {name}, but {folder}'s CMakeLists.txt does not depend on {other}"
        for library, (pattern, sources, headers) in LIBRARIES.items():
            if not re.match(pattern, name):
                continue
            places = headers if path.endswith(".h") else sources
            if folder not in places:
                yield f"{path}: includes {name}: {library} is seen in {', '.join(sorted(sources))} only"


def check(root):
    wrong, files = [], 0
    depends = {}
    for path in (root / "src").glob("*/CMakeLists.txt"):
        for folder, names in DEPENDS.findall(path.read_text(encoding="utf-8")):
            depends[folder] = names.split()
    for folder in ("src", "lib", "cli", "plugins"):
        for path in sorted((root / folder).rglob("*")):
            if path.suffix in (".h", ".cpp"):
                files += 1
                wrong += faults(path.relative_to(root).as_posix(), path.read_text(encoding="utf-8"), depends)
    for sentence in wrong:
        print(sentence)
    print(f"{files} files, {len(wrong)} faults")
    return 1 if wrong or files == 0 else 0


def self_test():
    depends = {"core": [], "optics": ["core"], "matte": ["optics"], "sh": ["core"], "io": ["core"], "particles": ["core"]}
    allowed = [
        ("src/shot/A.cpp", '#include "io/Plate.h"\n#include <vector>\n'),
        ("src/io/Libav.h", "#include <libavformat/avformat.h>\n"),
        ("src/matte/A.cpp", '#include "core/Image.h"\n'),
        ("src/sh/A.cpp", '#include "sh/Harmonics.h"\n#include <Eigen/Dense>\n'),
        ("plugins/ofx/A.cpp", '#include "virga/virga.h"\n#include "abi/Ofx.h"\n'),
    ]
    forbidden = [
        ("src/core/A.cpp", '#include "sh/Harmonics.h"\n'),
        ("src/io/A.h", '#include "gl/Context.h"\n'),
        ("src/io/A.h", "# include <OpenImageIO/imageio.h>\n"),
        ("src/optics/A.cpp", "#include <opencv2/core.hpp>\n"),
        ("src/particles/A.cpp", "#include <epoxy/gl.h>\n"),
        ("src/shot/A.cpp", 'extern "C" {\n#include <libavutil/frame.h>\n}\n'),
        ("src/matte/A.cpp", '#include "sh/Harmonics.h"\n'),
        ("src/attic/A.cpp", "#include <vector>\n"),
        ("plugins/ofx/A.cpp", '#include "shot/Compositor.h"\n'),
    ]
    silent = [case for case in forbidden if not list(faults(*case, depends))]
    loud = [case for case in allowed if list(faults(*case, depends))]
    for case in silent:
        print("not caught:", case)
    for case in loud:
        print("wrongly caught:", case)
    return 1 if silent or loud else 0


if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        sys.exit(self_test())
    sys.exit(check(pathlib.Path(sys.argv[1])))
