"""The axis of a table over mesh speed."""

from collections.abc import Sequence


def require_axis(owner: str, speeds: Sequence[float]) -> None:
    """Raise ValueError where the speeds [m/s] of the `points` of a table do not increase from zero."""
    if not speeds:
        raise ValueError(f"{owner}.points must not be empty")
    if speeds[0] != 0:
        raise ValueError(f"{owner}.points[0].speed must be 0 m/s, where the table begins, got {speeds[0]:g} m/s")
    for k, (last, speed) in enumerate(zip(speeds, speeds[1:], strict=False), start=1):
        if speed <= last:
            raise ValueError(f"{owner}.points[{k}].speed must be > {last:g} m/s, the one before, got {speed:g} m/s")
