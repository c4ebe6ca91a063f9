"""Does this project find the numbers that others found for the same machines: Dymola's and motulator's.

What is compared, and how it was built here, stands in `cross_check_actuator` and `cross_check_drive`.
Parts of both published results are stored with the study; with a folder that holds the whole, the whole is compared.
"""

import hashlib
from collections.abc import Callable, MutableMapping
from pathlib import Path
from typing import NamedTuple

from studies.cache import Stages, fingerprint
from studies.checks.cross_check_actuator import Recorded as RecordedRod
from studies.checks.cross_check_actuator import check_actuator
from studies.checks.cross_check_actuator import recorded as recorded_rod
from studies.checks.cross_check_drive import check_drive
from studies.checks.cross_check_record import Recorded, WrongRecord, recorded
from studies.checks.deviation import Deviation, table
from studies.findings import Findings, png

ACTUATOR_FILE, DRIVE_FILE = "dymola_result.csv", "reference.npz"
SHARE = 0.9  # of the time that the actuator takes


class Checked(NamedTuple):
    """One of the comparisons."""

    rows: list[Deviation]
    pictures: dict[str, bytes]
    text: list[str]


class Records(NamedTuple):
    """The published results, and a fingerprint of the files that they are from."""

    rod: RecordedRod
    drive: Recorded
    whole: bool
    source: str


def records_of(folder: Path | None = None) -> Records:
    """From a folder that holds the whole results, or where none is given the parts of them that are stored here.

    Raises
    ------
    WrongRecord
        Where the folder lacks one of the two results, or a result a column.
    """
    if folder is None:
        return Records(recorded_rod(), recorded(), False, "")
    paths = [_find(folder, name) for name in (ACTUATOR_FILE, DRIVE_FILE)]
    source = fingerprint([hashlib.sha256(path.read_bytes()).hexdigest() for path in paths])
    return Records(recorded_rod(paths[0]), recorded(paths[1]), True, source)


def cross_check(progress: Callable[[float], None], records: Records, kept: MutableMapping | None = None) -> Findings:
    """Both comparisons; `progress` is called with the share that is done, and what is finished is `kept`."""
    stages = Stages(kept, records.source)

    def actuator() -> Checked:
        check = check_actuator(records.rod, lambda share: progress(SHARE * share))
        sentence = (
            f"Dymola spent 2.73 s on the actuator's 8 s with noise; when they were computed here they took "
            f"{check.noisy.statistics.wall_s:.2f} s ({len(check.noisy.changes)} changes of modes), and "
            f"{check.clean.statistics.wall_s:.2f} s without."
        )
        return Checked(check.rows(), {"cross_check_actuator": png(check.picture())}, [sentence])

    def drive() -> Checked:
        check = check_drive(records.drive)
        pictures = {"cross_check_machine": check.machine_picture(), "cross_check_drive": check.drive_picture()}
        return Checked(check.rows(), {name: png(figure) for name, figure in pictures.items()}, [])

    found = [stages.get("Dymola's actuator", Checked, actuator)]
    progress(SHARE)
    found.append(stages.get("motulator's drive", Checked, drive))
    progress(1.0)
    rows = [row for each in found for row in each.rows]
    text = [
        table(rows),
        f"All within what is allowed: {'yes' if all(row.holds for row in rows) else 'NO'}. "
        "Signals are compared at every output, over their peak or the travel; the drive's marks over themselves.",
        *(sentence for each in found for sentence in each.text),
    ]
    return Findings(
        pictures={name: picture for each in found for name, picture in each.pictures.items()},
        result={"deviations": [row.as_result() for row in rows], "whole": records.whole},
        text=text,
    )


def _find(folder: Path, name: str) -> Path:
    """The file of that name in a folder or below."""
    found = sorted(folder.rglob(name))
    if not found:
        raise WrongRecord(
            f"no {name} in {folder} or below; give a folder with {ACTUATOR_FILE} and {DRIVE_FILE}, or none to compare "
            "with what is stored here"
        )
    return found[0]
