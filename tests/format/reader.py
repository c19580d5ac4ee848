"""A reader of `.ltree` files, written from `src/store/format.md` alone: standard library, no numpy.

It decodes every field, checks the container, and walks every frame. As a program it prints, as JSON,
what the Rust test beside it compares with what the library says of the same file.

    python3 tests/format/reader.py FILE
"""

import json
import math
import struct
import sys
import zlib

MAGIC = b"\x89LTR\r\n\x1a\n"
KNOWN = {"META": 1, "TREE": 48, "GRUP": 256, "INST": 64, "FRAM": 16, "FORC": 4, "LGHT": 64, "PATH": 1}
KNOWN |= {"FPRT": 32, "TXTR": 40, "MEAN": 16, "LINK": 4}
ALWAYS = ("TREE", "GRUP", "LGHT", "PATH")
NO_TREE = 0xFFFFFFFF
STILL = 1
PLACED, CHANGES = 1, 2


class Refused(Exception):
    """The file is not one that this reader reads."""


def require(holds, rule):
    if not holds:
        raise Refused(rule)


def read_sections(data):
    """Header and table: the sections by name, checked."""
    require(data[:8] == MAGIC, "HEAD 1")
    require(len(data) >= 64, "HEAD 4")
    major, _minor, mark, length, count, checksum = struct.unpack_from("<HHIQII", data, 8)
    require(mark == 0x01020304, "HEAD 2")
    require(major == 1, "HEAD 3")
    table_end = 64 + 32 * count
    require(length == len(data) and count <= 256 and table_end <= length, "HEAD 4")
    header = data[:28] + bytes(4) + data[32:table_end]
    require(zlib.crc32(header) == checksum, "HEAD 5")
    sections, end = {}, table_end
    for row in range(count):
        name, required, offset, size, element, crc = struct.unpack_from("<4sIQQII", data, 64 + 32 * row)
        name = name.decode("ascii")
        require(offset % 64 == 0, "TABL 1")
        require(end <= offset < end + 64, "TABL 2")
        require(offset + size <= length, "TABL 3")
        require(element > 0, "TABL 4")
        require(name not in sections, "TABL 5")
        require(name in KNOWN or not required, "TABL 6")
        require(name not in KNOWN or (element == KNOWN[name] and size % element == 0), "TABL 8")
        require(not any(data[end:offset]), "TABL 9")
        sections[name] = data[offset : offset + size]
        require(zlib.crc32(sections[name]) == crc, "TABL 10")
        end = offset + size
    require(end == length, "HEAD 4")
    require(all(name in sections for name in ALWAYS), "TABL 7")
    return sections


def axis_of(i, j):
    """The unit vector of an octahedral code."""
    x, y = i / 32767, j / 32767
    z = 1 - abs(x) - abs(y)
    if z < 0:
        x, y = x - math.copysign(z, x), y - math.copysign(z, y)
    length = math.sqrt(x * x + y * y + z * z)
    return (x / length, y / length, z / length)


class Node:
    """A node, decoded."""

    def __init__(self, center, energy, half, exponent, axis, theta_o, theta_e, reach, link):
        scale = 0.0 if exponent == 0 else 2.0 ** (exponent - 127)
        self.center = center
        self.energy = energy
        self.half = tuple(m * scale for m in half)
        self.axis = axis_of(*axis)
        self.theta_o = 2 * math.asin((theta_o & 0x7FFF) / 32767)
        self.two_sided = theta_o >> 15 == 1
        if self.theta_o == math.pi:
            self.theta_e, self.share = math.pi / 2, (theta_e / 255) ** 2
        else:
            self.theta_e = math.acos(1 - (theta_e / 255) ** 2)
            self.share = math.sin(self.theta_e) ** 2 / 4 * (2 if self.two_sided else 1)
        self.range = math.inf if reach == 0 else 2 ** ((reach - 1) / 4 - 31.75)
        self.link = link

    @staticmethod
    def alone(data):
        n = struct.unpack("<3ff3BBhhHBBI", data)
        return Node(n[0:3], n[3], n[4:7], n[7], n[8:10], *n[10:])

    def report(self):
        endless = math.isinf(self.range)
        return dict(vars(self), range=None if endless else self.range)

    def leads(self):
        """Where to: ("inner" | "emitter" | "instance", a number)."""
        if self.link >> 31 == 0:
            return "inner", self.link
        return ("emitter", "instance")[self.link >> 30 & 1], self.link & 0x3FFFFFFF


def read_group(data):
    """The nodes of the lanes that are used."""
    floats = [struct.unpack_from("<8f", data, 32 * field) for field in range(4)]
    bytes_ = [data[128 + 8 * field : 136 + 8 * field] for field in range(4)]
    axes = [struct.unpack_from("<8h", data, offset) for offset in (160, 176)]
    theta_o = struct.unpack_from("<8H", data, 192)
    theta_e, reach = data[208:216], data[216:224]
    links = struct.unpack_from("<8I", data, 224)
    nodes = []
    for lane in range(8):
        if links[lane] == 0:
            fields = [f[lane] for f in floats + bytes_ + axes + [theta_o, theta_e, reach]]
            require(not any(fields), "GRUP 2")
            continue
        nodes.append(
            Node(
                tuple(f[lane] for f in floats[:3]),
                floats[3][lane],
                tuple(b[lane] for b in bytes_[:3]),
                bytes_[3][lane],
                tuple(a[lane] for a in axes),
                theta_o[lane],
                theta_e[lane],
                reach[lane],
                links[lane],
            )
        )
    return nodes


class File:
    """A file, all of it."""

    def __init__(self, data):
        s = read_sections(data)

        def rows(name, size):
            return [s[name][at : at + size] for at in range(0, len(s.get(name, b"")), size)]

        self.fingerprint = data[32:64]
        self.meta = json.loads(s["META"]) if "META" in s else {}
        self.trees = [struct.unpack("<4I", r[:16]) + (Node.alone(r[16:]),) for r in rows("TREE", 48)]
        self.groups = [read_group(r) for r in rows("GRUP", 256)]
        self.instances = [struct.unpack("<12f4I", r) for r in rows("INST", 64)]
        self.frames = [struct.unpack("<iIII", r) for r in rows("FRAM", 16)] if s.get("FRAM") else None
        self.fingerprints = rows("FPRT", 32)
        self.forced = [entry for (entry,) in struct.iter_unpack("<I", s.get("FORC", b""))]
        self.textures = [(r[:32], *struct.unpack("<2I", r[32:])) for r in rows("TXTR", 40)]
        self.means = [struct.unpack("<I3f", r) for r in rows("MEAN", 16)]
        self.links = [entry for (entry,) in struct.iter_unpack("<I", s["LINK"])] if "LINK" in s else None
        self.lights = []
        for r in rows("LGHT", 64):
            first, count, offset, length, energy, kind = struct.unpack_from("<4IfI", r, 32)
            path = s["PATH"][offset : offset + length].decode("utf-8")
            self.lights.append((path, r[:32], first, count, energy, kind))

    def first_of_class(self, wanted):
        firsts = [first for _, _, first, _, _, kind in self.lights if kind >= wanted]
        return firsts[0] if firsts else sum(light[3] for light in self.lights)

    def check_tree(self, row):
        """Preorder, containment and sums of one tree; returns its emitters and instances."""
        first, count, leaf_count, _kind, root = self.trees[row]
        emitters, instances = [], []

        def visit(group, parent):
            """Checks a group and what is below it; returns the number of the group behind."""
            behind = group + 1
            require(first <= group < first + count, "GRUP 3")
            for node in self.groups[group]:
                check_inside(node, parent)
                kind, number = node.leads()
                if kind == "inner":
                    require(group + number == behind, "GRUP 3")
                    behind = visit(behind, node)
                else:
                    (emitters if kind == "emitter" else instances).append(number)
            total = sum(node.energy for node in self.groups[group])
            require(abs(total - parent.energy) <= 1e-6 * total, "GRUP 11")
            return behind

        require(visit(first, root) == first + count, "GRUP 3")
        require(len(emitters) + len(instances) == leaf_count, "TREE 5")
        return emitters, instances

    def check_textures(self):
        prints = [fingerprint for fingerprint, _, _ in self.textures]
        require(prints == sorted(set(prints)), "TXTR 1")
        behind = 0
        for _, first, count in self.textures:
            require(first == behind, "TXTR 2")
            behind += count
            triangles = [triangle for triangle, *_ in self.means[first:behind]]
            require(triangles == sorted(set(triangles)), "MEAN 2")
        require(behind == len(self.means), "TXTR 2")
        for _, *mean in self.means:
            require(all(math.isfinite(part) and part >= 0 for part in mean) and any(mean), "MEAN 1")

    def check_links(self):
        if self.links is None:
            return
        require(len(self.links) == len(self.lights), "LINK 1")
        following = 1
        for number in self.links:
            require(number <= following, "LINK 2")
            following += number == following
        require(following > 1, "LINK 3")

    def check(self):
        """The textures and links; the frames' fingerprints; every tree, and that it holds just its lights."""
        self.check_textures()
        self.check_links()
        require(len(self.fingerprints) in (0, len(self.frames or [])), "FPRT 1")
        groups = 0
        for row, (first, count, _leaves, kind, _root) in enumerate(self.trees):
            require(first == groups, "TREE 3")
            groups += count
            emitters, instances = self.check_tree(row)
            require(len(set(emitters)) == len(emitters), "GRUP 12")
            require(all(self.instances[i][12] < row for i in instances), "GRUP 13")
            if kind == 0:
                require(sorted(emitters) == list(range(len(emitters))) and not instances, "TREE 6")
                continue
            own = CHANGES if kind == 2 else 0
            wanted = [l for l in self.lights if l[5] == own]
            numbers = [e for light in wanted for e in range(light[2], light[2] + light[3])]
            require(sorted(emitters) == numbers, "TREE 6")
            placed = sorted(
                (self.instances[i][13], self.trees[self.instances[i][12]][2])
                for i in instances
                if self.trees[self.instances[i][12]][3] != STILL
            )
            require(placed == [(l[2], l[3]) for l in self.lights if l[5] == own | PLACED], "TREE 6")
        require(groups == len(self.groups), "TREE 3")

    def emitters_at(self, row, first=0):
        """Numbers and energies of all emitters below a tree, by walking."""
        found = []

        def walk(row, group, first, brighter):
            for node in self.groups[group]:
                kind, number = node.leads()
                if kind == "inner":
                    walk(row, group + number, first, brighter)
                elif kind == "emitter":
                    found.append((first + number, node.energy * brighter))
                else:
                    below = self.instances[number]
                    root = self.trees[below[12]][4]
                    # The leaf says how much of the tree's energy there is out here.
                    walk(below[12], self.trees[below[12]][0], below[13], brighter * node.energy / root.energy)

        walk(row, self.trees[row][0], first, 1.0)
        return sorted(found)

    def forced_of(self, first, count):
        return [self.instances[i][13] for i in self.forced[first : first + count]]

    def frames_sampled(self):
        """For each frame (or for all at once): its number, its tree and its forced lights."""
        if self.frames is not None:
            return [(f, None if t == NO_TREE else t, self.forced_of(a, n)) for f, t, a, n in self.frames]
        still = [row for row, tree in enumerate(self.trees) if tree[3] == STILL]
        return [(None, still[0] if still else None, self.forced_of(0, len(self.forced)))]

    def report(self):
        frames = []
        for number, tree, forced in self.frames_sampled():
            emitters = [] if tree is None else self.emitters_at(tree)
            told = dict(zip([row[0] for row in self.frames or []], self.fingerprints)).get(number)
            frames.append(
                {
                    "frame": number,
                    "fingerprint": told and told.hex(),
                    "emitters": [emitter for emitter, _ in emitters],
                    "energies": [energy for _, energy in emitters],
                    "forced": forced,
                }
            )
        nodes = [node for group in self.groups for node in group]
        return {
            "fingerprint": self.fingerprint.hex(),
            "lights": [[path, fingerprint.hex(), *rest] for path, fingerprint, *rest in self.lights],
            "nodes": [node.report() for node in nodes],
            "frames": frames,
            "links": self.links or [],
        }


def check_inside(child, parent):
    """GRUP 7 to 10, in decoded numbers: angles and ranges with room for the last bits."""
    for axis in range(3):
        apart = abs(child.center[axis] - parent.center[axis])
        require(apart + child.half[axis] <= parent.half[axis], "GRUP 7")
    lit = child.theta_e <= parent.theta_e or parent.theta_o == math.pi
    require(lit and child.two_sided <= parent.two_sided, "GRUP 8")
    require(child.range <= parent.range, "GRUP 9")
    cosine = sum(a * b for a, b in zip(child.axis, parent.axis))
    cosine = abs(cosine) if parent.two_sided else cosine
    apart = math.acos(max(-1.0, min(1.0, cosine)))
    same = child.axis == parent.axis or parent.theta_o == math.pi
    require((same and child.theta_o <= parent.theta_o) or apart + child.theta_o <= parent.theta_o + 6e-6, "GRUP 10")


def main():
    with open(sys.argv[1], "rb") as file:
        found = File(file.read())
    found.check()
    json.dump(found.report(), sys.stdout)


if __name__ == "__main__":
    try:
        main()
    except Refused as rule:
        sys.exit(f"refused: rule {rule}")
