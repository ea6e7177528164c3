"""The files of a study while it runs: its table and its record, never older than ten seconds."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from softsim.output.study_folder import (
    StudyRecord,
    is_study,
    read_study,
    write_study,
    write_table,
)
from softsim.sweep.claim import claimed
from softsim.sweep.job import Job, Outcome
from softsim.sweep.table import StudyTable

WRITE_EVERY = 10.0
"""Seconds after which new rows are on disk at the latest."""


class Ledger:
    """Notes outcomes into a table, and keeps study.json and the table's files up to date."""

    def __init__(self, folder: Path, record: StudyRecord, table: StudyTable) -> None:
        self.folder, self.table = folder, table
        earlier = read_study(folder).wall_time if is_study(folder) else 0.0
        self.record = replace(record, status="running", wall_time=earlier)
        self.earlier, self.began = earlier, time.monotonic()
        self.write()

    def note(self, job: Job, outcome: Outcome) -> None:
        """Fill in a row."""
        self.table.note(job, outcome)
        self.is_behind = True

    def write_if_due(self) -> None:
        """Write what is new, now and then."""
        if self.is_behind and time.monotonic() - self.written_at >= WRITE_EVERY:
            self.write()

    def write(self) -> None:
        """Write table and record. Raises OutputError."""
        self.record = replace(self.record, wall_time=self.earlier + time.monotonic() - self.began)
        write_study(self.folder, self.record)
        write_table(self.folder, self.table.frame())
        self.is_behind, self.written_at = False, time.monotonic()

    def close(self, status: str) -> None:
        """Write them a last time: the study is done, or interrupted."""
        self.record = replace(self.record, status=status)
        self.write()


@contextmanager
def kept_ledger(folder: Path, record: StudyRecord, table: StudyTable) -> Iterator[Ledger]:
    """A ledger for the time of a sweep or an optimisation, which has the folder for itself.

    Raises OutputError: another one works there, or the disk refuses.
    """
    with claimed(folder):
        ledger = Ledger(folder, record, table)
        status = "interrupted"
        try:
            yield ledger
            status = "done"
        finally:
            ledger.close(status)
