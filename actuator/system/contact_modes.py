"""Modes of contacts in words, and whether all of them are at rest.

A contact slides forward or backward by the sign of its own slip speed; it is free where its teeth are separated.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from actuator.system.hybrid import HybridSystem

STUCK, FORWARD, BACKWARD, FREE = "stuck", "forward", "backward", "free"
MOTIONS = {STUCK: 0, FORWARD: 1, BACKWARD: -1}  # of a contact that is not in its gap
LABELS = {0: STUCK, 1: FORWARD, -1: BACKWARD}


def contact_labels(system: HybridSystem, values: Sequence[float] | np.ndarray) -> dict[str, str]:
    """Mode of each contact in words, from the mode variables."""
    named = dict(zip(system.modes, values, strict=True))
    return {
        contact.name: FREE if contact.flank and named[contact.flank] == 0 else LABELS[int(named[contact.motion])]
        for contact in system.contacts
    }


def label_rows(system: HybridSystem, values: np.ndarray) -> dict[str, np.ndarray]:
    """Modes of each contact in words, from rows of the mode variables."""
    rows = dict(zip(system.modes, values, strict=True))
    table = np.array([LABELS[k] for k in (-1, 0, 1)])
    found = {}
    for contact in system.contacts:
        labels = table[rows[contact.motion].astype(int) + 1]
        found[contact.name] = np.where(rows[contact.flank] == 0, FREE, labels) if contact.flank else labels
    return found


def is_at_rest(labels: Sequence[str] | np.ndarray) -> np.ndarray:
    """Whether contacts in these modes are at rest, (K,) or (K, n): some stuck, all others in their gaps.

    A mesh in its gap tells nothing of the shafts beside it; what sticks does.
    """
    labels = np.asarray(labels)
    stuck = labels == STUCK
    return stuck.any(axis=0) & (stuck | (labels == FREE)).all(axis=0)


def find_standstill(modes: Mapping[str, np.ndarray]) -> np.ndarray:
    """At which points of rows of modes everything is at rest; a contact that never sticks is not asked."""
    rows = np.array(list(modes.values()))
    return is_at_rest(rows[(rows == STUCK).any(axis=1)]) if rows.size else np.zeros(rows.shape[-1:], bool)
