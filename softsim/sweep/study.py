"""Studies from Python: `softsim.Study`."""

import sys
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import polars

from softsim.errors import ClusterError
from softsim.report.study.figures import draw_study
from softsim.report.study.page import write_study_page
from softsim.study.cases import Case
from softsim.study.loading import load_study, study_from
from softsim.sweep.optimisation import optimize
from softsim.sweep.sweep import sweep
from softsim.sweep.worker_pool import WorkerPool, pool_for


class Study:
    """A scene, what varies in it, what is collected of each run.

    From a file, `Study("scenes/studies/deflation_rate.yaml", ["time.end=3 s"])`, or from the keys
    of one, `Study(scene="scenes/first_look.yaml", factors={...}, measures={...})`, with scene files
    relative to the current folder. Quantities are texts with units: "0.4 kPa".

    `run` and `optimize` start processes, which read the script that started them: a script calls
    them under `if __name__ == "__main__":`. A notebook shows their progress too.

    Raises SceneError where it is no study, with the place of what is wrong.
    """

    def __init__(
        self, file: Path | str | None = None, overrides: Sequence[str] = (), **keys: Any
    ) -> None:
        if (file is None) == (not keys) or (keys and overrides):
            raise TypeError(
                "a study comes from a file and overrides, or from keys: scene, set, factors, "
                "measures ..."
            )
        self.loaded = study_from(keys, Path()) if file is None else load_study(file, overrides)

    @property
    def cases(self) -> list[Case]:
        """All cases, in the order of the table; of a bisection those that it begins with."""
        return self.loaded.cases()

    def run(
        self,
        out: Path | str | None = None,
        workers: int | None = None,
        scheduler: str | None = None,
        device: str = "auto",
        batch: int = 1,
    ) -> polars.DataFrame:
        """Run what is not stored yet, and return the table, a row a case.

        out: folder, runs/STUDY by default. workers: processes, by default one a core; scheduler:
        address of a dask scheduler instead, whose workers share the disk. device: auto, cpu, cuda.
        batch: cases that a worker runs at once.

        Raises
        ------
        SceneError: a case is no scene. ClusterError, OutputError, DeviceError: workers, the disk or
        the device refuse. Interrupted: SIGINT or SIGTERM came; the same call goes on.
        """
        folder = Path(out or Path("runs") / self.loaded.path.stem)
        pool = _pool(folder, device, workers, scheduler)
        return sweep(self.loaded, folder, pool, device, batch)

    def optimize(
        self,
        out: Path | str | None = None,
        workers: int | None = None,
        scheduler: str | None = None,
        device: str = "auto",
        trials: int | None = None,
    ) -> polars.DataFrame:
        """Seek what the study says under `optimize`, and return the table, a row a trial.

        out: folder, runs/STUDY_optimum by default. trials: how many there are in the end, by
        default as many as the study says. The others, and what is raised, as for `run`.
        """
        folder = Path(out or Path("runs") / f"{self.loaded.path.stem}_optimum")
        pool = _pool(folder, device, workers, scheduler)
        return optimize(self.loaded, folder, pool, device, trials)

    def report(self, out: Path | str | None = None) -> Path:
        """Draw the figures, and write report.html, of what is in a folder so far; its path.

        out: folder of `run` or `optimize`, runs/STUDY by default. Raises OutputError: it holds no
        study.
        """
        folder = Path(out or Path("runs") / self.loaded.path.stem)
        draw_study(folder)
        return write_study_page(folder)


def _pool(
    folder: Path, device: str, workers: int | None, scheduler: str | None
) -> AbstractContextManager[WorkerPool]:
    if scheduler is None:
        refuse_unguarded_script()
    return pool_for(folder, device, workers, scheduler)


def refuse_unguarded_script() -> None:
    """A process that is started runs the main script once more, all but what is guarded: a study
    there would start processes in its turn.
    """
    script = getattr(sys.modules["__main__"], "__file__", None)
    if script is None or not Path(script).is_file():
        return
    if "__main__" not in Path(script).read_text(encoding="utf-8", errors="replace"):
        raise ClusterError(
            f"{script} would start this study again in each of its processes",
            hint='call it under  if __name__ == "__main__":',
        )
