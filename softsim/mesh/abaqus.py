"""Bodies from ABAQUS input files (.inp): nodes, linear elements, sets, surfaces."""

import logging
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from softsim.errors import MeshError
from softsim.mesh.abaqus_cards import Card, cards, fields, of_instance
from softsim.mesh.abaqus_elements import (
    CORNERS,
    FACES,
    dimension,
    family,
    reduced,
    refusal,
    supported,
)
from softsim.mesh.abaqus_sets import ASSEMBLY, BODY, Key, NamedSet, Sets, define
from softsim.mesh.content import Content
from softsim.mesh.mesh import (
    boundary_facets,
    cell_facets,
    facet_keys,
    find_rows,
    of_one_kind,
)
from softsim.mesh.quality import Labels

log = logging.getLogger(__name__)

_GENERATED = "write out the nodes and elements, as ABAQUS/CAE does in an input file"
_REFUSED = {
    "INCLUDE": "insert the text of the included file",
    "IMPORT": "write the nodes and elements into this file",
    "PARAMETER": "replace the names by their values",
    "IMPERFECTION": "change the coordinates of the nodes",
    "SYSTEM": "give the coordinates of the nodes in the global system",
    **dict.fromkeys(["NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY"], _GENERATED),
}
"""Keywords that change the body which the file describes -> what to do about them."""

_WITHOUT_MEANING = {"HEADING", "PREPRINT", "END STEP"}
"""Keywords without information on the body or what acts on it."""

_RIGID = "tie the nodes to a rigid body of the scene (rigid_bodies: tied)"
_CONSTRAINTS = {
    "TIE": "join the bodies in the scene (ties)",
    "EMBEDDED ELEMENT": "describe fibres in the scene (fibres)",
    **dict.fromkeys(["RIGID BODY", "COUPLING", "KINEMATIC COUPLING"], _RIGID),
    **dict.fromkeys(
        ["EQUATION", "MPC", "DISTRIBUTING COUPLING", "SHELL TO SOLID COUPLING", "TRANSFORM"],
        "there is no equivalent; symmetry and fixed directions are conditions of the scene",
    ),
}
"""Keywords, skipped, without which nodes move otherwise -> what to do about them."""

_SET_PARAMETERS = {"NSET", "ELSET", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED"}


def read_abaqus(path: Path, instance: str | None = None, *, reduce_order: bool = False) -> Content:
    """Return the body in an ABAQUS input file: flat, or an instance of a part.

    instance: which one; then the body stands where the assembly has it. None where the file has
        one at most, which is not moved away from where its part is drawn.
    reduce_order: read second-order elements as linear ones, without their mid-side nodes.

    Read are *NODE, *ELEMENT, *NSET, *ELSET and *SURFACE; materials, steps and the like are
    skipped and listed in `not_read`; a warning is logged about constraints. A surface of elements
    becomes a facet set, a surface of nodes a node set. What ABAQUS/CAE marks INTERNAL only serves
    other sets and surfaces. Where part and assembly both have a set of one name, the part's is
    called INSTANCE.NAME.

    Raises MeshError, naming file and line, if the file cannot be read, has elements other than
    those of abaqus_elements.py (hybrid or not) or of several families, several instances or a moved
    one of which none is chosen, an empty set, a member that does not exist, or takes nodes from
    elsewhere.
    """
    found = list(cards(path))
    chosen = _instance(found, instance, path)
    deck = _Deck(path, moves=instance is not None, reduces=reduce_order)
    for card in of_instance(found, chosen) if chosen else found:
        deck.add(card)
    return deck.content()


def _instance(found: list[Card], name: str | None, path: Path) -> Card | None:
    """Return the card of the instance of that name, or of the only one; None in a flat file."""
    by_name = {card.parameter("NAME"): card for card in found if card.keyword == "INSTANCE"}
    named = [card for key, card in by_name.items() if name is None or _same(key, name)]
    if name is not None and not named:
        raise MeshError(
            f"{path}: there is no instance '{name}'",
            hint=f"instances: {', '.join(by_name)}" if by_name else "the file has no *INSTANCE",
        )
    if len(named) > 1:
        raise named[1].fault(
            f"the file has {len(named)} instances: {', '.join(by_name)}",
            hint=f"select one for the body: write instance: {next(iter(by_name))} next to the "
            "file name",
        )
    return named[0] if named else None


def _same(one: str, other: str) -> bool:
    return one.casefold() == other.casefold()


class _Deck:
    """Content of an ABAQUS file as far as it has been read.

    Names and labels are resolved at the end of the file. moves: True if the body is placed as its
    instance is. reduces: True if mid-side nodes are left out.
    """

    def __init__(self, path: Path, *, moves: bool, reduces: bool) -> None:
        self.path, self.moves, self.reduces = path, moves, reduces
        self.scope = BODY
        self.owners: dict[str, Card] = {}
        self.coordinates: list[list[float]] = []
        self.node_labels: list[int] = []
        self.corners: list[list[int]] = []
        self.corner_lines: list[int] = []
        self.midside: list[int] = []
        self.types: list[str] = []
        self.element_type = ("", 0)
        self.nodes, self.elements = Sets("node"), Sets("element")
        self.surfaces: dict[Key, NamedSet] = {}
        self.skipped: dict[str, list[Card]] = {}

    def add(self, card: Card) -> None:
        """Process the next card of the file."""
        match card.keyword:
            case "NODE":
                self._add_nodes(card)
            case "ELEMENT":
                self._add_elements(card)
            case "NSET" | "ELSET":
                card.allow(_SET_PARAMETERS)
                sets = self.nodes if card.keyword == "NSET" else self.elements
                define(sets.named, self.scope, card, card.keyword).cards.append((self.scope, card))
            case "SURFACE":
                self._add_surface(card)
            case "PART" | "INSTANCE":
                self._add_owner(card)
            case "ASSEMBLY" | "END INSTANCE":
                self.scope = ASSEMBLY
            case "END ASSEMBLY" | "END PART":
                self.scope = BODY
            case keyword if keyword in _REFUSED:
                raise card.fault(f"*{keyword} is not supported", hint=_REFUSED[keyword])
            case keyword if keyword not in _WITHOUT_MEANING:
                self.skipped.setdefault(keyword, []).append(card)

    def _add_owner(self, card: Card) -> None:
        """Register a part or an instance, whose nodes and sets follow."""
        name = card.parameter("NAME")
        before = self.owners.get(card.keyword)
        if before is not None:
            raise card.fault(
                f"a second {card.keyword.lower()}, '{name}', beside '{before.parameter('NAME')}'",
                hint="a mesh file can hold one body: write one file for each",
            )
        for line, text in card.rows:
            if not self.moves and any(card.real(value, line) for value in fields(text)):
                raise card.fault(
                    f"the instance '{name}' is placed away from the position of its part",
                    hint=f"write instance: {name} next to the file name to use its position in "
                    "the assembly, or remove this line; `position` moves a body in the scene",
                    line=line,
                )
        self.owners[card.keyword], self.scope = card, BODY
        self.nodes.instance = self.elements.instance = name

    def _add_nodes(self, card: Card) -> None:
        card.allow({"NSET"})
        known, before = self.nodes.numbers[self.scope], len(self.coordinates)
        for line, text in card.rows:
            row = fields(text)
            label = card.integer(row[0], line, "node number")
            if len(row) not in (3, 4):
                raise card.fault(
                    f"node {label} has {len(row) - 1} coordinates; 2 or 3 are needed", line=line
                )
            if label in known:
                raise card.fault(f"node {label} is defined twice", line=line)
            known[label] = len(self.coordinates)
            place = [card.real(value, line) for value in row[1:]]
            self.coordinates.append(place if len(place) == 3 else [*place, 0.0])
            self.node_labels.append(label)
        self._collect(self.nodes, card, "NSET", range(before, len(self.coordinates)))

    def _add_elements(self, card: Card) -> None:
        kind, count = self._element_type(card)
        corners = CORNERS[kind]
        card.allow({"TYPE", "ELSET"})
        known, before = self.elements.numbers[BODY], len(self.corners)
        for line, row in _element_rows(card, count + 1):
            label = card.integer(row[0], line, "element number")
            if len(row) != count + 1:
                raise card.fault(
                    f"element {label} has {len(row) - 1} nodes; {card.parameter('TYPE')} has "
                    f"{count}",
                    line=line,
                )
            if label in known:
                raise card.fault(f"element {label} is defined twice", line=line)
            known[label] = len(self.corners)
            nodes = [card.integer(node, line, "node number") for node in row[1:]]
            self.corners.append(nodes[:corners])
            self.midside += nodes[corners:]
            self.corner_lines.append(line)
            self.types.append(kind)
        self._collect(self.elements, card, "ELSET", range(before, len(self.corners)))

    def _collect(self, sets: Sets, card: Card, parameter: str, members: range) -> None:
        """Add the definitions of a card to the set that it names, if it names one."""
        if parameter in card.parameters:
            found = define(sets.named, self.scope, card, parameter)
            found.cards.append((self.scope, card))
            found.members.extend(members)

    def _element_type(self, card: Card) -> tuple[str, int]:
        """Return the type of the card's elements and the number of nodes that it lists of each.

        The family must be that of all the others.
        """
        written = card.parameter("TYPE").upper()
        kind = supported(written)
        count = CORNERS.get(kind, 0)
        if not kind and self.reduces:
            kind, count = reduced(written)
        if not kind:
            raise card.fault(*refusal(written))
        if self.scope == ASSEMBLY:
            raise card.fault(
                "elements of the assembly itself", hint="put them between *PART and *END PART"
            )
        first, line = self.element_type
        if first and dimension(first) != dimension(kind):
            raise card.fault(
                f"mixed dimensions: elements of type {written} and of type {first} (line {line})",
                hint="a body is either 2D or 3D: write one file for each",
            )
        if first and family(first) != family(kind):
            raise card.fault(
                f"mixed formulations: elements of type {written} and of type {first} (line {line})",
                hint=f"use element types {family(first)} for the whole body, or {family(kind)}",
            )
        self.element_type = (first or kind, line or card.line)
        return kind, count

    def _add_surface(self, card: Card) -> None:
        card.allow({"NAME", "TYPE", "INTERNAL"})
        surface = define(self.surfaces, self.scope, card, "NAME")
        if surface.cards:
            raise card.fault(
                f"the surface '{surface.name}' is defined twice, first in line "
                f"{surface.cards[0][1].line}"
            )
        if _surface_type(card) not in ("ELEMENT", "NODE"):
            raise card.fault(
                f"the surface '{surface.name}' has TYPE={_surface_type(card)}",
                hint="a surface of the body has TYPE=ELEMENT or TYPE=NODE",
            )
        surface.cards.append((self.scope, card))

    def content(self) -> Content:
        """Return the content read, with the members of sets and surfaces resolved.

        Raises MeshError as `read_abaqus` does.
        """
        if not self.corners:
            raise MeshError(
                f"{self.path}: contains no elements", hint="a body is made of " + ", ".join(CORNERS)
            )
        for keyword in _CONSTRAINTS.keys() & self.skipped.keys():
            card = self.skipped[keyword][0]
            log.warning(
                "%s:%d: *%s is not read, its nodes move without it: %s",
                *(self.path, card.line, keyword, _CONSTRAINTS[keyword]),
            )
        cells = self._cells()
        for found in self.nodes.named.values():
            self._add_nodes_of_elements(found, cells)
        sets_of_assembly = _names_in_assembly(self.nodes.named, self.elements.named)
        node_sets, cell_sets = (
            {
                self._full_name(key, found, sets_of_assembly): sets.members(key)
                for key, found in sets.named.items()
                if not found.internal
            }
            for sets in (self.nodes, self.elements)
        )
        facet_sets = {}
        surfaces_of_assembly = _names_in_assembly(self.surfaces)
        for key, surface in self.surfaces.items():
            if surface.internal:
                continue
            name = self._full_name(key, surface, surfaces_of_assembly)
            scope, card = surface.cards[0]
            if not card.rows:
                raise card.fault(f"the surface '{name}' is empty")
            if _surface_type(card) == "ELEMENT":
                facet_sets[name] = self._facets(scope, card, cells)
            elif name in node_sets:
                raise card.fault(f"'{name}' is both a node set and a surface of nodes: rename one")
            else:
                node_sets[name] = self._surface_nodes(scope, card)
        return Content(
            points=self._points(),
            cells=cells,
            dimension=dimension(self.element_type[0]),
            node_sets=node_sets,
            facet_sets=facet_sets,
            cell_sets=cell_sets,
            element_type=self.element_type[0],
            reference_nodes=np.array(list(self.nodes.numbers[ASSEMBLY].values()), dtype=np.int64),
            midside_nodes=self._midside_nodes(),
            labels=Labels(np.array(self.node_labels), np.array(list(self.elements.numbers[BODY]))),
            not_read=tuple(_skipped(keyword, found) for keyword, found in self.skipped.items()),
        )

    def _points(self) -> np.ndarray:
        """Return all nodes (n, 3), those of the body where its instance stands."""
        points = np.array(self.coordinates)
        if "INSTANCE" in self.owners:
            of_body = list(self.nodes.numbers[BODY].values())
            points[of_body] = _placed(points[of_body], self.owners["INSTANCE"])
        return points

    def _midside_nodes(self) -> np.ndarray:
        known = self.nodes.numbers[BODY]
        numbers = [known[label] for label in self.midside if label in known]
        return np.unique(np.array(numbers, dtype=np.int64))

    def _cells(self) -> np.ndarray:
        blocks = [(rows, self._nodes_of(rows)) for rows in self._by_corners()]
        order = np.argsort(np.concatenate([rows for rows, _ in blocks]))
        kind = dimension(self.element_type[0])
        return of_one_kind([nodes for _, nodes in blocks], kind)[order]

    def _by_corners(self) -> list[np.ndarray]:
        """Return the numbers of the elements, grouped by their number of corners."""
        counts = np.array([len(corners) for corners in self.corners])
        return [np.flatnonzero(counts == count) for count in np.unique(counts)]

    def _nodes_of(self, rows: np.ndarray) -> np.ndarray:
        """Return the node numbers (k, corners) of elements with the same number of corners."""
        known = self.nodes.numbers[BODY]
        nodes = np.array([[known.get(node, -1) for node in self.corners[row]] for row in rows])
        missing = np.argwhere(nodes < 0)
        if len(missing):
            row, corner = rows[missing[0][0]], missing[0][1]
            label = list(self.elements.numbers[BODY])[row]
            raise MeshError(
                f"{self.path}:{self.corner_lines[row]}: element {label} has the node "
                f"{self.corners[row][corner]}, which does not exist"
            )
        return nodes

    def _add_nodes_of_elements(self, found: NamedSet, cells: np.ndarray) -> None:
        """Resolve *NSET, ELSET=: the nodes of all elements in a set."""
        for scope, card in found.cards:
            if card.keyword == "NSET" and "ELSET" in card.parameters:
                chosen = self.elements.listed(scope, card, card.line, [card.parameter("ELSET")])
                found.members.extend(cells[chosen].ravel().tolist())

    def _full_name(self, key: Key, found: NamedSet, taken: set[str]) -> str:
        scope, name = key
        if scope == ASSEMBLY or name not in taken:
            return found.name
        return f"{self.nodes.instance}.{found.name}"

    def _surface_nodes(self, scope: str, card: Card) -> np.ndarray:
        # What stands behind a node or its set is an area.
        rows = [self.nodes.listed(scope, card, line, fields(text)[:1]) for line, text in card.rows]
        return np.unique(np.concatenate(rows))

    def _facets(self, scope: str, card: Card, cells: np.ndarray) -> np.ndarray:
        """Return the node numbers (k, corners) of the facets in a surface of elements."""
        kind = dimension(self.element_type[0])
        parts = []
        for line, text in card.rows:
            owner, *face = fields(text)
            # A row without elements means all of them.
            listed = self.elements.listed(scope, card, line, [owner])
            chosen = listed if owner else np.arange(len(cells))
            if face:
                parts += self._faces(chosen, face[0].upper(), card, line)
            else:
                parts.append(_free_facets(cells[chosen], cells, kind))
        facets = of_one_kind(parts, 2)
        if not len(facets):
            raise card.fault(
                f"the surface '{card.parameter('NAME')}' is empty: its elements have no free face"
            )
        return facets

    def _faces(self, chosen: np.ndarray, name: str, card: Card, line: int) -> list[np.ndarray]:
        """Return the node numbers (k, corners) of face S1, S2 ... of each chosen element."""
        found = []
        for rows in self._by_corners():
            of_kind = np.intersect1d(chosen, rows)
            if not len(of_kind):
                continue
            element_type = self.types[of_kind[0]]
            faces = FACES[dimension(element_type), CORNERS[element_type]]
            names = [f"S{number}" for number in range(1, len(faces) + 1)]
            if name not in names:
                raise card.fault(
                    f"elements {element_type} have no face '{name}'",
                    hint="its faces are " + ", ".join(names),
                    line=line,
                )
            found.append(self._nodes_of(of_kind)[:, faces[names.index(name)]])
        return found


def _placed(points: np.ndarray, instance: Card) -> np.ndarray:
    """Return points (n, 3) where an instance has them.

    They are shifted by its first row, then rotated about the axis through both points of its second
    row, by the angle [deg] at its end.
    """
    rows = [[instance.real(value, line) for value in fields(t)] for line, t in instance.rows]
    shift, axis = ([*row, *[0.0] * n][:n] for row, n in zip([*rows, [], []], (3, 7), strict=False))
    placed = points + np.array(shift)
    start, along = np.array(axis[:3]), np.array(axis[3:6]) - np.array(axis[:3])
    if axis[6] == 0.0:
        return placed
    if not along.any():
        raise instance.fault(
            f"the instance '{instance.parameter('NAME')}' is turned about an axis of zero length",
            hint="its second row must hold two points of the axis and the angle in degrees",
            line=instance.rows[1][0],
        )
    turn = Rotation.from_rotvec(np.radians(axis[6]) * along / np.linalg.norm(along))
    return np.asarray(start + turn.apply(placed - start))


def _skipped(keyword: str, found: list[Card]) -> str:
    """Return a description of the skipped cards of a keyword: their names, else their lengths."""
    names = [card.parameters["NAME"] for card in found if card.parameters.get("NAME")]
    if names:
        return f"*{keyword} {', '.join(names)}"
    lines = sum(len(card.rows) for card in found)
    return f"*{keyword} ({lines} line{'s' if lines > 1 else ''})" if lines else f"*{keyword}"


def _element_rows(card: Card, length: int) -> Iterator[tuple[int, list[str]]]:
    """Yield line and fields of each element; a row that ends with a comma too early continues."""
    row: list[str] = []
    for line, text in card.rows:
        row += fields(text)
        if text.endswith(",") and len(row) < length:
            continue
        yield line, row
        row = []
    if row:
        yield card.rows[-1][0], row


def _free_facets(chosen: np.ndarray, cells: np.ndarray, dimension: int) -> np.ndarray:
    """Return the facets of the chosen cells that no other cell has."""
    facets, _ = cell_facets(chosen, dimension)
    boundary = facet_keys(boundary_facets(cells, dimension))
    return facets[find_rows(facet_keys(facets), boundary) >= 0]


def _surface_type(card: Card) -> str:
    return card.parameters.get("TYPE", "ELEMENT").upper()


def _names_in_assembly(*named: dict[Key, NamedSet]) -> set[str]:
    return {name for scope, name in chain(*named) if scope == ASSEMBLY}
