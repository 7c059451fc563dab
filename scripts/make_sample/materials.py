"""Procedural materials: node graphs only, no image textures.

Every pattern is a function of the place in the world (Blender's object coordinates of objects left at the
origin), in metres, so neighbouring walls never repeat each other. `facade coordinates` are (x + y, z) in
Blender's axes: on a wall that faces any of the four quarters, x + y runs along it.
"""

import functools

import bpy


class Graph:
    """A thin pen for node graphs: every method adds one node and returns its output socket."""

    def __init__(self, tree):
        self.tree = tree

    def node(self, kind, inputs=None, **settings):
        made = self.tree.nodes.new(kind)
        for key, value in settings.items():
            setattr(made, key, value)
        for key, value in (inputs or {}).items():
            self.set(made.inputs[key], value)
        return made

    def set(self, socket, value):
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        elif value is not None:
            if socket.type == "RGBA" and len(value) == 3:
                value = (*value, 1.0)
            socket.default_value = value

    def position(self):
        return self.node("ShaderNodeTexCoord").outputs["Object"]

    def split(self, vector):
        made = self.node("ShaderNodeSeparateXYZ", {0: vector})
        return made.outputs[0], made.outputs[1], made.outputs[2]

    def join(self, x, y, z):
        return self.node("ShaderNodeCombineXYZ", {0: x, 1: y, 2: z}).outputs[0]

    def math(self, operation, a, b=None, clamp=False):
        return self.node("ShaderNodeMath", {0: a, 1: b}, operation=operation, use_clamp=clamp).outputs[0]

    def noise(self, vector, scale, detail=3.0, roughness=0.5, distortion=0.0):
        return self.node("ShaderNodeTexNoise", {"Vector": vector, "Scale": scale, "Detail": detail,
                                                "Roughness": roughness, "Distortion": distortion}).outputs["Fac"]

    def stretch(self, vector, x, y, z):
        return self.node("ShaderNodeVectorMath", {0: vector, 1: (x, y, z)}, operation="MULTIPLY").outputs[0]

    def step(self, value, lo, hi, out_lo=0.0, out_hi=1.0):
        """Smooth step of `value` from lo..hi to out_lo..out_hi."""
        return self.node("ShaderNodeMapRange", {"Value": value, "From Min": lo, "From Max": hi,
                                                "To Min": out_lo, "To Max": out_hi},
                         interpolation_type="SMOOTHSTEP").outputs[0]

    def mix(self, factor, a, b, blend="MIX"):
        return self.node("ShaderNodeMixRGB", {"Fac": factor, "Color1": a, "Color2": b}, blend_type=blend).outputs[0]

    def scale_colour(self, colour, factor):
        grey = self.join(factor, factor, factor) if isinstance(factor, bpy.types.NodeSocket) else (factor,) * 3
        return self.mix(1.0, colour, grey, "MULTIPLY")

    def bump(self, height, strength, distance):
        return self.node("ShaderNodeBump", {"Height": height, "Strength": strength,
                                            "Distance": distance}).outputs[0]

    def surface(self, colour, roughness=0.6, specular=0.4, normal=None, **more):
        made = self.node("ShaderNodeBsdfPrincipled", {"Base Color": colour, "Roughness": roughness,
                                                      "Specular": specular, **more})
        if normal is not None:
            self.set(made.inputs["Normal"], normal)
        return made.outputs[0]


def material(name):
    """An empty material and its graph; `finish` connects the surface."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    made.node_tree.nodes.clear()
    # Lamps and lit windows are small and no brighter than a few skies: they are found by reflection,
    # not sampled as lights, which keeps every light path short.
    made.cycles.sample_as_light = False
    return made, Graph(made.node_tree)


def finish(made, graph, surface):
    graph.node("ShaderNodeOutputMaterial", {"Surface": surface})
    return made


@functools.lru_cache(None)
def plain(name, colour, roughness=0.5, specular=0.4, metallic=0.0, coat=0.0):
    made, g = material(name)
    return finish(made, g, g.surface(colour, roughness, specular, Metallic=metallic, Clearcoat=coat))


@functools.lru_cache(None)
def painted(name, colour, roughness=0.4):
    """Paint on wood or iron, a little uneven."""
    made, g = material(name)
    p = g.position()
    shade = g.step(g.noise(p, 6.0, 4.0), 0.3, 0.75, 0.75, 1.08)
    return finish(made, g, g.surface(g.scale_colour(colour, shade), roughness))


def _grime(g, p, z):
    """Darkening of a wall: broad stains, streaks that rain drew, splashes near the pavement."""
    broad = g.step(g.noise(p, 0.55, 5.0, 0.6), 0.3, 0.72, 0.72, 1.06)
    streak = g.step(g.noise(g.stretch(p, 2.6, 2.6, 0.16), 1.0, 4.0, 0.62), 0.42, 0.72, 1.0, 0.66)
    fine = g.step(g.noise(p, 14.0, 3.0), 0.25, 0.8, 0.9, 1.07)
    foot = g.step(g.math("ADD", z, g.math("MULTIPLY", g.noise(p, 1.6, 3.0), -0.8)), -0.3, 0.7, 0.55, 1.0)
    return g.math("MULTIPLY", g.math("MULTIPLY", broad, streak), g.math("MULTIPLY", fine, foot))


@functools.lru_cache(None)
def plaster(name, colour):
    made, g = material(name)
    p = g.position()
    _, _, z = g.split(p)
    tint = g.mix(g.step(g.noise(p, 0.35, 4.0), 0.35, 0.7), colour,
                 tuple(c * f for c, f in zip(colour, (0.86, 0.84, 0.80))))
    normal = g.bump(g.noise(p, 45.0, 3.0), 0.25, 0.01)
    return finish(made, g, g.surface(g.scale_colour(tint, _grime(g, p, z)), 0.75, 0.25, normal))


@functools.lru_cache(None)
def brick(name, colour, mortar=(0.42, 0.39, 0.35)):
    made, g = material(name)
    p = g.position()
    x, y, z = g.split(p)
    uv = g.join(g.math("ADD", x, y), z, 0.0)
    courses = g.node("ShaderNodeTexBrick", {
        "Vector": uv, "Color1": tuple(c * 0.72 for c in colour), "Color2": tuple(min(c * 1.25, 1) for c in colour),
        "Mortar": mortar, "Scale": 1.0, "Mortar Size": 0.007, "Mortar Smooth": 0.2, "Bias": 0.0,
        "Brick Width": 0.22, "Row Height": 0.072})
    shade = _grime(g, p, z)
    height = g.math("ADD", g.math("MULTIPLY", courses.outputs["Fac"], -1.0),
                    g.math("MULTIPLY", g.noise(p, 40.0, 2.0), 0.4))
    normal = g.bump(height, 0.5, 0.008)
    return finish(made, g, g.surface(g.scale_colour(courses.outputs["Color"], shade), 0.7, 0.3, normal))


@functools.lru_cache(None)
def stone(name, colour, block=(0.9, 0.38), joint=0.012):
    """Ashlar: large blocks with fine joints, each block of its own tone."""
    made, g = material(name)
    p = g.position()
    x, y, z = g.split(p)
    uv = g.join(g.math("ADD", x, y), z, 0.0)
    blocks = g.node("ShaderNodeTexBrick", {
        "Vector": uv, "Color1": tuple(c * 0.85 for c in colour), "Color2": tuple(min(c * 1.1, 1) for c in colour),
        "Mortar": tuple(c * 0.42 for c in colour), "Scale": 1.0, "Mortar Size": joint, "Mortar Smooth": 0.3,
        "Bias": 0.0, "Brick Width": block[0], "Row Height": block[1]})
    normal = g.bump(g.math("SUBTRACT", g.math("MULTIPLY", g.noise(p, 25.0, 4.0), 0.35), blocks.outputs["Fac"]),
                    0.5, 0.015)
    colour_out = g.scale_colour(blocks.outputs["Color"], _grime(g, p, z))
    return finish(made, g, g.surface(colour_out, 0.65, 0.35, normal))


@functools.lru_cache(None)
def roof_tiles(name, colour):
    made, g = material(name)
    p = g.position()
    x, y, z = g.split(p)
    uv = g.join(g.math("ADD", x, y), g.math("MULTIPLY", z, 1.4), 0.0)
    tiles = g.node("ShaderNodeTexBrick", {
        "Vector": uv, "Color1": tuple(c * 0.7 for c in colour), "Color2": tuple(c * 1.25 for c in colour),
        "Mortar": tuple(c * 0.3 for c in colour), "Scale": 1.0, "Mortar Size": 0.012, "Brick Width": 0.24,
        "Row Height": 0.3})
    colour_out = g.scale_colour(tiles.outputs["Color"], g.step(g.noise(p, 0.8, 5.0), 0.3, 0.7, 0.65, 1.1))
    # Wet slates and tiles carry the sky.
    return finish(made, g, g.surface(colour_out, 0.38, 0.45, g.bump(tiles.outputs["Fac"], -0.4, 0.02)))


@functools.lru_cache(None)
def window_glass(name, behind, lit=0.0, ior=1.85):
    """A pane with what is behind it folded in: dark room, curtain or lamplight. Opaque, so depth ends here."""
    made, g = material(name)
    p = g.position()
    normal = g.bump(g.noise(p, 1.7, 1.0), 0.06, 0.05)
    folds = g.step(g.noise(g.stretch(p, 16.0, 16.0, 0.4), 1.0, 2.0), 0.3, 0.7, 0.6, 1.0)
    base = g.scale_colour(behind, folds) if max(behind) > 0.1 else behind
    inside = {}
    if lit > 0:
        glow = g.step(g.noise(p, 1.3, 3.0), 0.3, 0.75, 0.35 * lit, 1.15 * lit)
        inside = {"Emission": (1.0, 0.62, 0.27), "Emission Strength": glow}
    behind_glass = g.surface(base, 0.9, 0.0, None, **inside)
    mirror = g.node("ShaderNodeBsdfGlossy", {"Color": (0.93, 0.96, 0.97), "Roughness": 0.015,
                                             "Normal": normal}).outputs[0]
    # Two faces of double glazing reflect about twice what one does: hence the high default index.
    fresnel = g.node("ShaderNodeFresnel", {"IOR": ior, "Normal": normal}).outputs[0]
    return finish(made, g, g.node("ShaderNodeMixShader", {0: fresnel, 1: behind_glass, 2: mirror}).outputs[0])


@functools.lru_cache(None)
def shop_glass(name="shop glass"):
    """A clear sheet: the room behind it is modelled."""
    made, g = material(name)
    normal = g.bump(g.noise(g.position(), 0.9, 1.0), 0.05, 0.05)
    mirror = g.node("ShaderNodeBsdfGlossy", {"Roughness": 0.005, "Normal": normal}).outputs[0]
    clear = g.node("ShaderNodeBsdfTransparent", {"Color": (0.86, 0.9, 0.88)}).outputs[0]
    fresnel = g.node("ShaderNodeFresnel", {"IOR": 1.6, "Normal": normal}).outputs[0]
    return finish(made, g, g.node("ShaderNodeMixShader", {0: fresnel, 1: clear, 2: mirror}).outputs[0])


@functools.lru_cache(None)
def lamplit(name, colour, glow):
    """A thing in a lamplit shop. Its light is given, not traced: tracing it through the window would be noise."""
    made, g = material(name)
    _, _, z = g.split(g.position())
    falloff = g.step(z, 0.0, 3.2, 0.45 * glow, 1.15 * glow)
    return finish(made, g, g.surface(colour, 0.6, 0.2, None, Emission=colour,
                                     **{"Emission Strength": g.math("MULTIPLY", falloff,
                                                                    g.step(g.noise(g.position(), 1.1), 0.25, 0.75,
                                                                           0.5, 1.3))}))


@functools.lru_cache(None)
def light(name, colour, strength):
    made, g = material(name)
    return finish(made, g, g.node("ShaderNodeEmission", {"Color": colour, "Strength": strength}).outputs[0])


@functools.lru_cache(None)
def asphalt(name="asphalt", tone=1.0):
    """Wet asphalt: aggregate, cracks, tyre-polished lanes, and puddles that are mirrors."""
    made, g = material(name)
    p = g.position()
    x, y, _ = g.split(p)
    to_kerb = g.step(g.math("ABSOLUTE", x), 2.5, 4.0, 0.0, 0.13)
    lane = g.math("ABSOLUTE", g.math("SUBTRACT", g.math("ABSOLUTE", g.math("SUBTRACT", x, 0.9)), 0.85))
    rut = g.step(lane, 0.0, 0.45, 0.05, 0.0)
    level = g.math("ADD", g.noise(g.stretch(p, 1.0, 0.6, 1.0), 0.42, 4.0, 0.5, 0.3), g.math("ADD", to_kerb, rut))
    puddle = g.step(level, 0.562, 0.612)
    damp = g.step(level, 0.40, 0.58)
    grain = g.noise(p, 120.0, 2.0, 0.7)
    cracks = g.node("ShaderNodeTexVoronoi", {
        "Vector": g.node("ShaderNodeVectorMath", {
            0: p, 1: g.node("ShaderNodeTexNoise", {"Vector": p, "Scale": 1.5, "Detail": 4.0}).outputs["Color"]},
            operation="ADD").outputs[0], "Scale": 0.33}, feature="DISTANCE_TO_EDGE").outputs["Distance"]
    crack = g.step(cracks, 0.003, 0.012, 0.45, 1.0)
    tone_noise = g.step(g.noise(p, 0.7, 5.0, 0.6), 0.3, 0.7, 0.75, 1.25)
    speck = g.step(grain, 0.3, 0.8, 0.65, 1.5)
    shade = g.math("MULTIPLY", g.math("MULTIPLY", tone_noise, speck), crack)
    dry = g.scale_colour(tuple(tone * c for c in (0.058, 0.058, 0.060)), shade)
    colour = g.mix(puddle, g.scale_colour(dry, g.step(damp, 0.0, 1.0, 1.0, 0.55)), (0.012, 0.0125, 0.012))
    roughness = g.mix(puddle, g.join(*[g.step(g.math("ADD", damp, g.noise(p, 3.0, 3.0)), 0.4, 1.6, 0.36, 0.12)] * 3),
                      (0.012,) * 3)
    bump_strength = g.step(puddle, 0.0, 0.8, 0.55, 0.0)
    normal = g.bump(g.math("ADD", grain, g.math("MULTIPLY", crack, 0.5)), bump_strength, 0.006)
    ripple = g.bump(g.noise(p, 5.0, 2.0), 0.02, 0.01)
    normal = g.node("ShaderNodeMix", {0: puddle, 4: normal, 5: ripple}, data_type="VECTOR").outputs[1]
    return finish(made, g, g.surface(colour, roughness, 0.5, normal))


@functools.lru_cache(None)
def paving(name, colour, width, height, roughness=(0.5, 0.18)):
    """Wet slabs or setts; the joints hold water."""
    made, g = material(name)
    p = g.position()
    x, y, _ = g.split(p)
    slabs = g.node("ShaderNodeTexBrick", {
        "Vector": g.join(x, y, 0.0), "Color1": tuple(c * 0.75 for c in colour),
        "Color2": tuple(c * 1.2 for c in colour),
        "Mortar": tuple(c * 0.3 for c in colour), "Scale": 1.0, "Mortar Size": 0.009, "Mortar Smooth": 0.3,
        "Brick Width": width, "Row Height": height})
    wet = g.step(g.noise(p, 0.7, 4.0, 0.55), 0.42, 0.62)
    pool = g.step(g.noise(p, 0.55, 3.0, 0.5, 0.4), 0.60, 0.64)
    stain = g.math("MULTIPLY", g.step(g.noise(p, 1.3, 5.0), 0.3, 0.75, 0.7, 1.1),
                   g.step(g.noise(p, 60.0, 2.0), 0.2, 0.8, 0.85, 1.15))
    colour_out = g.scale_colour(slabs.outputs["Color"], g.math("MULTIPLY", stain, g.step(wet, 0.0, 1.0, 1.0, 0.6)))
    rough = g.math("MULTIPLY", g.step(wet, 0.0, 1.0, roughness[0], roughness[1]), g.step(pool, 0.0, 1.0, 1.0, 0.1))
    height_out = g.math("SUBTRACT", g.math("MULTIPLY", g.noise(p, 30.0, 3.0), 0.25), slabs.outputs["Fac"])
    normal = g.bump(height_out, g.step(pool, 0.0, 1.0, 0.5, 0.02), 0.008)
    return finish(made, g, g.surface(colour_out, rough, 0.5, normal))


@functools.lru_cache(None)
def road_paint(name="road paint", colour=(0.62, 0.62, 0.58)):
    """Worn thermoplastic: where it is gone the asphalt's tone shows."""
    made, g = material(name)
    p = g.position()
    worn = g.step(g.noise(p, 9.0, 6.0, 0.72), 0.44, 0.60)
    tone = g.mix(worn, colour, (0.05, 0.05, 0.052))
    return finish(made, g, g.surface(tone, 0.28, 0.5, g.bump(g.noise(p, 110.0, 2.0), 0.3, 0.004)))


@functools.lru_cache(None)
def bark(name="bark"):
    made, g = material(name)
    p = g.position()
    rough = g.noise(g.stretch(p, 14.0, 14.0, 2.5), 1.0, 5.0, 0.65)
    patches = g.step(g.noise(p, 3.0, 3.0), 0.48, 0.56)
    tone = g.mix(patches, (0.045, 0.036, 0.028), (0.10, 0.088, 0.068))
    return finish(made, g, g.surface(g.scale_colour(tone, g.step(rough, 0.3, 0.7, 0.5, 1.3)), 0.55, 0.35,
                                     g.bump(rough, 0.8, 0.03)))


@functools.lru_cache(None)
def leaf(name, colour):
    """Thin leaf: a wet face, and light from behind."""
    made, g = material(name)
    p = g.position()
    tone = g.scale_colour(colour, g.step(g.noise(p, 2.2, 2.0), 0.3, 0.7, 0.6, 1.35))
    face = g.surface(tone, 0.35, 0.4)
    through = g.node("ShaderNodeBsdfTranslucent", {"Color": g.scale_colour(tone, 1.3)}).outputs[0]
    return finish(made, g, g.node("ShaderNodeMixShader", {0: 0.3, 1: face, 2: through}).outputs[0])


@functools.lru_cache(None)
def car_paint(name, colour):
    made, g = material(name)
    return finish(made, g, g.surface(colour, 0.38, 0.5, None, Metallic=0.25, Clearcoat=1.0,
                                     **{"Clearcoat Roughness": 0.02}))


@functools.lru_cache(None)
def hillside(name, colour):
    """Far woods; the haze between is mixed into the colour."""
    made, g = material(name)
    p = g.position()
    tone = g.scale_colour(colour, g.step(g.noise(p, 0.05, 6.0, 0.65), 0.3, 0.7, 0.75, 1.2))
    return finish(made, g, g.surface(tone, 0.9, 0.1))


def overcast_sky(world, zenith=1.75):
    """CIE overcast gradient, about L = Lz (1 + 2 sin e) / 3 (Moon & Spencer 1942), under soft cloud, a little
    brighter and warmer in the west, where the afternoon is; grey ground below the horizon."""
    world.use_nodes = True
    world.node_tree.nodes.clear()
    g = Graph(world.node_tree)
    direction = g.node("ShaderNodeTexCoord").outputs["Generated"]
    x, y, z = g.split(direction)
    up = g.math("MAXIMUM", z, 0.0)
    gradient = g.math("MULTIPLY", g.math("ADD", g.math("MULTIPLY", up, 2.4), 1.0), zenith / 3.4)
    plane = g.math("ADD", up, 0.16)
    sheet = g.join(g.math("DIVIDE", x, plane), g.math("DIVIDE", y, plane), 0.0)
    broad = g.noise(sheet, 0.55, 6.0, 0.52, 0.25)
    small = g.noise(g.stretch(sheet, 1.0, 1.6, 1.0), 1.7, 6.0, 0.55, 0.4)
    cloud = g.math("ADD", g.math("MULTIPLY", broad, 0.72), g.math("MULTIPLY", small, 0.28))
    bright = g.step(cloud, 0.33, 0.66, 0.62, 1.22)
    tint = g.mix(g.step(cloud, 0.36, 0.62), (0.86, 0.93, 1.04), (1.0, 0.995, 0.97))
    # The glow of a hidden sun: ahead and to the right, 20 degrees up.
    toward = g.math("ADD", g.math("ADD", g.math("MULTIPLY", x, 0.42), g.math("MULTIPLY", y, 0.84)),
                    g.math("MULTIPLY", z, 0.34))
    glow = g.math("POWER", g.math("MAXIMUM", toward, 0.0), 6.0)
    warm = g.mix(g.math("MULTIPLY", glow, 0.6), tint, (1.08, 0.98, 0.86))
    radiance = g.scale_colour(warm, g.math("MULTIPLY", g.math("MULTIPLY", gradient, bright),
                                           g.math("ADD", 1.0, g.math("MULTIPLY", glow, 0.22))))
    below = g.step(z, -0.03, 0.0)
    final = g.mix(below, (0.18, 0.175, 0.165), radiance)
    g.node("ShaderNodeOutputWorld", {"Surface": g.node("ShaderNodeBackground", {
        "Color": final, "Strength": 1.0}).outputs[0]})
