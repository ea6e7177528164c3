"""What `softsim optimize` says in the end."""

import shlex
from pathlib import Path

from rich.console import Console

from softsim.errors import SoftsimError
from softsim.output.study_folder import TABLE_TEXT
from softsim.report.study.findings import Findings
from softsim.report.study.wording import best_in_words
from softsim.study.cases import Case
from softsim.study.loading import LoadedStudy


def print_best(study: LoadedStudy, folder: Path, console: Console) -> None:
    """The best trial, and the command that runs it alone. SoftsimError: there is none."""
    findings = Findings.read(folder)
    best = findings.best
    if best is None:
        raise SoftsimError(
            f"none of {len(findings.table)} trials has found what is sought",
            hint=f"the column reason of {folder / TABLE_TEXT} says of each that failed why",
        )
    case = study.case(best.case, {axis.name: best.values[axis.column] for axis in study.factors})
    words = best_in_words(findings)
    console.print(words, style="bold", highlight=False, markup=False, soft_wrap=True)
    console.print(run_command(case), highlight=False, markup=False, soft_wrap=True)


def run_command(case: Case) -> str:
    """What runs a case alone: its overrides, as one types them."""
    source = case.source
    words = ["softsim", "run", str(source.scene)]
    if source.robot is not None:
        words = ["softsim", "assess", str(source.scene), "--robot", source.robot]
    return shlex.join([*words, *(word for one in case.overrides for word in ("--set", one))])
