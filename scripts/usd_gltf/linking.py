"""Light linking and shadow linking: which geometry a light lights, and which casts shadows from it. Filter linking: for which
geometry a light filter filters.

UsdLux has a collection for each, `lightLink`, `shadowLink` and `filterLink`; usd-core computes what they hold. A *link set* is
what a collection holds of the geometry that is exported. Equal sets are one, and a set of everything is none, so a stage
whose lights light everything exports nothing of this. The form in the file is in `src/ingest/carriers.md`. A light whose
`shadow:enable` is off has a shadow link that holds nothing.

All three collections hold everything where they do not say whether they do: `includeRoot` is true in UsdLux's schemas. usd-core
does not know this of prims whose types it does not know, such as RenderMan's filters.

Prims are asked for by their paths on the stage, those of instances by the paths of their proxies. What a
PointInstancer places has two paths, the prototype's and the instancer's. A collection that names the prototype or
something above it, other than the stage's root, is taken at that word. Else it is asked for the instancer.

A GeomSubset of faces may be in a set that its mesh is not in. A mesh is cut into parts by material; where a collection
names a subset, that is one more part. Parts carry sets of their own if those differ from the mesh's.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from pxr import Sdf, Usd, UsdGeom, UsdLux

from .filter_kinds import is_filter
from .light_inputs import SIZES, light_type
from .mesh import MeshSource, Piece
from .prim_tree import Prim
from .report import Notebook
from .stage import PREDICATE

_LINKS = ("lightLink", "shadowLink")
_FILTER_LINK = "filterLink"

Place = tuple[str, ...]
"""The path of a prim, and those of the PointInstancers that place it, the innermost first."""


class Linking:
    """The link sets of a compiled stage."""

    def __init__(self, stage: Usd.Stage, prims: list[Prim], report: Notebook) -> None:
        self.stage, self.report = stage, report
        self._queries: list[_Query | _Nothing] = []
        self._number: dict = {}
        """Of each query its place among them; -1 for one that holds everything by what it says."""
        lights: dict[str, list[int]] = {}
        for prim, _ in _all(prims):
            if prim.light is not None and prim.light_path not in lights:
                lights[prim.light_path] = self._queries_of(prim.light_path, prim.light.casts_shadows)
        filters = {path: [self._query(path, _FILTER_LINK)] for prim, _ in _all(prims) for path in prim.filters}
        self._members: dict[Place, tuple[bool, ...]] = {}
        self._sets: list[int | None] = []
        self._lights: dict[str, list[int | None]] = {}
        self._filters: dict[str, list[int | None]] = {}
        self._meshes: dict[tuple[int, tuple], MeshSource] = {}
        if not self._queries:
            return
        for prim, chain in _all(prims):
            if _is_geometry(prim):
                for path in (prim.path, *_parts(prim)):
                    self._member((path, *chain))
        self._number_sets(lights, filters)

    def node(self, prim: Prim, chain: Place) -> dict:
        """What the extras of a prim's node get, placed by a chain of PointInstancers."""
        if not (self._lights or self._filters) or not _is_geometry(prim):
            return {}
        outside = self._outside((prim.path, *chain))
        return {"usdLinks": self._said(outside)} if outside else {}

    def light(self, prim: Prim) -> dict:
        """What the `usdLux` extras of a light get."""
        numbers = self._lights.get(prim.light_path, ())
        return {link: number for link, number in zip(_LINKS, numbers, strict=False) if number is not None}

    def filter(self, prim: Prim) -> dict:
        """What the `usdLightFilter` extras of a filter get."""
        number = self._filters.get(prim.path, [None])[0]
        return {} if number is None else {_FILTER_LINK: number}

    def mesh(self, prim: Prim, chain: Place) -> MeshSource:
        """The mesh of a prim, whose parts carry the sets that they are in where those differ from the mesh's."""
        mesh = prim.mesh
        if not (self._lights or self._filters) or not _parts(prim):
            return mesh
        own = self._outside((prim.path, *chain))
        parts = [_subset(prim, piece) for piece in mesh.pieces]
        outside = [own if part is None else self._outside((part, *chain)) for part in parts]
        if all(sets == own for sets in outside):
            return mesh
        key = (id(mesh), own, tuple(outside))
        if key not in self._meshes:
            pieces = []
            for piece, sets in zip(mesh.pieces, outside, strict=True):
                if sets != own:
                    extras = {**piece.primitive["extras"], "usdLinks": self._said(sets)}
                    piece = replace(piece, primitive={**piece.primitive, "extras": extras})
                pieces.append(piece)
            self._meshes[key] = replace(mesh, pieces=pieces)
        return self._meshes[key]

    # -- sets ------------------------------------------------------------------------------------

    def _queries_of(self, path: str, casts_shadows: bool) -> list[int]:
        """The numbers of a light's queries, in the order of `_LINKS`. With `shadow:enable` off nothing casts its shadows,
        whatever its collection says."""
        return [self._query(path, link) if casts_shadows or link == "lightLink" else self._nothing() for link in _LINKS]

    def _nothing(self) -> int:
        if None not in self._number:
            self._number[None] = len(self._queries)
            self._queries.append(_Nothing())
        return self._number[None]

    def _query(self, path: str, link: str) -> int:
        """The number of the query of a light's collection; -1 if it holds everything by what it says."""
        prim = self.stage.GetPrimAtPath(path)
        if not _is_authored(prim, link):
            return -1
        collection = _collection(prim, link)
        query, root = collection.ComputeMembershipQuery(), _is_usually_everything(collection)
        # Queries of expressions are equal to one another, whatever the expressions say.
        is_expression = not query.UsesPathExpansionRuleMap()
        key = (collection.ResolveCompleteMembershipExpression().GetText() if is_expression else query, root)
        if key not in self._number:
            new = _Query(query, root)
            self._number[key] = -1 if new.is_all else len(self._queries)
            if not new.is_all:
                self._queries.append(new)
            for named in sorted(new.named, key=str):
                if not named.IsPropertyPath() and not self.stage.GetPrimAtPath(named):
                    self.report.note(path, f"{link} of nothing", f"its collection names {named}, which is not there")
        return self._number[key]

    def _member(self, place: Place) -> tuple[bool, ...]:
        """For each query, whether it holds what stands at a place."""
        if place not in self._members:
            paths = tuple(Sdf.Path(path) for path in place)
            self._members[place] = tuple(query.holds(paths) for query in self._queries)
        return self._members[place]

    def _number_sets(self, lights: dict[str, list[int]], filters: dict[str, list[int]]) -> None:
        """Number the sets in the order of the lights, and then of the filters, that name them."""
        columns = list(zip(*self._members.values(), strict=True))
        numbers: dict[tuple, int] = {}
        self._sets = [None] * len(self._queries)
        for queries in (*lights.values(), *filters.values()):
            for query in queries:
                if query >= 0 and columns and not all(columns[query]):
                    self._sets[query] = numbers.setdefault(columns[query], len(numbers))
        self._count = len(numbers)
        self._lights, self._filters = self._named(lights), self._named(filters)

    def _named(self, queries: dict[str, list[int]]) -> dict[str, list[int | None]]:
        """The numbers of the sets of queries, by path, where one is not of everything."""
        named = {path: [self._sets[q] if q >= 0 else None for q in own] for path, own in queries.items()}
        return {path: sets for path, sets in named.items() if any(number is not None for number in sets)}

    def _outside(self, place: Place) -> tuple[int, ...]:
        """The numbers of the sets that do not hold what stands at a place, ascending."""
        held = self._member(place)
        numbers = {number for number, holds in zip(self._sets, held, strict=True) if number is not None and not holds}
        return tuple(sorted(numbers))

    def _said(self, outside: tuple[int, ...]) -> dict:
        """`usdLinks`, by the shorter list."""
        if 2 * len(outside) <= self._count:
            return {"outside": list(outside)}
        return {"inside": [number for number in range(self._count) if number not in set(outside)]}


def _all(prims: list[Prim]) -> Iterator[tuple[Prim, Place]]:
    """All prims, prototypes once for each chain of PointInstancers that places them."""
    seen: set[tuple[int, Place]] = set()
    open_: list[tuple[Prim, Place]] = [(prim, ()) for prim in reversed(prims)]
    while open_:
        prim, chain = open_.pop()
        yield prim, chain
        below = [(child, chain) for child in prim.children]
        for prototype, _ in prim.instances:
            key = (id(prototype), (prim.path, *chain))
            if key not in seen:
                seen.add(key)
                below.append((prototype, key[1]))
        open_ += reversed(below)


def _is_geometry(prim: Prim) -> bool:
    """Whether the prim is lit, or casts shadows: a mesh, fog, or a light whose shape does."""
    light = prim.light
    casts = light is not None and light.type in SIZES and light.visibility.get("shadows", False)
    return prim.mesh is not None or prim.fog is not None or casts


def _subset(prim: Prim, piece: Piece) -> str | None:
    """The path of the GeomSubset that a piece of the prim's mesh is, if it is one."""
    # The piece has the path in the instance that was read first; the name is the same in all.
    path = piece.primitive.get("extras", {}).get("usdPath")
    return None if path is None else f"{prim.path}/{path.rsplit('/', 1)[-1]}"


def _parts(prim: Prim) -> list[str]:
    """The GeomSubsets that the prim's mesh is cut into."""
    pieces = prim.mesh.pieces if prim.mesh is not None else []
    return [path for path in (_subset(prim, piece) for piece in pieces) if path is not None]


def _is_authored(light: Usd.Prim, link: str) -> bool:
    """Whether a light or a filter says anything of a link; without, it is of everything."""
    return bool(light.GetAuthoredPropertiesInNamespace(f"collection:{link}"))


def _collection(light: Usd.Prim, link: str) -> Usd.CollectionAPI:
    api = UsdLux.LightAPI(light)
    if link == _FILTER_LINK:
        return UsdLux.LightFilter(light).GetFilterLinkCollectionAPI() or Usd.CollectionAPI(light, link)
    return api.GetLightLinkCollectionAPI() if link == "lightLink" else api.GetShadowLinkCollectionAPI()


def _is_usually_everything(collection: Usd.CollectionAPI) -> bool:
    """Whether a collection does not say if it holds everything, and usd-core does not know that it then does."""
    return collection.GetIncludeRootAttr().Get() is None and collection.GetExpansionRuleAttr().Get() != Usd.Tokens.explicitOnly


def _links_of(prim: Usd.Prim) -> Iterator[str]:
    """The links that a light or a filter says anything of."""
    links = _LINKS if light_type(prim) is not None else (_FILTER_LINK,) if is_filter(prim) else ()
    return (link for link in links if _is_authored(prim, link))


class _Query:
    """What a collection holds. With `root` it holds everything that it does not exclude."""

    def __init__(self, query, root: bool = False) -> None:
        self.query, self.root = query, root
        self.by_rules = root or query.UsesPathExpansionRuleMap()
        rules = dict(query.GetAsPathExpansionRuleMap()) if self.by_rules else {}
        self.excluded = {path for path, rule in rules.items() if rule == Usd.Tokens.exclude}
        if root:
            rules = {Sdf.Path.absoluteRootPath: Usd.Tokens.expandPrims, **rules}
        self.is_all = rules == {Sdf.Path.absoluteRootPath: Usd.Tokens.expandPrims}
        self.named = frozenset(rules)
        """The paths that it names; none if it is an expression."""

    def holds(self, place: tuple[Sdf.Path, ...]) -> bool:
        """Whether it holds what stands at a place."""
        path, *chain = place
        if not chain:
            return self._holds(path)
        if not self.by_rules:
            return any(self._holds(at) for at in place)
        for at in (path, *chain[:-1]):
            if any(prefix in self.named for prefix in at.GetPrefixes()):
                return self._holds(at)
        return self._holds(chain[-1])

    def _holds(self, path: Sdf.Path) -> bool:
        return self.query.IsPathIncluded(path) or (self.root and self.excluded.isdisjoint(path.GetPrefixes()))


class _Nothing:
    """A collection that holds nothing."""

    def holds(self, place: tuple[Sdf.Path, ...]) -> bool:
        """Whether it holds what stands at a place."""
        return False


class LinkSubsets:
    """The GeomSubsets that a mesh is cut by because collections name them."""

    def __init__(self, stage: Usd.Stage, report: Notebook) -> None:
        self.report = report
        self._named: set[Sdf.Path] = set()
        for prim in Usd.PrimRange(stage.GetPseudoRoot(), PREDICATE):
            for link in _links_of(prim):
                query = _Query(_collection(prim, link).ComputeMembershipQuery())
                named = ((path, stage.GetPrimAtPath(path)) for path in query.named if path.IsPrimPath())
                self._named.update(path for path, prim in named if prim and prim.IsA(UsdGeom.Subset))

    def of(self, mesh: Usd.Prim, others: list[Usd.Prim]) -> list[Usd.Prim]:
        """Those of a mesh, beside others that it is cut by. Faces that are in two stay in the first."""
        if not self._named or not mesh.IsA(UsdGeom.Imageable):
            return []
        own = [s for s in UsdGeom.Subset.GetAllGeomSubsets(UsdGeom.Imageable(mesh)) if s.GetPath() in self._named]
        found: list[Usd.Prim] = []
        for subset in own:
            before = [*others, *found]
            if subset.GetPrim() in before or subset.GetElementTypeAttr().Get() != UsdGeom.Tokens.face:
                continue
            faces = set(subset.GetIndicesAttr().Get() or ())
            if any(faces & set(UsdGeom.Subset(other).GetIndicesAttr().Get() or ()) for other in before):
                why = "it shares faces with another subset, whose links these faces have"
                self.report.warn(subset.GetPath(), "linked faces that are in two subsets", why)
            found.append(subset.GetPrim())
        return found
