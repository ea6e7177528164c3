"""Commands that draw the figures, the page and the film of a folder."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from softsim.applications import DRAWINGS, entry
from softsim.errors import Interrupted, OutputError, RunError
from softsim.interruption import interrupted_by_signals
from softsim.options import explained


def report(folder: Annotated[Path, typer.Argument(help="Folder of a run or a study.")]) -> None:
    """Redraw the figures of a run or a study and rewrite its page, report.html.

    Folders of `chain` and `reach` have a figure and no page.
    """
    with explained() as console, drawing_can_stop(folder):
        from softsim.output.folder import is_study

        if is_study(folder):
            report_study(folder, console)
        elif figure := redrawn(folder):
            console.print(f"figure  {figure}", highlight=False)
        elif runs := [of_run for of_run in run_folders(folder) if has_run(of_run)]:
            for of_run in runs:
                report_run(of_run, console)
            report_steps(folder, console)
        else:
            raise OutputError(
                f"{folder} is not the folder of a run or a study",
                hint="name a folder that softsim run, assess, reach, chain, sweep or optimize "
                "has written",
            )


def render(
    folder: Annotated[Path, typer.Argument(help="Folder of a run.")],
    out: Annotated[
        Path | None,
        typer.Option(help="Film file, .gif or .mp4; default: film.gif in the run folder."),
    ] = None,
    field: Annotated[
        str | None,
        typer.Option(help="Field shown by colours; default: that of the snapshots."),
    ] = None,
    frames: Annotated[int, typer.Option(min=2, help="Maximum number of pictures.")] = 120,
    rate: Annotated[int, typer.Option(min=1, max=60, help="Pictures per second.")] = 15,
) -> None:
    """Make a film from the stored frames of a run.

    The key `output.frame_interval` of the scene sets the number of stored frames.
    """
    with explained() as console:
        from softsim.output.folder import read_summary
        from softsim.report.figures import WRITERS, draw_film, recorded

        path = out or folder / "film.gif"
        if path.suffix not in WRITERS:
            known = " or ".join(WRITERS)
            raise typer.BadParameter(f"{path} must end in {known}", param_hint="--out")
        run = recorded(folder)
        shown = field or read_summary(folder).get("snapshot_field", "stretch")
        with drawing_can_stop(folder, "render"):
            count = draw_film(run, shown, rate, frames, path)
        console.print(f"film    {path}, {count} pictures", highlight=False)


@contextmanager
def ended_by(show: Callable[[], None]) -> Iterator[None]:
    """Call `show` after a run, including an aborted one, but not after a rejected input."""
    try:
        yield
    except RunError:
        show()
        raise
    show()


@contextmanager
def drawing_can_stop(folder: Path, command: str = "report") -> Iterator[None]:
    """Turn Ctrl-C and SIGTERM during drawing into Interrupted.

    Its hint names the command that draws the missing pictures.
    """
    with interrupted_by_signals():
        try:
            yield
        except KeyboardInterrupt as stop:
            raise Interrupted(
                f"stopped while pictures were drawn; the numerical results in {folder} are "
                "complete",
                hint=f"draw the missing pictures with: softsim {command} {folder}",
            ) from stop


def report_what_there_is(folder: Path, console: Console) -> None:
    """Draw the report of a run, unless it ended before t = 0."""
    from softsim.output.folder import read_summary

    if "increments" in read_summary(folder):
        report_run(folder, console)


def report_runs(folder: Path, console: Console) -> None:
    """Draw the report of a run, or of each of its steps and of all steps together."""
    with drawing_can_stop(folder):
        for of_run in run_folders(folder):
            report_what_there_is(of_run, console)
        report_steps(folder, console)


def report_steps(folder: Path, console: Console) -> None:
    """Draw the figure and the page of all steps, if the folder has steps."""
    from softsim.report.figures import draw_steps
    from softsim.report.page.run import write_steps_page

    if is_of_steps(folder):
        if figure := draw_steps(folder):
            console.print(f"figure  {figure}", highlight=False)
        console.print(f"page    {write_steps_page(folder)}", highlight=False)


def put_off_reports(folder: Path, console: Console) -> None:
    """Print, and append to the log of a run or each of its steps, how to draw its report later."""
    from softsim.output.folder import LOG

    for of_run in filter(has_run, run_folders(folder)):
        text = f"no figures and no page; draw them with: softsim report {of_run}"
        console.print(text, highlight=False, soft_wrap=True)
        with (of_run / LOG).open("a", encoding="utf-8") as log:
            log.write(f"{text}\n")


def run_folders(folder: Path) -> list[Path]:
    """Return the folder of a run, or those of its steps."""
    from softsim.output.folder import read_summary

    if not is_of_steps(folder):
        return [folder]
    return [folder / step["folder"] for step in read_summary(folder)["steps"]]


def is_of_steps(folder: Path) -> bool:
    """Return True if `folder` has one folder per step of a run."""
    from softsim.output.folder import read_summary

    return "steps" in read_summary(folder)


def has_run(folder: Path) -> bool:
    """Return True if `folder` has the history of a run."""
    return (folder / "history.csv").is_file()


def redrawn(folder: Path) -> Path | None:
    """Redraw the figure of an application and return it; None if the folder is not one of those."""
    figures = (entry(drawing)(folder) for drawing in DRAWINGS)
    return next((figure for figure in figures if figure is not None), None)


def report_run(folder: Path, console: Console) -> None:
    """Draw all figures and the page of a run folder; add their wall times to its summary."""
    from softsim.output.folder import SUMMARY, RunFolder, read_summary
    from softsim.report.figures import draw_all
    from softsim.report.page.run import write_run_page

    summary = read_summary(folder)
    began = time.monotonic()
    for figure in draw_all(folder, summary.get("snapshot_field", "stretch")):
        console.print(f"figure  {figure}", highlight=False)
    drawn = time.monotonic()
    console.print(f"page    {write_run_page(folder)}", highlight=False)
    if "wall_times" in summary:
        took = {"figures": drawn - began, "page": time.monotonic() - drawn}
        summary["wall_times"] |= took
        RunFolder(folder).write_json_atomic(SUMMARY, summary)


def report_study(folder: Path, console: Console) -> None:
    """Draw all figures and the page of a study's folder."""
    from softsim.report.study.plots import draw_study, write_study_page

    with drawing_can_stop(folder):
        for figure in draw_study(folder):
            console.print(f"figure  {figure}", highlight=False)
        console.print(f"page    {write_study_page(folder)}", highlight=False)
