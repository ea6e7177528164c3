"""The API page: its examples run, and each of its names has one."""

import doctest
import inspect
from pkgutil import resolve_name

import pytest
from pages import ROOT, blocks
from test_docs import CALLABLE

PAGE = ROOT / "docs" / "reference" / "api.md"
NAMES = CALLABLE.findall(PAGE.read_text())
SECTIONS = ("Parameters", "Attributes", "Returns", "Raises", "Notes", "Examples")


class Checker(doctest.OutputChecker):
    """Ignore what a statement prints where an example shows no output, such as progress."""

    def check_output(self, want, got, optionflags):
        return not want or super().check_output(want, got, optionflags)


def examples(name):
    """The example in the docstring of a public name."""
    public = resolve_name(name)
    return doctest.DocTestParser().get_doctest(inspect.getdoc(public), {}, name, name, 0)


@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_has_an_example_and_its_parameters(name):
    text = inspect.getdoc(resolve_name(name))
    assert examples(name).examples
    if not inspect.ismodule(resolve_name(name)):
        assert "\nParameters\n---" in text or "\nAttributes\n---" in text
    headings = [line for line, rule in zip(text.splitlines(), text.splitlines()[1:], strict=False)
                if rule and set(rule) == {"-"}]  # fmt: skip
    assert set(headings) <= set(SECTIONS)
    assert headings == sorted(headings, key=SECTIONS.index)


@pytest.mark.physics
@pytest.mark.parametrize("name", NAMES)
def test_the_example_of_a_public_name_runs(name, tmp_path, kernel_cache, monkeypatch):
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    monkeypatch.chdir(tmp_path)
    for file, text in zip(("block.yaml", "two_steps.yaml"), blocks(PAGE, "yaml"), strict=True):
        (tmp_path / file).write_text(text)
    told = []
    runner = doctest.DocTestRunner(Checker(), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert runner.run(examples(name), out=told.append).failed == 0, "".join(told)
