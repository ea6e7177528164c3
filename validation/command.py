"""The command: run the cases of some scripts, judge, draw, and write the page."""

import time
from collections.abc import Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from softsim.compute.machine import cores, processor, processor_count
from softsim.errors import SoftsimError
from validation import page
from validation.cases import DEVICE, Outcome, outcomes_by_name, run_cases
from validation.constants import CONSTANTS
from validation.digitised import Points, points_of
from validation.page import Section
from validation.script import Script

WIDTH = 140  # of tables where there is no terminal


def command(scripts: Sequence[Script]) -> None:
    """Read the command line and validate; exits with the code of the error that a user meets."""
    names = [script.name for script in scripts]

    def main(
        quick: Annotated[
            bool, typer.Option("--quick", help="A subset in five minutes on two cores.")
        ] = False,
        json: Annotated[Path | None, typer.Option(help="Write the rows here too.")] = None,
        only: Annotated[
            list[str] | None, typer.Option(help=f"Of: {', '.join(names)}; repeatable.")
        ] = None,
        workers: Annotated[
            int | None, typer.Option(min=1, help="Runs at a time; default: one a core.")
        ] = None,
        out: Annotated[Path, typer.Option(help="Folder of page, figures, cases.")] = Path(
            "runs/validation"
        ),
        digitised: Annotated[
            Path | None,
            typer.Option(
                help="Folder with digitised points of the figures, SCRIPT.csv each.",
                exists=True,
                file_okay=False,
            ),
        ] = None,
    ) -> None:
        """Compare the simulator with the thesis and with published measurements."""
        unknown = sorted(set(only or ()) - set(names))
        if unknown:
            raise typer.BadParameter(f"{', '.join(unknown)}: there is {', '.join(names)}")
        chosen = [script for script in scripts if not only or script.name in only]
        console = Console() if Console().is_terminal else Console(width=WIDTH)
        details = bool(only) or len(scripts) == 1
        try:
            everything = validate(chosen, quick, workers, out, digitised, console, details)
        except SoftsimError as error:
            Console(stderr=True).print(f"error: {error}", highlight=False, markup=False)
            raise typer.Exit(error.exit_code) from None
        if json is not None:
            page.write_json(json, everything)

    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command()(main)
    app()


def validate(
    scripts: Sequence[Script],
    quick: bool,
    workers: int | None,
    out: Path,
    digitised: Path | None,
    console: Console,
    details: bool = False,
) -> dict[str, Any]:
    """Run, judge, draw, write a page per evidence, validation.json and a PNG per script to `out`.

    details: print the sub-claims and remarks of all scripts too. Returns the content of the JSON
    file. Scripts whose data are absent, or that the quick subset leaves out, are skipped and named.

    Raises SoftsimError: a scene or a file of points is wrong, or a signal stopped it.
    """
    began = time.monotonic()
    out.mkdir(parents=True, exist_ok=True)
    reasons = {script.name: script.reason_to_skip(quick) for script in scripts}
    skipped = [reason for reason in reasons.values() if reason]
    scripts = [script for script in scripts if not reasons[script.name]]
    points = {script.name: points_of(digitised, script.name, script.columns) for script in scripts}
    wanted = [case for script in scripts for case in script.chosen(quick)]
    found = run_cases(wanted, out, workers or processor_count(), console)
    sections = [section(script, found, points[script.name], out) for script in scripts]
    about = {
        "total_time_s": round(time.monotonic() - began, 1),
        "core_time_of_cases_s": round(sum(_known_time(case) for case in found.values()), 1),
        "cases": len(found),
        "subset": "quick" if quick else "all",
        "device": f"{DEVICE}, {processor().name}, {cores(processor_count())}",
        "version": version("softsim"),
    }
    constants = [constant.described() for constant in CONSTANTS]
    everything = page.content(sections, about, constants, skipped)
    page.write_json(out / "validation.json", everything)
    page.show(console, sections, details)
    for sentence in skipped:
        console.print(sentence, highlight=False, markup=False)
    for path in page.write_pages(out, sections, everything):
        console.print(f"page {path}, {about['total_time_s']} s", highlight=False)
    return everything


def section(script: Script, found: dict[str, Outcome], points: Points | None, out: Path) -> Section:
    """Return the verdicts of a script, and draw its figure."""
    began = time.monotonic()
    outcomes = outcomes_by_name(script.cases(), found)
    rows = tuple(
        replace(row, script=script.name, model=row.model or script.model)
        for row in script.rows(outcomes, points)
    )
    remarks = tuple(script.remarks(outcomes))
    listings = tuple(script.listings(outcomes))
    figure = out / f"{script.name}.png"
    script.draw(outcomes, points, figure)
    time_of_cases = sum(_known_time(outcome) for outcome in outcomes.values())
    wall_time = time_of_cases + time.monotonic() - began
    return Section(script, rows, remarks, points is not None, figure, listings, wall_time)


def _known_time(outcome: Outcome) -> float:
    """Wall time of a case's run [s], of one core; zero where it failed."""
    return float(outcome.summary.get("wall_time", 0.0))
