"""The command `robustness`."""

from pathlib import Path

import click

from studies.robustness.study import RobustnessStudy
from studies.specification import built_in_specifications, load_specification
from studies.study import study


@study("robustness", epilog=f"Built-in specifications: {', '.join(built_in_specifications())}.")
@click.argument("specification", default="aileron", metavar="[CASE | PATH.toml]")
@click.option("--gains", type=click.Path(dir_okay=False, path_type=Path), default=None,
              help="Gains from a tuning's result.json.  [default: those of the case]")  # fmt: skip
@click.option("--corner", default="", help="Part of the name of a corner; the first that contains it is taken.")
@click.option("--base", default=32, show_default=True, type=click.IntRange(2),
              help="Sobol' base sample size, a power of two.")  # fmt: skip
@click.option("--seed", default=1, show_default=True, help="Random seed.")
def robustness(specification: str, gains: Path | None, corner: str, base: int, seed: int) -> RobustnessStudy:
    """Probability of hunting and of missing the bandwidth over the tolerances of a specification."""
    task, case = load_specification(specification)
    return RobustnessStudy(specification=task, case=case, gains=gains, corner=corner, base=base, seed=seed)
