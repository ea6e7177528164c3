"""Text of an ABAQUS input file: keyword lines with their parameters and data rows."""

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from softsim.errors import MeshError

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
