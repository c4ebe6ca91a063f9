"""The command `hunting`."""

from dataclasses import dataclass
from pathlib import Path

import click

from studies.cases import built_in
from studies.corners import ROLES
from studies.findings import Findings
from studies.hunting.map import Plan
from studies.hunting.study import DATA, hunting_map, make_plan
from studies.study import Work, study

AXIS = (str, float, float, click.IntRange(1))
METAVAR = "NAME FROM TO COUNT"


@dataclass(frozen=True, kw_only=True)
class HuntingMap:
    """Where a case hunts.

    Parameters
    ----------
    plan : Plan
        What is varied.
    exact : bool
        Whether the exact boundary is continued along the axis that is one parameter.
    """

    plan: Plan
    exact: bool = False
    title: str = "Hunting map"

    def run(self, work: Work) -> Findings:
        """Compute the map."""
        return hunting_map(self.plan, work, exact=self.exact)


@study(
    "hunting",
    first=DATA,
    epilog="NAME is a parameter, in SI units. It may contain *: values then multiply all matching parameters. Join "
    "patterns with +, such as '*.coulomb+*.sliding'; =PATTERN assigns the value instead. The words "
    f"{', '.join(ROLES)} multiply all parameters with that role, whatever their names. Breakaway friction is not "
    "reduced below the sliding friction of its contact.",
)
@click.argument("case", default="aileron", metavar="[CASE | PATH.toml]")
@click.option("--x", type=AXIS, default=None, metavar=METAVAR, help="Horizontal axis.  [default: the integral gain]")
@click.option("--y", type=AXIS, default=None, metavar=METAVAR, help="Vertical axis.  [default: breakaway 0.5 2 8]")
@click.option("--corner", "corners", multiple=True, metavar="[LABEL:] NAME=VALUE,...",
              help="Set of parameters for which a map is computed; repeatable.")  # fmt: skip
@click.option("--duration", type=click.FloatRange(0, min_open=True), default=None,
              help="Duration of each run [s].  [default: that of the case]")  # fmt: skip
@click.option("--exact", is_flag=True, help="Continue the exact boundary along an axis that is a single parameter.")
def hunting(  # noqa: PLR0913, PLR0917 - one per option
    case: str,
    x: tuple | None,
    y: tuple | None,
    corners: tuple[str, ...],
    duration: float | None,
    exact: bool,
) -> HuntingMap:
    """Map where a case hunts, over two parameters and any number of corners.

    A point counts as hunting if the scenario, or a further step of 2 % of it, ends in a cycle.
    """
    source = case if case in built_in() else Path(case)
    return HuntingMap(plan=make_plan(source, x=x, y=y, corners=corners, duration=duration), exact=exact)
