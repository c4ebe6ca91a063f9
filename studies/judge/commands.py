"""The run of one case: the command without a name, and `run` behind a path."""

import math
from pathlib import Path

import click

from actuator import SimulationError
from actuator.stiction.margins import MOST
from studies.cache import Stages, kept_in
from studies.cases import load_case
from studies.commands import FOLDER, RESUMES, announce, refusing, shares
from studies.files import CaseError
from studies.findings import PAGE
from studies.judge.report import case_findings
from studies.judge.study import Judgment, fingerprint_of, judge

THOROUGH = "Explain the hunting of a case even where its runs take long."


def run_case(case: str | Path, folder: Path, thorough: bool) -> None:
    """Judge a case, write the report, say the result."""
    with refusing(folder, CaseError):
        loaded = load_case(case)
        kept = kept_in(folder)
    stages = Stages(kept, fingerprint_of(loaded))
    with refusing(folder, SimulationError):
        with shares(loaded.title) as progress:
            judgment = judge(loaded, progress, thorough=thorough, stages=stages)
        found = case_findings(judgment, _sentences(judgment))
        written = found.save(folder)
    taken = [f"not computed again, but taken from {kept.path}: {', '.join(stages.taken)}"] if stages.taken else []
    announce([*found.text, *taken], written, PAGE)


def _sentences(judgment: Judgment) -> list[str]:
    """Verdict, margins, causes and the best remedy."""
    hunting, insight = judgment.hunting, judgment.insight
    text = [f"verdict: {hunting.verdict} ({hunting.reason})"]
    if hunting.cycles:
        text.append(
            f"period {hunting.period_s:.4g} s, amplitude {hunting.amplitude_rad * 1e3:.4g} mrad at the load, "
            f"stuck for {hunting.stick_fraction:.0%} of the time"
        )
    for kind, margin in insight.margins.items():
        no = (
            f"no factor up to {MOST:g} makes it hunt"
            if margin.factor
            else f"no factor down to 1/{MOST:g} ends the hunting"
        )
        known = f"{margin.db:+.1f} dB (factor {margin.factor:.3g})"
        text.append(f"{kind} margin: {known if math.isfinite(margin.db) else no}")
    for what, why in insight.missing.items():
        text.append(f"{'margins, causes and remedies' if what == 'all' else what}: {why}")
    if insight.causes:
        text.append(insight.causes.sentence())
    if insight.remedies:
        best = insight.remedies.ranked[0]
        text.append(f"best remedy: {' '.join((best.name, best.setting)).strip()} ({best.does})")
    return text


@click.command(hidden=True, epilog=RESUMES)
@click.argument("path", type=click.Path(path_type=Path))
@click.option("--out", type=FOLDER, default=None, help="Folder for the results.  [default: out]")
@click.option("--thorough", is_flag=True, help=THOROUGH)
@click.pass_context
def run(context: click.Context, path: Path, out: Path | None, thorough: bool) -> None:
    """Run the case in a TOML file."""
    assert context.parent is not None
    run_case(path, out or context.obj, thorough or context.parent.params["thorough"])
