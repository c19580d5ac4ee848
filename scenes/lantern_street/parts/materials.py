"""The shared material library, `materials.usda`: UsdPreviewSurface, mostly dielectrics."""

from .usda import Layer, num, vec

# name: (diffuse colour, roughness, metallic)
PLAIN = {
    "Stone": ((0.34, 0.31, 0.27), 0.7, 0),
    "DarkStone": ((0.16, 0.15, 0.15), 0.5, 0),
    "Flags": ((0.17, 0.165, 0.16), 0.32, 0),
    "Interior": ((0.62, 0.48, 0.32), 0.8, 0),
    "Timber": ((0.10, 0.055, 0.03), 0.5, 0),
    "WhitePaint": ((0.62, 0.58, 0.50), 0.45, 0),
    "GreenPaint": ((0.03, 0.13, 0.10), 0.35, 0),
    "RedPaint": ((0.36, 0.03, 0.02), 0.30, 0),
    "BluePaint": ((0.04, 0.09, 0.20), 0.35, 0),
    "Tile": ((0.20, 0.075, 0.045), 0.55, 0),
    "Slate": ((0.05, 0.06, 0.08), 0.35, 0),
    "Glass": ((0.012, 0.014, 0.018), 0.04, 0),
    "Water": ((0.006, 0.008, 0.010), 0.03, 0),
    "ClothRed": ((0.45, 0.03, 0.03), 0.85, 0),
    "ClothCream": ((0.66, 0.58, 0.44), 0.85, 0),
    "ClothGreen": ((0.04, 0.20, 0.10), 0.85, 0),
    "ClothDark": ((0.025, 0.025, 0.032), 0.7, 0),
    "Leaf": ((0.05, 0.14, 0.03), 0.6, 0),
    "Terracotta": ((0.35, 0.13, 0.07), 0.8, 0),
    "Skin": ((0.45, 0.27, 0.19), 0.6, 0),
    "Cream": ((0.70, 0.60, 0.36), 0.22, 0),
    "Rubber": ((0.02, 0.02, 0.02), 0.6, 0),
    "Iron": ((0.055, 0.055, 0.06), 0.38, 1),
    "Steel": ((0.52, 0.52, 0.54), 0.20, 1),
    "Brass": ((0.75, 0.50, 0.18), 0.25, 1),
    "Board": ((0.012, 0.012, 0.018), 0.25, 0),
    "ColourA": ((0.55, 0.16, 0.04), 0.5, 0),
    "ColourB": ((0.10, 0.30, 0.34), 0.5, 0),
    "ColourC": ((0.58, 0.45, 0.10), 0.5, 0),
}
PLASTER = {
    "Ochre": (0.78, 0.50, 0.22),
    "Rose": (0.70, 0.36, 0.28),
    "Ivory": (0.80, 0.70, 0.52),
    "Blue": (0.28, 0.40, 0.54),
    "Sage": (0.42, 0.50, 0.34),
    "Oxide": (0.52, 0.16, 0.10),
    "Grey": (0.50, 0.48, 0.46),
}
# What glows by its material alone: a lens, a bulb's glass.
GLOWS = {"BulbGlass": (9, 5.2, 2.0), "LampGlass": (10, 6.5, 3.2), "RedLens": (6, 0.15, 0.05)}


def material(layer, name, inputs, textures=(), scale=1.0):
    """`textures` maps an input to (file, output, extra lines)."""
    with layer.prim("Material", name):
        here = f"/Materials/{name}"
        layer.put(f"token outputs:surface.connect = <{here}/Surface.outputs:surface>")
        with layer.prim("Shader", "Surface"):
            layer.put('uniform token info:id = "UsdPreviewSurface"')
            for line in inputs:
                layer.put(line)
            for slot, (_, output, _) in dict(textures).items():
                kind = {"normal": "normal3f", "roughness": "float"}.get(slot, "color3f")
                layer.put(f"{kind} inputs:{slot}.connect = <{here}/{slot}.outputs:{output}>")
            layer.put("token outputs:surface")
        for slot, (file, output, extra) in dict(textures).items():
            with layer.prim("Shader", slot):
                layer.put('uniform token info:id = "UsdUVTexture"')
                layer.put(f"asset inputs:file = @textures/{file}@")
                layer.put('token inputs:wrapS = "repeat"')
                layer.put('token inputs:wrapT = "repeat"')
                layer.put(f"float2 inputs:st.connect = <{here}/st.outputs:result>")
                for line in extra:
                    layer.put(line)
                layer.put(f"{'float3' if output == 'rgb' else 'float'} outputs:{output}")
        if textures:
            with layer.prim("Shader", "st"):
                layer.put('uniform token info:id = "UsdPrimvarReader_float2"')
                layer.put('string inputs:varname = "st"')
                layer.put("float2 outputs:result")


SRGB, RAW = 'token inputs:sourceColorSpace = "sRGB"', 'token inputs:sourceColorSpace = "raw"'


def write(folder):
    layer = Layer("materials.usda", "The materials of the street. Written by make.py.")
    layer.roots.append("Materials")
    with layer.prim("Scope", "Materials"):
        for name, (color, roughness, metallic) in PLAIN.items():
            material(
                layer,
                name,
                [
                    f"color3f inputs:diffuseColor = {vec(color)}",
                    f"float inputs:roughness = {num(roughness)}",
                    f"float inputs:metallic = {metallic}",
                ],
            )
        for name, color in PLASTER.items():
            tint = [SRGB, f"float4 inputs:scale = {vec((*color, 1))}"]
            material(
                layer,
                "Plaster" + name,
                ["float inputs:roughness = 0.75"],
                {"diffuseColor": ("plaster.png", "rgb", tint)},
            )
        material(layer, "Brick", ["float inputs:roughness = 0.7"], {"diffuseColor": ("brick.png", "rgb", [SRGB])})
        bump = (
            "setts_normal.png",
            "rgb",
            [RAW, "float4 inputs:scale = (2, 2, 2, 1)", "float4 inputs:bias = (-1, -1, -1, 0)"],
        )
        color = ("setts_color.png", "rgb", [SRGB])
        material(
            layer,
            "SettsWet",
            [],
            {"diffuseColor": color, "normal": bump, "roughness": ("setts_wet.png", "r", [RAW])},
        )
        material(layer, "SettsDry", ["float inputs:roughness = 0.85"], {"diffuseColor": color, "normal": bump})
        for name, color in GLOWS.items():
            material(
                layer,
                name,
                ["color3f inputs:diffuseColor = (0, 0, 0)", f"color3f inputs:emissiveColor = {vec(color)}"],
            )
        for name, file in (
            ("PaperGlow", "paper.png"),
            ("HouseSignGlow", "house_sign.png"),
            ("TeaSignGlow", "tea_sign.png"),
            ("TramSignGlow", "tram_sign.png"),
        ):
            material(
                layer,
                name,
                ["color3f inputs:diffuseColor = (0.02, 0.02, 0.02)", "float inputs:roughness = 0.5"],
                {"emissiveColor": (file, "rgb", [SRGB])},
            )
        material(
            layer, "Tube", ["color3f inputs:diffuseColor = (0, 0, 0)", "color3f inputs:emissiveColor = (1, 1, 1)"]
        )
    layer.save(folder)
