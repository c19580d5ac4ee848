"""Cages of subdivision surfaces, and other meshes that the street's writer does not know."""

import math

from parts.usda import array, num, vec


def cage(layer, name, points, faces, material, creases=(), corners=(), body=(), meta=()):
    """A Catmull-Clark surface. `creases` are (chain of vertices, sharpness), `corners` are (vertex, sharpness)."""
    with layer.prim("Mesh", name, ['prepend apiSchemas = ["MaterialBindingAPI"]', *meta], body):
        low, high = ([pick(p[k] for p in points) for k in range(3)] for pick in (min, max))
        layer.put(f"float3[] extent = [{vec(low)}, {vec(high)}]")
        layer.put("int[] faceVertexCounts = " + array(map(len, faces), str))
        layer.put("int[] faceVertexIndices = " + array((i for f in faces for i in f), str))
        layer.put("point3f[] points = " + array(points, vec))
        layer.put('uniform token subdivisionScheme = "catmullClark"')
        if creases:
            layer.put("int[] creaseIndices = " + array((i for chain, _ in creases for i in chain), str))
            layer.put("int[] creaseLengths = " + array((len(chain) for chain, _ in creases), str))
            layer.put("float[] creaseSharpnesses = " + array((sharp for _, sharp in creases), num))
        if corners:
            layer.put("int[] cornerIndices = " + array((i for i, _ in corners), str))
            layer.put("float[] cornerSharpnesses = " + array((sharp for _, sharp in corners), num))
        layer.put(layer.bind(material))


def lofted(rings, caps=True):
    """Points and faces of rings of equally many points; the rings go on in the direction about which they turn to the left."""
    n, points = len(rings[0]), [p for ring in rings for p in ring]
    faces = []
    for j in range(len(rings) - 1):
        for k in range(n):
            a, b = j * n + k, j * n + (k + 1) % n
            faces.append((a, b, b + n, a + n))
    if caps:
        faces += [tuple(range(n))[::-1], tuple(range(len(points) - n, len(points)))]
    return points, faces


def block(low, high):
    """A box as a cage: points and faces."""
    (a, b, c), (d, e, f) = low, high
    return lofted([[(a, b, z), (d, b, z), (d, e, z), (a, e, z)] for z in (c, f)])


def turn(angle, radius):
    """A point of a circle; degrees."""
    return radius * math.cos(math.radians(angle)), radius * math.sin(math.radians(angle))
