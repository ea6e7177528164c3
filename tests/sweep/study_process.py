"""A sweep in a process of its own: python study_process.py STUDY FOLDER STAND_IN."""

import io
import sys
from pathlib import Path

import stand_ins
from rich.console import Console

from softsim.errors import SoftsimError
from softsim.study.loading import load_study
from softsim.sweep.engine import local_pool
from softsim.sweep.study import sweep

if __name__ == "__main__":
    simulate = getattr(stand_ins, sys.argv[3])
    study, folder, silent = load_study(sys.argv[1]), Path(sys.argv[2]), Console(file=io.StringIO())
    try:
        sweep(study, folder, local_pool(1), simulate=simulate, console=silent)
    except SoftsimError as error:
        print(error, file=sys.stderr)
        sys.exit(error.exit_code)
