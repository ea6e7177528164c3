"""Sets of an ABAQUS input file, with members by number, by range and by name."""

import logging
from dataclasses import dataclass, field

import numpy as np

from softsim.mesh.abaqus_cards import Card, fields

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
