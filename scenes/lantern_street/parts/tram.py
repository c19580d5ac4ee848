"""The tram, coming down the street. Its front is -Y; it is moved by the top layer."""

from .shapes import ball_profile, box, prism, tube, turned
from .usda import Layer, Mesh, light

LONG, HALF = 920, 108  # length; half width


def outline(grow=0.0, nose=46):
    """The plan: a box with rounded ends, counter-clockwise."""
    w, l = HALF + grow, LONG / 2 + grow
    front = [(-w, -l + nose), (-w + 14, -l + 18), (-w + 50, -l), (w - 50, -l), (w - 14, -l + 18), (w, -l + nose)]
    return front + [(-x, -y) for x, y in front]


def body(layer):
    mesh = Mesh()
    prism(mesh, outline(-3), 34, 62, "Iron", True)
    prism(mesh, outline(), 62, 122, "RedPaint", False)
    prism(mesh, outline(1.2), 118, 127, "Cream", True)
    prism(mesh, outline(), 127, 142, "Cream", False)
    prism(mesh, outline(), 222, 262, "Cream", False)
    prism(mesh, outline(6), 262, 270, "RedPaint", True)
    for grow, z0, z1 in ((-8, 270, 284), (-34, 284, 292)):
        prism(mesh, outline(grow), z0, z1, "Slate", True)
    prism(mesh, [(x * 0.5, y * 0.8) for x, y in outline()], 292, 312, "Cream", True, lid="Slate")
    posts = []
    ring = outline()
    for (x0, y0), (x1, y1) in zip(ring, ring[1:] + ring[:1]):
        far = max(abs(x1 - x0), abs(y1 - y0))
        count = max(1, round(far / 105))
        posts += [(x0 + (x1 - x0) * k / count, y0 + (y1 - y0) * k / count) for k in range(count)]
    for x, y in posts:
        box(mesh, (x - 4, y - 4, 142), (x + 4, y + 4, 222), "Cream", "z-z+")
    box(mesh, (-3, -LONG / 2 - 1, 142), (3, -LONG / 2 + 5, 222), "Cream", "z-z+")
    # inside: floor, seats, a lining under the roof
    mesh.face([(x * 0.97, y * 0.985, 70) for x, y in ring], "Timber")
    mesh.face([(x * 0.98, y * 0.985, 258) for x, y in ring[::-1]], "WhitePaint")
    for y in range(-300, 330, 88):
        for x in (-70, 70):
            box(mesh, (x - 32, y, 70), (x + 32, y + 40, 112), "Timber", "z-")
            box(mesh, (x - 32, y + 36, 112), (x + 32, y + 42, 160), "Timber", "z-")
    for x in (-24, 24):
        tube(mesh, [(x, -330, 236), (x, 330, 236)], 1.6, 5, "Brass")
    for y in (-210, 210):
        for x in (-50, 50):
            tube(mesh, [(x - 5, y, 34), (x + 5, y, 34)], 33, 16, "Iron")
    # bumper, steps, lifeguard, trolley pole
    box(mesh, (-70, -LONG / 2 - 16, 44), (70, -LONG / 2, 58), "Iron")
    box(mesh, (-84, -LONG / 2 - 8, 14), (84, -LONG / 2 + 4, 20), "Timber")
    tube(mesh, [(0, 100, 312), (0, 330, 500)], 2.0, 5, "Iron")
    turned(mesh, [(9, 0), (9, 3)], 10, "Brass", (0, -LONG / 2 - 1, 100))
    for x in (-58, 58):
        tube(mesh, [(x, -LONG / 2 + 1, 96), (x, -LONG / 2 - 9, 96)], 13, 12, "Brass")
    mesh.write(layer, "Body")


def people(layer):
    mesh = Mesh()
    for x, y in ((-72, -270), (70, -182), (-66, -94), (74, 82), (-72, 170), (62, 258), (20, -390)):
        driver = y < -350
        base = 70 if driver else 110
        turned(
            mesh,
            [(20, 0), (24, 30), (20, 52), (7, 62)],
            8,
            "ClothDark" if x > 0 else "BluePaint",
            (x, y, base + (40 if driver else 0)),
        )
        turned(mesh, ball_profile(11, 6, 1.2), 8, "Skin", (x, y, base + 74 + (40 if driver else 0)))
    mesh.write(layer, "Passengers")


def write(folder):
    layer = Layer("assets/tram.usda", "The tram, with its lights inside. Written by make.py.")
    with layer.root("Tram"):
        body(layer)
        people(layer)
        for k, y in enumerate(range(-370, 400, 148)):
            light(
                layer, "RectLight", f"Ceiling_{k + 1}", (0, y, 256), None, 3100, width=46, height=112, intensity=13
            )
        front = -LONG / 2
        for name, x in (("Left", -58), ("Right", 58)):
            light(
                layer,
                "DiskLight",
                f"Lens_{name}",
                (x, front - 9.6, 96),
                (90, 0, 180),
                4200,
                radius=11.5,
                intensity=26,
            )
            light(
                layer,
                "SphereLight",
                f"Headlight_{name}",
                (x, front - 12, 96),
                (83, 0, 180),
                4200,
                (24, 0.75),
                radius=4,
                intensity=11000,
                treatAsPoint=True,
            )
        sign = Mesh()
        sign.face(
            [(-56, front - 2.4, 233), (56, front - 2.4, 233), (56, front - 2.4, 261), (-56, front - 2.4, 261)],
            "TramSignGlow",
            uv=[(0, 0), (1, 0), (1, 1), (0, 1)],
        )
        sign.write(layer, "LineSign", body=["float inputs:intensity = 3.5"], light=True)
        for x in (-88, 88):
            light(
                layer,
                "DiskLight",
                f"Marker_{'L' if x < 0 else 'R'}",
                (x, front + 8, 246),
                (90, 0, 180),
                color=(1, 0.06, 0.02),
                radius=4,
                intensity=9,
            )
        # Stand-ins that must not render.
        proxy = Mesh()
        box(proxy, (-HALF, -LONG / 2, 30), (HALF, LONG / 2, 312), "ClothRed")
        proxy.write(layer, "Proxy", body=['uniform token purpose = "proxy"'])
        guide = Mesh()
        box(guide, (-150, -1400, 2), (150, 1400, 6), "ColourC")
        guide.write(layer, "ClearanceGauge", body=['uniform token purpose = "guide"'])
    layer.save(folder)
