"""Stages with one quad under a material that is a network of shaders."""

import numpy as np
from test_materials import QUAD

STANDARD = "ND_standard_surface_surfaceshader"


def network(
    inputs: str,
    shaders: str = "",
    identifier: str = STANDARD,
    context: str = "mtlx:",
    interface: str = "",
    quad: str = QUAD,
) -> str:
    """A material whose surface has `inputs`; `@name` in them stands for the output of a shader of the same material."""
    text = f"""def Material "Mat" {{
        {interface}
        token outputs:{context}surface.connect = </Mat/S.outputs:out>
        def Shader "S" {{
            uniform token info:id = "{identifier}"
            {inputs}
            token outputs:out
        }}
        {shaders}
    }}"""
    return quad + text


def node(name: str, identifier: str, inputs: str = "", outputs: str = "color3f outputs:out") -> str:
    """A shader."""
    return f"""def Shader "{name}" {{
        uniform token info:id = "{identifier}"
        {inputs}
        {outputs}
    }}
    """


def link(name: str, source: str, kind: str = "color3f", output: str = "out") -> str:
    """An input that reads another shader of the material."""
    return f"{kind} inputs:{name}.connect = </Mat/{source}.outputs:{output}>\n"


def image(name: str, file: str, kind: str = "color3", extra: str = "") -> str:
    """A MaterialX image."""
    usd = {"color3": "color3f", "float": "float", "vector3": "float3", "color4": "color4f", "vector2": "float2"}[kind]
    return node(name, f"ND_image_{kind}", f"asset inputs:file = @{file}@\n{extra}", f"{usd} outputs:out")


def linear(codes: np.ndarray) -> np.ndarray:
    """What codes of sRGB in [0, 1] mean."""
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)


def extension(material: dict, name: str) -> dict:
    """A KHR_materials extension of a glTF material; empty if it has none."""
    return material.get("extensions", {}).get(f"KHR_materials_{name}", {})
