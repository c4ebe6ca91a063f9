"""Does this project find the numbers that others found for the same machines: Dymola's and motulator's.

What is compared, and how it was built here, stands in `studies.cross_check_actuator` and `studies.cross_check_drive`.
Parts of both published results are stored with the study; with a folder that holds the whole, the whole is compared.
"""

from collections.abc import Callable
from pathlib import Path

from studies.cross_check_actuator import check_actuator
from studies.cross_check_actuator import recorded as recorded_rod
from studies.cross_check_drive import check_drive
from studies.cross_check_record import WrongRecord, recorded
from studies.deviation import table
from studies.gear_paper import Figures

ACTUATOR_FILE, DRIVE_FILE = "dymola_result.csv", "reference.npz"
SHARE = 0.9  # of the time that the actuator takes


def cross_check(progress: Callable[[float], None], folder: Path | None = None) -> Figures:
    """Both comparisons; `progress` is called with the share that is done.

    Raises
    ------
    WrongRecord
        Where the folder lacks one of the two results, or a result a column.
    """
    csv, npz = (None, None) if folder is None else (_find(folder, ACTUATOR_FILE), _find(folder, DRIVE_FILE))
    actuator_record, drive_record = recorded_rod(csv), recorded(npz)
    actuator = check_actuator(actuator_record, lambda share: progress(SHARE * share))
    drive = check_drive(drive_record)
    progress(1.0)
    noisy, rows = actuator.noisy, [*actuator.rows(), *drive.rows()]
    text = [
        table(rows),
        f"All within what is allowed: {'yes' if all(row.holds for row in rows) else 'NO'}. "
        "Signals are compared at every output, over their peak or the travel; the drive's marks over themselves.",
        f"Dymola spent 2.73 s on the actuator's 8 s with noise; here they take {noisy.statistics.wall_s:.2f} s "
        f"({len(noisy.changes)} changes of modes), and {actuator.clean.statistics.wall_s:.2f} s without.",
    ]
    return Figures(
        pictures={
            "cross_check_actuator": actuator.picture(),
            "cross_check_machine": drive.machine_picture(),
            "cross_check_drive": drive.drive_picture(),
        },
        result={"deviations": [row.as_result() for row in rows], "whole": folder is not None},
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
