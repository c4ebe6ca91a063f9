"""Comparison with results that other programs, Dymola and motulator, gave for the same machines.

What is compared, and how it was built here, is described in `cross_check_actuator` and `cross_check_drive`.
Excerpts of both published results come with the study; given a folder with the complete results, those are compared.
"""

import hashlib
from collections.abc import Callable, MutableMapping
from pathlib import Path
from typing import NamedTuple

from studies.cache import Steps, fingerprint
from studies.checks.cross_check_actuator import Recorded as RecordedRod
from studies.checks.cross_check_actuator import check_actuator
from studies.checks.cross_check_actuator import recorded as read_rod
from studies.checks.cross_check_drive import check_drive
from studies.checks.cross_check_record import Recorded, WrongRecord
from studies.checks.cross_check_record import recorded as read_drive
from studies.checks.deviation import Deviation, table
from studies.checks.pictures import plot_drive, plot_machine, plot_rod
from studies.findings import Findings, png

ACTUATOR_FILE, DRIVE_FILE = "dymola_result.csv", "reference.npz"
SHARE = 0.9  # of the time that the actuator takes


class Checked(NamedTuple):
    """The result of one comparison."""

    rows: list[Deviation]
    pictures: dict[str, bytes]
    text: list[str]


class Records(NamedTuple):
    """The published results, whether they are complete, and a fingerprint of their files."""

    rod: RecordedRod
    drive: Recorded
    whole: bool
    source: str


def read_records(folder: Path | None = None) -> Records:
    """Read the published results: the complete ones in a folder, by default the excerpts of this package.

    Raises
    ------
    WrongRecord
        Where the folder lacks one of the two results, or a result a column.
    """
    if folder is None:
        return Records(read_rod(), read_drive(), False, "")
    paths = [_find(folder, name) for name in (ACTUATOR_FILE, DRIVE_FILE)]
    source = fingerprint(*(hashlib.sha256(path.read_bytes()).hexdigest() for path in paths))
    return Records(read_rod(paths[0]), read_drive(paths[1]), True, source)


def run_cross_check(
    progress: Callable[[float], None], records: Records, cache: MutableMapping | None = None
) -> Findings:
    """Both comparisons; `progress` is called with the share that is done."""
    steps = Steps(cache, records.source)

    def actuator() -> Checked:
        check = check_actuator(records.rod, lambda share: progress(SHARE * share))
        sentence = (
            f"Dymola took 2.73 s for the 8 s of the actuator with noise; here they took "
            f"{check.noisy.statistics.wall_s:.2f} s ({len(check.noisy.changes)} changes of modes), and "
            f"{check.clean.statistics.wall_s:.2f} s without noise."
        )
        return Checked(check.rows(), {"cross_check_actuator": png(plot_rod(check))}, [sentence])

    def drive() -> Checked:
        check = check_drive(records.drive)
        pictures = {"cross_check_machine": plot_machine(check), "cross_check_drive": plot_drive(check)}
        return Checked(check.rows(), {name: png(figure) for name, figure in pictures.items()}, [])

    found = [steps.compute("Dymola's actuator", Checked, actuator)]
    progress(SHARE)
    found.append(steps.compute("motulator's drive", Checked, drive))
    progress(1.0)
    rows = [row for each in found for row in each.rows]
    text = [
        table(rows),
        f"All within their limits: {'yes' if all(row.holds for row in rows) else 'NO'}. Signals are compared at every "
        "output point, relative to their peak or to the travel; the drive's key figures relative to themselves.",
        *(sentence for each in found for sentence in each.text),
    ]
    return Findings(
        pictures={name: picture for each in found for name, picture in each.pictures.items()},
        result={"deviations": [row.as_result() for row in rows], "whole": records.whole},
        text=text,
        passed=all(row.holds for row in rows),
    )


def _find(folder: Path, name: str) -> Path:
    """The file of that name in a folder or below."""
    found = sorted(folder.rglob(name))
    if not found:
        raise WrongRecord(
            f"no {name} in {folder} or below; give a folder with {ACTUATOR_FILE} and {DRIVE_FILE}, or none to compare "
            "with the excerpts of this package"
        )
    return found[0]
