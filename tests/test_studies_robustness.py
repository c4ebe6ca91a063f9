"""Robustness: Wilson's interval, spreads, indices of a linear function, and a mass on a guide whose answer is known.

Oracles: Wilson's interval against its defining equation; Sobol' indices of a sum, a_k^2/sum a^2; a mass on a guide
that hunts if and only if its breakaway friction exceeds its sliding friction.
"""

import math
import sys
from dataclasses import replace
from statistics import NormalDist

import casadi as ca
import numpy as np
import pytest
from click.testing import CliRunner
from mass_on_guide import MassOnGuide

from actuator import classify, simulate
from actuator.system.parameters import Parameter
from gear.quantities.roles import Breakaway, Gap, SlidingFriction
from studies.__main__ import main
from studies.cache import Cache
from studies.files import StudyError
from studies.robustness.robustness import MissingLibrary, factors, robustness, spread, wilson
from studies.specification import Tolerance

pytestmark = pytest.mark.thorough

pytest.importorskip("SALib")


def spreads(**sizes):
    return [Tolerance(parameter=name, size=size) for name, size in sizes.items()]


@pytest.mark.parametrize(("happened", "trials"), [(0, 10), (3, 10), (10, 10), (37, 200)])
def test_wilson_interval_is_where_the_score_is_z(happened, trials):
    found, z, share = wilson(happened, trials), 1.959963984540054, happened / trials
    for edge in (found.low, found.high):
        if 0 < edge < 1:
            assert abs(share - edge) == pytest.approx(z * math.sqrt(edge * (1 - edge) / trials), rel=1e-9)
    assert found.low <= share <= found.high


def test_wilson_refuses_what_is_no_count():
    with pytest.raises(ValueError, match="got 3 of 2"):
        wilson(3, 2)


def test_spreads_have_their_moments():
    shares = (np.arange(2000) + 0.5)[:, None] / 2000 * np.ones((1, 2))
    tolerances = [Tolerance(parameter="a", size=0.3), Tolerance(parameter="b", spread="normal", size=0.1)]
    found = factors(shares, tolerances)
    assert found.mean(axis=0) == pytest.approx([1, 1], abs=1e-9)
    # a normal distribution cut at its thousandths has the variance 1 - 2 a density(a)/0.998
    cut = NormalDist().inv_cdf(0.999)
    left = math.sqrt(1 - 2 * cut * NormalDist().pdf(cut) / 0.998)
    assert found.std(axis=0) == pytest.approx([0.3 / math.sqrt(3), 0.1 * left], rel=1e-3)
    assert abs(found[:, 0] - 1).max() <= 0.3


def parameters(values, **roles):
    """Parameters of a model that is nowhere, with their roles."""
    return [
        Parameter(name, "-", value, ca.SX.sym(name), roles.get(name.partition(".")[2], ()), name.partition(".")[0])
        for name, value in values.items()
    ]


def test_breakaway_is_never_below_sliding_friction():
    roles = {"coulomb": (SlidingFriction(),), "breakaway": (Breakaway("coulomb"),), "gap": (Gap(),)}
    values = {"x.coulomb": 1.0, "x.breakaway": 1.1, "y.gap": 2.0}
    model = parameters(values, **roles)
    found = spread(model, values, [Tolerance(parameter="*.coulomb", size=0.5)], [1.4])
    assert found == {"x.coulomb": 1.4, "x.breakaway": 1.4, "y.gap": 2.0}
    stribeck = {"x.static": 1.1, "x.coulomb": 1.0}
    law = parameters(stribeck, static=(Breakaway("coulomb"),), coulomb=(SlidingFriction(),))
    assert spread(law, stribeck, [Tolerance(parameter="*.static", size=0.5)], [0.7])["x.static"] == 1.0
    with pytest.raises(StudyError, match="no parameter named 'none'"):
        spread(model, values, [Tolerance(parameter="none", size=0.5)], [1.0])


def summed(parameters):
    return {"sum": 3 * parameters["a"] + 2 * parameters["b"] + parameters["c"]}


def test_indices_of_a_sum_in_closed_form():
    nominal = {"a": 1.0, "b": 1.0, "c": 1.0}
    found = robustness(
        summed,
        parameters(nominal),
        spreads(c=0.1, a=0.1, b=0.1),
        events={"large": lambda result: result["sum"] > 6},
        measures=("sum",),
        base=512,
        workers=1,
    )
    rows = found.influences["sum"]
    assert [row.parameter for row in rows] == ["a", "b", "c"]
    assert [row.total for row in rows] == pytest.approx([9 / 14, 4 / 14, 1 / 14], abs=0.02)
    large = found.probabilities["large"]
    assert large.trials == 1024
    assert large.low < 0.5 < large.high


def test_what_does_not_spread_has_its_nominal_value():
    nominal = {"a": 1.0, "b": 1.0, "c": 100.0}
    found = robustness(summed, parameters(nominal), spreads(a=0.1, b=0.1), events={}, measures=(), base=4, workers=1)
    assert all(result["sum"] > 100 for result in found.results)


GUIDE = MassOnGuide(dead=0.05, breakaway=1.3)
ACTUATOR = GUIDE.actuator()
BREAKAWAY = "gear.bearings.guide.breakaway"


def cycles(breakaway):
    """Whether there is a cycle, in closed form."""
    try:
        replace(GUIDE, breakaway=breakaway).cycle(low=GUIDE.dead * 1.0001)
    except ValueError:
        return False
    return True


def guided(parameters):
    run = simulate(ACTUATOR, 60.0, inputs={"reference": 0.3}, parameters=parameters, resolution=0.02)
    verdict = classify(run)
    return {"verdict": verdict.verdict, "size": float(np.ptp(run["load_angle"][-1000:]))}


def test_a_mass_on_a_guide_hunts_with_a_known_probability(tmp_path):
    # it hunts where a cycle exists, above a breakaway friction that is 1.3 N m
    low, high = 1.2, 1.4
    for _ in range(8):
        middle = (low + high) / 2
        low, high = (low, middle) if cycles(middle) else (middle, high)
    boundary = (low + high) / 2 / GUIDE.breakaway
    model = ACTUATOR.system().parameters
    options = {
        "events": {"hunting": lambda result: result["verdict"] != "rest"},
        "measures": ("size",),
        "base": 8,
        "seed": 3,
        "workers": 1,
    }
    path = tmp_path / "kept.jsonl"
    found = robustness(guided, model, spreads(**{BREAKAWAY: 0.2}), done=Cache(path), **options)
    hunting = found.probabilities["hunting"]
    assert hunting.trials == 16
    assert hunting.low < (1.2 - boundary) / 0.4 < hunting.high
    for point, result in zip(found.points, found.results, strict=True):
        if abs(point[BREAKAWAY] - boundary) > 0.01:
            assert (result["verdict"] != "rest") == (point[BREAKAWAY] > boundary)

    def never(parameters):
        raise AssertionError("what is kept is not run again")

    again = robustness(never, model, spreads(**{BREAKAWAY: 0.2}), done=Cache(path), **options)
    assert again.probabilities == found.probabilities
    with pytest.raises(AssertionError, match="not run again"):  # nor is it taken for something else
        robustness(never, model, spreads(**{BREAKAWAY: 0.2}), about="another demand", done=Cache(path), **options)


@pytest.mark.parametrize(
    ("tolerances", "base", "says"),
    [([], 8, "at least one tolerance"), (spreads(a=0.1), 12, "power of two, got 12")],
)
def test_wrong_tasks(tolerances, base, says):
    with pytest.raises(ValueError, match=says):
        robustness(summed, parameters({"a": 1.0}), tolerances, events={}, measures=(), base=base)


def test_wrong_spread():
    with pytest.raises(ValueError, match='must be "uniform" or "normal", got \'triangle\''):
        Tolerance(parameter="a", spread="triangle", size=0.1)


def test_without_the_library_it_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "SALib.analyze", None)
    with pytest.raises(MissingLibrary, match=r"pip install 'geared-actuator\[robustness\]'"):
        robustness(summed, parameters({"a": 1.0}), spreads(a=0.1), events={}, measures=())


def test_command_line_says_what_is_wrong_in_one_line(tmp_path):
    other = tmp_path / "other.json"
    other.write_text("{}")
    for arguments, says in (
        (["nothing"], "the built-in ones are"),
        (["aileron", "--corner", "hot"], "no corner name contains 'hot'"),
        (["aileron", "--gains", str(tmp_path / "none.json")], "cannot be read: No such file"),
        (["aileron", "--gains", str(other)], "is not the result.json of a tuning"),
    ):
        ended = CliRunner().invoke(main, ["robustness", *arguments, "--out", str(tmp_path)])
        assert ended.exit_code == 2
        assert says in ended.output
        assert len(ended.output.strip().splitlines()) == 1
    assert "--seed" in CliRunner().invoke(main, ["robustness", "--help"]).output
