"""Bodies from ABAQUS input files (.inp): nodes, linear elements, sets, surfaces."""

import logging
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from softsim.errors import MeshError
from softsim.mesh.content import Content
from softsim.mesh.mesh import (
    boundary_facets,
    cell_facets,
    facet_keys,
    find_rows,
    of_one_kind,
)
from softsim.mesh.quality import Labels

# -------------------------------------------------------------------------------------------------
# Text of an ABAQUS input file: keyword lines with their parameters and data rows.

# A comma with an even number of quotes behind it is outside any quotes.
_OUTER_COMMA = re.compile(r',(?=(?:[^"]*"[^"]*")*[^"]*$)')

_SETS = {"NSET": "NSET", "ELSET": "ELSET", "SURFACE": "NAME"}
"""Keywords of sets and surfaces -> the parameter that names them."""


@dataclass(frozen=True)
class Card:
    """Keyword line and the rows below it.

    keyword: upper case, without the star, single spaces. parameters: upper-case name -> value, ""
    where there is none; values and rows as written. rows: (line number, text).
    """

    path: Path
    line: int
    keyword: str
    parameters: dict[str, str]
    rows: list[tuple[int, str]] = field(default_factory=list)

    def fault(self, message: str, hint: str = "", line: int | None = None) -> MeshError:
        """Return the error to raise about this card, or about one of its rows."""
        return MeshError(f"{self.path}:{line or self.line}: {message}", hint=hint)

    def parameter(self, name: str) -> str:
        """Return the value of a required parameter. Raises MeshError if it is missing."""
        value = self.parameters.get(name, "")
        if not value:
            raise self.fault(f"*{self.keyword} needs {name}=")
        return value

    def allow(self, names: Collection[str]) -> None:
        """Raise MeshError if there is a parameter besides these: it would change the meaning."""
        for name in self.parameters:
            if name not in names:
                raise self.fault(
                    f"the parameter {name} of *{self.keyword} is not supported",
                    hint="supported: " + ", ".join(sorted(names)),
                )

    def integer(self, text: str, line: int, what: str) -> int:
        """Return the number in a field. Raises MeshError, naming `what` it should be."""
        try:
            return int(text)
        except ValueError:
            raise self.fault(f"'{text}' is not a {what}", line=line) from None

    def real(self, text: str, line: int) -> float:
        """Return the number in a field, 0 if it is empty; Fortran's 1.5D-3 is accepted."""
        try:
            return float(text.upper().replace("D", "E")) if text else 0.0
        except ValueError:
            raise self.fault(f"'{text}' is not a number", line=line) from None


def cards(path: Path) -> Iterator[Card]:
    """Return the cards of a file, without comments and empty lines.

    Raises MeshError if the file cannot be read or has data before the first keyword.
    """
    card: Card | None = None
    keyword, first = "", 0
    for line, text in _lines(path):
        if text.startswith("*"):
            if keyword:
                card = _card(path, first, keyword)
            if card:
                yield card
            card, keyword, first = None, text, line
        elif keyword.endswith(","):
            keyword += text
        elif keyword:
            card, keyword = _card(path, first, keyword), ""
            card.rows.append((line, text))
        elif card:
            card.rows.append((line, text))
        else:
            raise MeshError(
                f"{path}:{line}: data before the first keyword",
                hint="an ABAQUS input file begins with a line such as *HEADING or *NODE",
            )
    if keyword:
        card = _card(path, first, keyword)
    if card:
        yield card


def of_instance(found: list[Card], instance: Card) -> list[Card]:
    """Return the cards of a file that describe one of its instances, and those outside of parts.

    Left out are other parts and instances, sets of these, what sets and surfaces of the assembly
    take from them, and sets and surfaces that hold nothing else.
    """
    name, part = instance.parameter("NAME").casefold(), instance.parameter("PART").casefold()
    others = {
        card.parameter("NAME").casefold() + "." for card in found if card.keyword == "INSTANCE"
    } - {name + "."}
    own, of_assembly, block = [], [], None
    for card in found:
        if card.keyword in ("PART", "INSTANCE"):
            block = card
        if block is None and card.keyword in _SETS:
            of_assembly.append(card)
        elif block in (None, instance) or (
            block.keyword == "PART" and block.parameter("NAME").casefold() == part
        ):
            own.append(card)
        if card.keyword in ("END PART", "END INSTANCE"):
            block = None
    kept = [c for c in of_assembly if c.parameters.get("INSTANCE", name).casefold() == name]
    foreign, before = _named(of_assembly) - _named(kept), -1
    while len(foreign) > before:
        before = len(foreign)
        rest = [_without(card, others, foreign) for card in kept]
        kept = [new for card, new in zip(kept, rest, strict=True) if new.rows or not card.rows]
        foreign = _named(of_assembly) - _named(kept)
    return sorted(own + kept, key=lambda card: card.line)


def _named(found: list[Card]) -> set[tuple[str, str]]:
    """Return keyword and name of each set and surface that cards define."""
    return {
        (card.keyword, card.parameters.get(_SETS[card.keyword], "").casefold()) for card in found
    }


def _without(card: Card, others: set[str], foreign: set[tuple[str, str]]) -> Card:
    """Return a set or surface without the members that it takes from other instances."""
    of_nodes = card.keyword == "NSET" or card.parameters.get("TYPE", "").upper() == "NODE"
    kind = "NSET" if of_nodes else "ELSET"

    def is_foreign(member: str) -> bool:
        member = member.casefold()
        return (kind, member) in foreign or any(member.startswith(other) for other in others)

    if card.keyword == "SURFACE":
        rows = [(n, text) for n, text in card.rows if not is_foreign(fields(text)[0])]
        return replace(card, rows=rows)
    left = [(n, [m for m in fields(text) if not is_foreign(m)]) for n, text in card.rows]
    return replace(card, rows=[(n, ", ".join(members)) for n, members in left if members])


def fields(text: str) -> list[str]:
    """Return the fields between commas, without blanks and quotes around them.

    A comma at the end begins no further field.
    """
    if '"' in text:
        parts = [part.replace('"', "").strip() for part in _OUTER_COMMA.split(text)]
    else:
        parts = [part.strip() for part in text.split(",")]
    if len(parts) > 1 and not parts[-1]:
        parts.pop()
    return parts


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    try:
        # Headings and comments may be in any 8-bit encoding; nothing else is beyond ASCII.
        text = path.read_text(encoding="utf-8-sig", errors="replace")
    except OSError as fault:
        raise MeshError(f"{path}: cannot be read ({fault.strerror})") from fault
    for number, line in enumerate(text.split("\n"), start=1):
        stripped = line.strip()
        if stripped and not stripped.startswith("**"):
            yield number, stripped


def _card(path: Path, line: int, text: str) -> Card:
    keyword, *rest = fields(text)
    parameters = {}
    for part in rest:
        name, _, value = part.partition("=")
        parameters[" ".join(name.upper().split())] = value.strip()
    return Card(path, line, " ".join(keyword[1:].upper().split()), parameters)


# -------------------------------------------------------------------------------------------------
# Element types of ABAQUS: the supported ones, and replacements for the others.

CORNERS = {
    "CPE3": 3, "CPE4": 4, "CPE4R": 4, "CPE4I": 4,
    "CPS3": 3, "CPS4": 4, "CPS4R": 4, "CPS4I": 4,
    "CAX3": 3, "CAX4": 4, "CAX4R": 4, "CAX4I": 4,
    "C3D4": 4, "C3D5": 5, "C3D6": 6, "C3D8": 8, "C3D8R": 8, "C3D8I": 8,
}  # fmt: skip
"""Nodes of an element type; each may have an H (hybrid) behind it."""

FACES = {
    (2, 3): [[0, 1], [1, 2], [2, 0]],
    (2, 4): [[0, 1], [1, 2], [2, 3], [3, 0]],
    (3, 4): [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]],
    (3, 5): [[0, 1, 2, 3], [0, 4, 1], [1, 4, 2], [2, 4, 3], [3, 4, 0]],
    (3, 6): [[0, 1, 2], [3, 5, 4], [0, 3, 4, 1], [1, 4, 5, 2], [2, 5, 3, 0]],
    (3, 8): [
        *([0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1]),
        *([1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]),
    ],
}
"""Faces S1, S2 ... in the order of ABAQUS, by the numbers of dimensions and of corners."""

_LINEAR = {
    family: [name for name in CORNERS if name.startswith(family)]
    for family in ("CPE", "CPS", "CAX", "C3D")
}
_PLANE_SHAPES = {6: "second-order triangles", 8: "second-order quadrilaterals"}
_SOLID_SHAPES = {
    10: "second-order tetrahedra",
    15: "second-order wedges",
    20: "second-order hexahedra",
}
_CORNERS_OF_SECOND_ORDER = {"plane": {6: 3, 8: 4}, "C3D": {10: 4, 15: 6, 20: 8}}


def supported(written: str) -> str:
    """Return the type without its H, or "" if it is not supported.

    A hybrid element is computed as the type without H.
    """
    name = written.upper().removesuffix("H")
    return name if name in CORNERS else ""


def reduced(written: str) -> tuple[str, int]:
    """Return the linear type with the corners of a second-order type, C3D4 for C3D10M.

    Also return the number of nodes of the latter; ("", 0) for any other type.
    """
    kind, count = _parts(written)
    corners = _CORNERS_OF_SECOND_ORDER["C3D" if kind == "C3D" else "plane"].get(count)
    return (f"{kind}{corners}", count) if kind and corners else ("", 0)


def family(element_type: str) -> str:
    """Return the family of a type: CPE, CPS, CAX or C3D."""
    return element_type[:3]


def dimension(element_type: str) -> int:
    """Return the number of dimensions, 2 or 3, of a supported type's elements."""
    return 3 if family(element_type) == "C3D" else 2


def refusal(written: str) -> tuple[str, str]:
    """Return message and hint for an unsupported element type."""
    kind, count = _parts(written)
    shapes = _SOLID_SHAPES if kind == "C3D" else _PLANE_SHAPES
    shape = f", {shapes[count]}," if kind and count in shapes else ""
    message = f"elements of type {written.upper()}{shape} are not supported"
    if reduced(written)[0]:
        return message, (
            "write reduce_order: true next to the file name to drop their mid-side nodes, or "
            "mesh the part with linear elements: " + ", ".join(_LINEAR[kind])
        )
    if kind:
        return message, "mesh the part with linear elements: " + ", ".join(_LINEAR[kind])
    known = ", ".join(CORNERS)
    return message, f"a body consists of {known} (each also hybrid, H); remove all others"


def plane_stress_advice(element_type: str, formulation: str) -> str:
    """Return the advice which elements replace plane-stress ones in a body of this formulation."""
    rest = element_type.removeprefix("CPS")
    return {
        "plane_strain": f"for a thin section without strain in the depth direction use CPE{rest}",
        "ring_section": f"for the section of a ring_section use CPE{rest}; its sector is a key of "
        "the body",
        "axisymmetric": f"for the half section of a body of revolution use CAX{rest}",
        "solid": f"use a 3D mesh of C3D4 or C3D8R, or a section of CPE{rest} with formulation: "
        "plane_strain",
    }[formulation]


def _parts(written: str) -> tuple[str, int]:
    """Return family and number of nodes of a name such as C3D10M; ("", 0) for another name."""
    found = re.match(r"(CPE|CPS|CAX|C3D)(\d+)", written.upper())
    return (found[1], int(found[2])) if found else ("", 0)


# -------------------------------------------------------------------------------------------------
# Sets of an ABAQUS input file, with members by number, by range and by name.

log = logging.getLogger(__name__)

BODY, ASSEMBLY = "body", "assembly"
"""Scopes of a number or a name: the part (with its instance), or the assembly."""

Key = tuple[str, str]
"""Scope and casefolded name of a set; part and assembly may have sets of the same name."""


@dataclass
class NamedSet:
    """Set or surface as far as it has been read.

    cards: with the scope of each. members: further numbers of the set. internal: True if ABAQUS/CAE
    marks it as one that only surfaces need.
    """

    name: str
    cards: list[tuple[str, Card]] = field(default_factory=list)
    members: list[int] = field(default_factory=list)
    internal: bool = False


def define(named: dict[Key, NamedSet], scope: str, card: Card, parameter: str) -> NamedSet:
    """Return the set that the card's parameter names, created if it is new.

    Raises MeshError if the parameter is missing.
    """
    name = card.parameter(parameter)
    found = named.setdefault((scope, name.casefold()), NamedSet(name))
    found.internal |= "INTERNAL" in card.parameters
    return found


class Sets:
    """All sets of nodes, or all sets of elements.

    kind: "node" or "element", for messages. numbers: scope -> label in the file -> number from 0.
    named: the sets. instance: name of the instance, "" if there is none.
    """

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self.numbers: dict[str, dict[int, int]] = {BODY: {}, ASSEMBLY: {}}
        self.named: dict[Key, NamedSet] = {}
        self.instance = ""

    def members(self, key: Key, within: tuple[Key, ...] = ()) -> np.ndarray:
        """Return the numbers (k,) of the set's members, in increasing order.

        within: the sets that contain this one. Raises MeshError if the set is empty or contains
        itself, or if a member does not exist.
        """
        found = self.named[key]
        first = found.cards[0][1]
        if key in within:
            raise first.fault(f"the {self.kind} set '{found.name}' contains itself")
        parts = [np.array(found.members, dtype=np.int64)]
        for scope, card in found.cards:
            if card.keyword not in ("NSET", "ELSET"):
                continue
            for line, text in card.rows:
                if "GENERATE" in card.parameters:
                    parts.append(self._generated(scope, card, line, text))
                else:
                    row = fields(text)
                    parts.append(self.listed(scope, card, line, row, (*within, key)))
        members = np.unique(np.concatenate(parts))
        if not len(members):
            raise first.fault(
                f"the {self.kind} set '{found.name}' is empty",
                hint="give it members or leave it out",
            )
        return members

    def listed(
        self, scope: str, card: Card, line: int, row: list[str], within: tuple[Key, ...] = ()
    ) -> np.ndarray:
        """Return the numbers (k,) of the members in a row of labels and names of sets.

        Raises MeshError if one of them does not exist.
        """
        parts = [np.zeros(0, dtype=np.int64)]
        for written in filter(None, row):
            place, member = self._place(scope, written)
            if member.isdigit():
                numbers = self._numbers(place, card)
                if int(member) not in numbers:
                    raise card.fault(f"there is no {self.kind} {written}", line=line)
                parts.append(np.array([numbers[int(member)]]))
            else:
                inside = self._key(place, member)
                if inside is None:
                    raise card.fault(
                        f"there is no {self.kind} set '{written}'",
                        hint="there are: " + ", ".join(s.name for s in self.named.values()),
                        line=line,
                    )
                parts.append(self.members(inside, within))
        return np.concatenate(parts)

    def _generated(self, scope: str, card: Card, line: int, text: str) -> np.ndarray:
        """Return the numbers of the members from a first to a last label, without missing ones."""
        row = [card.integer(value, line, f"{self.kind} number") for value in fields(text)]
        if len(row) not in (2, 3) or (len(row) == 3 and row[2] < 1):
            raise card.fault(
                f"the row '{text}' generates no members",
                hint="GENERATE takes rows such as 1, 9, 2: first, last, increment",
                line=line,
            )
        first, last = row[:2]
        step = row[2] if len(row) == 3 else 1
        numbers = self._numbers(scope, card)
        labels = np.fromiter(numbers, dtype=np.int64, count=len(numbers))
        chosen = (labels >= first) & (labels <= last) & ((labels - first) % step == 0)
        asked = max(last - first + step, 0) // step
        if chosen.sum() < asked:
            log.warning(
                "%s:%d: '%s': %d of these %d %ss do not exist and are ignored",
                *(card.path, line, text, asked - chosen.sum(), asked, self.kind),
            )
        return np.fromiter(numbers.values(), dtype=np.int64, count=len(numbers))[chosen]

    def _place(self, scope: str, written: str) -> tuple[str, str]:
        """Return scope and name of a member; INSTANCE.NAME means the part's in any scope."""
        owner, _, member = written.partition(".")
        if member and self.instance and owner.casefold() == self.instance.casefold():
            return BODY, member
        return scope, written

    def _numbers(self, scope: str, card: Card) -> dict[int, int]:
        """Return label -> number in the scope of a card: the assembly's if any, else the body's."""
        own = self.numbers[scope]
        return self.numbers[BODY] if "INSTANCE" in card.parameters or not own else own

    def _key(self, scope: str, name: str) -> Key | None:
        keys = [(scope, name.casefold()), (BODY, name.casefold())]
        return next((key for key in keys if key in self.named), None)


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
    those of CORNERS (hybrid or not) or of several families, several instances or a moved
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
