"""The study against others' numbers.

Oracles: the parts of Dymola's and motulator's published results that are stored with the study; what the issue allows;
comparisons that must fail, because a known part of the model is left out of them.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from studies.__main__ import main
from studies.checks import cross_check_actuator as dymola
from studies.checks import cross_check_drive as motulator
from studies.checks import cross_check_record as record
from studies.checks.deviation import Deviation, table

pytestmark = pytest.mark.thorough

ROWS = {"rod against": 1, "rod with noise": 1, "machine": 4, "drive": 4}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """What the command prints, and the folder that it writes."""
    folder = tmp_path_factory.mktemp("cross_check")
    done = CliRunner().invoke(main, ["cross-check", "--out", str(folder)])
    assert done.exit_code == 0, done.output
    return done.output, folder


def test_the_command_writes_pictures_numbers_and_a_table(written):
    output, folder = written
    pictures = {f"cross_check_{name}.png" for name in ("actuator", "machine", "drive")}
    assert {path.name for path in folder.iterdir()} == pictures | {"result.json", "findings.txt", "finished.jsonl"}
    assert "All within their limits: yes" in output
    assert "All within their limits: yes" in (folder / "findings.txt").read_text(encoding="utf-8")


@pytest.mark.parametrize(("start", "allowed"), [("rod", 1e-3), ("machine", 1e-3), ("drive", 3e-2)])
def test_every_deviation_is_within_what_the_issue_allows(written, start, allowed):
    rows = json.loads((written[1] / "result.json").read_text())["deviations"]
    mine = [row for row in rows if row["what"].startswith(start)]
    assert len(mine) == sum(count for name, count in ROWS.items() if name.startswith(start))
    for row in mine:
        assert row["allowed"] == allowed
        assert 0 < row["relative"] <= allowed, row


# -- the actuator -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def clean():
    return dymola.move(dymola.actuator_with_noise())


def test_the_stored_outputs_of_dymola_would_show_a_rod_without_its_spring(clean):
    theirs = dymola.recorded()
    load = np.interp(theirs.time, clean.t, clean["rod_position"])
    assert np.abs(load - theirs.position).max() > 5 * dymola.ALLOWED * dymola.TRAVEL


def test_dymola_s_rod_overshoots_and_settles_on_the_command(clean):
    theirs = dymola.recorded()
    assert len(theirs.time) > 100
    assert (theirs.time[0], theirs.time[-1]) == (0.0, 8.0)
    assert theirs.position[-1] == pytest.approx(dymola.TRAVEL, abs=1e-3 * dymola.TRAVEL)
    assert dymola.rod(clean).max() == pytest.approx(theirs.position.max(), rel=1e-3)
    # the force pushes the rod over its spring, and the other way through the free play
    assert clean["rod_position"][-1] - dymola.rod(clean)[-1] == pytest.approx(1e4 / 1e8, rel=1e-3)


def test_the_gear_has_the_efficiencies_and_bearing_friction_of_the_data_sheet():
    """-tau_b/ratio = eta tau_a - tau_f with the motor driving, tau_a/eta - tau_f with the load driving."""
    from gear.balance import balance

    gear, ratio = dymola.actuator_with_noise().gear, dymola.RATIO
    assert gear.ratio() == pytest.approx(ratio)
    for load, speed, eta in ((-50.0, 0.3, 0.85), (50.0, 0.3, 1 / 0.80), (50.0, -0.3, 0.85), (-50.0, -0.3, 1 / 0.80)):
        found = balance(gear, output_torque=load, output_speed=speed)
        lost = 0.1 * np.sign(speed)
        assert -load / ratio == pytest.approx(eta * found.input_torque - lost, rel=1e-9)


def test_the_noise_is_uniform_repeats_and_differs_by_its_seed():
    signal, other = dymola.noise(), dymola.noise(seed=1)
    values = np.array(signal.values)
    assert signal == dymola.noise()
    assert len(values) == 1600
    assert np.abs(values).max() <= dymola.NOISE
    assert values.std() == pytest.approx(dymola.NOISE / np.sqrt(3), rel=0.05)
    assert abs(np.corrcoef(values, other.values)[0, 1]) < 0.1


# -- the drive --------------------------------------------------------------------------------------------


def worst(excerpts):
    theirs = record.recorded()
    return max(
        np.abs(motulator.driven_machine(excerpt)[name] - excerpt.signals[name]).max() / theirs.peaks[name]
        for excerpt in excerpts
        for name in record.SIGNALS
    )


def test_the_machine_needs_the_right_period_of_the_recorded_voltages():
    excerpts = record.recorded().excerpts
    assert worst(excerpts) < 1e-5
    early = [excerpt._replace(duties=np.roll(excerpt.duties, -1, axis=1)) for excerpt in excerpts]
    assert worst(early) > 2 * motulator.MACHINE_ALLOWED


def test_twice_as_many_steps_do_not_change_the_machine(monkeypatch):
    excerpt = record.recorded().excerpts[0]
    coarse = motulator.driven_machine(excerpt)
    monkeypatch.setattr(motulator, "STEPS", 2 * motulator.STEPS)
    motulator._one_period.cache_clear()
    fine = motulator.driven_machine(excerpt)
    motulator._one_period.cache_clear()
    for name, peak in record.recorded().peaks.items():
        assert 0 < np.abs(fine[name] - coarse[name]).max() < 1e-7 * peak


def test_a_whole_record_is_compared_at_every_sample(tmp_path):
    """A record made here of the stored excerpt, in the form of the whole one."""
    excerpt = record.recorded().excerpts[0]
    count = excerpt.duties.shape[1]
    dense = excerpt._replace(samples=np.arange(count + 1))
    machine = motulator.driven_machine(dense)
    keys = dict(zip(record.SIGNALS, ("i_d", "i_q", "tau_M", "w_M"), strict=True))
    duties = np.column_stack([excerpt.duties[:, 1:], np.full((3, 2), 0.5)])  # of sample k, acting from k + 1 on
    path = tmp_path / "reference.npz"
    np.savez(
        path,
        t=record.LOAD_TIME + record.PERIOD * np.arange(count + 1),
        tau_L=np.zeros(count + 1),
        **{key: machine[name] for name, key in keys.items()},
        **dict(zip(("d_a", "d_b", "d_c"), duties, strict=True)),
    )
    whole = record.recorded(path).excerpts[0]
    assert len(whole.samples) == count + 1
    # the excerpt starts at rest but for the voltage that acts on its first period
    again = motulator.driven_machine(whole._replace(duties=excerpt.duties, start=excerpt.start))
    for name in record.SIGNALS:
        np.testing.assert_allclose(again[name], whole.signals[name], atol=1e-12)
    np.testing.assert_array_equal(whole.duties[:, 1:], excerpt.duties[:, 1:])


# -- the table and errors ---------------------------------------------------------------------------------


def test_a_row_that_is_too_far_says_so():
    row = Deviation(what="x", unit="A", theirs=-2.0, deviation=0.1, allowed=0.03)
    assert row.relative == pytest.approx(0.05)
    assert not row.holds
    assert "EXCEEDED" in table([row])
    near = replace(row, deviation=-0.05)
    assert near.holds
    assert "EXCEEDED" not in table([near])
    assert "2.5 %" in table([near])


def test_a_deviation_that_is_too_large_ends_the_command_with_1(monkeypatch, tmp_path):
    from studies.findings import Findings

    row = Deviation(what="x", unit="A", theirs=1.0, deviation=0.1, allowed=0.03)
    found = Findings(pictures={}, result={"deviations": [row.as_result()]}, text=[table([row])], passed=row.holds)
    monkeypatch.setattr("studies.checks.commands.run_cross_check", lambda *_: found)
    done = CliRunner().invoke(main, ["cross-check", "--out", str(tmp_path)])
    assert done.exit_code == 1
    assert "EXCEEDED" in done.output


def test_a_folder_without_the_results_is_refused(tmp_path):
    done = CliRunner().invoke(main, ["cross-check", "--reference", str(tmp_path), "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert f"no dymola_result.csv in {tmp_path} or below" in done.output
    assert not (tmp_path / "out").exists()


def test_a_result_without_its_columns_is_refused(tmp_path):
    (tmp_path / "dymola_result.csv").write_text("time,rodMass.v\n0,0\n1,0\n")
    np.savez(tmp_path / "reference.npz", t=np.zeros(3))
    done = CliRunner().invoke(main, ["cross-check", "--reference", str(tmp_path), "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert "dymola_result.csv has no column 'rodMass.s', only time, rodMass.v" in done.output
    with pytest.raises(record.WrongRecord, match=r"reference.npz has no column 'i_d', only t"):
        record.recorded(tmp_path / "reference.npz")


def test_a_whole_result_of_dymola_is_read_as_it_is_published(tmp_path):
    path = tmp_path / "dymola_result.csv"
    path.write_text('"time","rodMass.s"\n0,0\n0.5,1e-3\n0.5,1e-3\n')
    found = dymola.recorded(path)
    np.testing.assert_array_equal(found.time, [0, 0.5, 0.5])
    np.testing.assert_array_equal(found.position, [0, 1e-3, 1e-3])
