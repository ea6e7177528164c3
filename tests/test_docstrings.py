"""Docstrings of softsim are complete statements, and no two of its classes have the same name."""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import softsim

PACKAGE = Path(softsim.__file__).parent
TESTS = Path(__file__).parent
NAMED_FILE = re.compile(r"(?<![\w.*-])(?:[a-z_]+/)*([a-z_]+\.py)\b")
FRAGMENT = re.compile(r"(What|Of|How|Whether|Where|Which|Who|Whose|That of|Those of)\b")


def docstrings(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield line and text of the docstrings of modules, classes, functions and constants."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        for before, statement in pairwise([None, *body]) if isinstance(body, list) else ():
            match statement:
                case ast.Expr(value=ast.Constant(value=str(text))) if before is None or isinstance(
                    before, ast.Assign | ast.AnnAssign
                ):
                    yield statement.lineno, text.strip()


def test_the_check_finds_fragments():
    source = (
        '"""What loads do."""\nLIMIT = 3\n"""Of an increment."""\ndef f():\n    """Return 1."""\n'
    )
    found = [line for line, text in docstrings(ast.parse(source)) if FRAGMENT.match(text)]
    assert found == [1, 3]


def test_no_docstring_is_a_fragment():
    found = [
        f"{path.relative_to(PACKAGE)}:{line}: {text.splitlines()[0]}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for line, text in docstrings(ast.parse(path.read_text(encoding="utf-8")))
        if FRAGMENT.match(text)
    ]
    assert found == []


def test_no_two_classes_have_the_same_name():
    names = Counter(
        node.name
        for path in PACKAGE.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ClassDef)
    )
    assert [name for name, count in names.items() if count > 1] == []


def test_files_that_docstrings_and_comments_name_exist():
    known = {
        path.name
        for folder in (PACKAGE, TESTS, TESTS.parent / "validation")
        for path in folder.rglob("*.py")
    }
    found = [
        f"{path.relative_to(PACKAGE)}: {name}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for name in NAMED_FILE.findall(path.read_text(encoding="utf-8"))
        if name not in known
    ]
    assert found == []
