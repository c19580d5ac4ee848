"""The materials, `materials.usda`, in the dialects that a stage of several departments has: UsdPreviewSurface, OpenPBR
and standard_surface of MaterialX, Arnold's standard_surface."""

from parts.materials import SRGB, material
from parts.usda import Layer, num, vec

# name: (diffuse colour, roughness, metallic)
PLAIN = {
    "Lawn": ((0.06, 0.10, 0.035), 0.9, 0),
    "Gravel": ((0.26, 0.22, 0.18), 0.9, 0),
    "Hedge": ((0.03, 0.07, 0.03), 0.8, 0),
    "Cypress": ((0.018, 0.04, 0.02), 0.8, 0),
    "Black": ((0.015, 0.015, 0.017), 0.6, 0),
    "Iron": ((0.05, 0.05, 0.055), 0.4, 1),
    "Bench": ((0.10, 0.06, 0.035), 0.6, 0),
    "CoatA": ((0.05, 0.05, 0.07), 0.9, 0),
    "CoatB": ((0.16, 0.05, 0.04), 0.9, 0),
    "CoatC": ((0.07, 0.09, 0.08), 0.9, 0),
    "Hair": ((0.03, 0.02, 0.015), 0.5, 0),
    "Skin": ((0.42, 0.26, 0.18), 0.6, 0),
    "SeaDeep": ((0.02, 0.09, 0.19), 0.55, 0),
    "SeaMid": ((0.03, 0.17, 0.28), 0.55, 0),
    "Foam": ((0.62, 0.70, 0.70), 0.6, 0),
    "Ivory": ((0.72, 0.66, 0.52), 0.4, 0),
    "PineBark": ((0.05, 0.03, 0.02), 0.8, 0),
    "PineLeaf": ((0.02, 0.09, 0.05), 0.7, 0),
    "Drum": ((0.55, 0.10, 0.04), 0.5, 0),
    "Flame": ((0.62, 0.06, 0.02), 0.5, 0),
    "CardGold": ((0.72, 0.42, 0.10), 0.35, 0),
    "Blue": ((0.03, 0.075, 0.17), 0.6, 0),
}
# What glows by its material alone, in nits.
GLOWS = {"Eye": (60, 44, 14), "Tube": (1, 1, 1)}


def surface(layer, name, context, identifier, inputs, nodes=()):
    """A material of one renderer's surface. `nodes` are (name, id, inputs); `@name` in inputs is such a node's output."""
    here = f"/Materials/{name}"

    def joined(line):
        key, _, source = line.partition(" = @")
        return f"{key}.connect = <{here}/{source}.outputs:out>" if source and "file" not in key else line

    with layer.prim("Material", name):
        layer.put(f"token outputs:{context}:surface.connect = <{here}/Surface.outputs:out>")
        for node, kind, own in (("Surface", identifier, inputs), *nodes):
            with layer.prim("Shader", node):
                layer.put(f'uniform token info:id = "{kind}"')
                for line in own:
                    layer.put(joined(line))
                layer.put("token outputs:out" if node == "Surface" else "color3f outputs:out")


def write(folder):
    layer = Layer("materials.usda", "The materials of the paper theatre. Written by make.py.")
    layer.roots.append("Materials")
    with layer.prim("Scope", "Materials"):
        for name, (color, roughness, metallic) in PLAIN.items():
            inputs = [f"color3f inputs:diffuseColor = {vec(color)}", f"float inputs:roughness = {num(roughness)}"]
            material(layer, name, [*inputs, f"float inputs:metallic = {metallic}"])
        for name, color in GLOWS.items():
            dark = "color3f inputs:diffuseColor = (0, 0, 0)"
            material(layer, name, [dark, f"color3f inputs:emissiveColor = {vec(color)}"])
        paint = ["color3f inputs:diffuseColor = (0.55, 0.06, 0.02)", "float inputs:roughness = 0.35"]
        material(layer, "HeadPaper", [*paint, "color3f inputs:emissiveColor = (4, 0.4, 0.08)"])
        coat = ["float inputs:clearcoat = 1", "float inputs:clearcoatRoughness = 0.16"]
        red = "color3f inputs:diffuseColor = (0.24, 0.018, 0.015)"
        material(layer, "Lacquer", [red, "float inputs:roughness = 0.6", *coat])
        # Oiled paper, lit from inside: what it lets through is a texture, in nits.
        material(
            layer,
            "Scales",
            ["float inputs:roughness = 0.6"],
            {
                "diffuseColor": ("scales.png", "rgb", [SRGB, "float4 inputs:scale = (0.5, 0.25, 0.2, 1)"]),
                "emissiveColor": ("scales.png", "rgb", [SRGB, "float4 inputs:scale = (15, 13, 13, 1)"]),
            },
        )
        surface(
            layer,
            "Boards",
            "mtlx",
            "ND_open_pbr_surface_surfaceshader",
            [
                "color3f inputs:base_color = @Tinted",
                "float inputs:specular_roughness = 0.45",
                "float inputs:coat_weight = 0.8",
                "float inputs:coat_ior = 1.5",
                "float inputs:coat_roughness = 0.2",
            ],
            [
                ("Tinted", "ND_multiply_color3", ["color3f inputs:in1 = @Wood", "color3f inputs:in2 = (0.9, 0.8, 0.75)"]),
                ("Wood", "ND_image_color3", ['asset inputs:file = @textures/boards.png@ (colorSpace = "srgb_texture")']),
            ],
        )
        surface(
            layer,
            "Pane",
            "mtlx",
            "ND_standard_surface_surfaceshader",
            [
                "bool inputs:thin_walled = 1",
                "float inputs:transmission = 1",
                "color3f inputs:transmission_color = (0.96, 0.9, 0.74)",
                "float inputs:specular_roughness = 0.02",
            ],
        )
        metal = ["float inputs:base = 1", "float inputs:metalness = 1"]
        gold = [*metal, "color3f inputs:base_color = (0.86, 0.56, 0.2)", "float inputs:specular_roughness = 0.42"]
        surface(layer, "Gilt", "arnold", "arnold:standard_surface", gold)
        cloth = ["color3f inputs:base_color = (0.27, 0.011, 0.016)", "float inputs:base = 1"]
        cloth += ["float inputs:specular = 0.3", "float inputs:specular_roughness = 0.7"]
        surface(layer, "Velvet", "arnold", "arnold:standard_surface", cloth)
    layer.save(folder)
