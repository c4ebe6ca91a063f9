"""The gear paper's study.

Oracles: what the paper prints (85 % efficiency and breakout at half the stall load at -55 degC, 0.05 N m of seal
friction, 20 mode changes of the Coulomb case) and the quadrants' symmetry.
"""

import json

import pytest
from click.testing import CliRunner

from studies.__main__ import main
from studies.checks.gear_paper import cold_gearbox, figure_7, figure_9_with_din, figures_12_and_13

pytestmark = pytest.mark.thorough


def test_a_cold_gearbox_has_the_published_efficiency_and_breakout():
    result = cold_gearbox().result["cold_gearbox"]
    assert result["efficiency_forward"] == pytest.approx(0.85, abs=1e-9)
    assert result["efficiency_backward"] == pytest.approx(0.85, abs=1e-9)
    assert result["breakout_over_stall"] == pytest.approx(0.5, abs=1e-6)
    assert result["coefficient_of_friction"] > 0.9


def test_without_load_only_the_seals_rub_and_turning_round_mirrors_the_friction():
    result = figures_12_and_13().result["figures_12_13"]
    forward, backward = result["no_load_friction_Nm"].values()
    assert forward == pytest.approx(0.05, abs=0.002)
    assert backward == pytest.approx(-forward, rel=0.02)
    ahead, behind = (list(row.values()) for row in result["friction_at_12_Nm"].values())
    assert ahead[0] == pytest.approx(-behind[1], rel=1e-9)  # quadrants 2 and 3 are 4 and 1 turned round
    assert ahead[1] == pytest.approx(-behind[0], rel=1e-9)


def test_progressive_teeth_are_softer_than_linear_ones_and_backlash_takes_its_half():
    force = figure_7().result["figure_7_force_at_20_um_N"]
    assert force["ISO 6336-1"] == pytest.approx(force["linear"] * (1 - 2.5 / 20), rel=1e-9)
    assert force["Niemann & Winter"] < force["linear"]
    assert force["linear, backlash"] == pytest.approx(force["linear"] * (1 - 7.5 / 20), rel=1e-9)


def test_the_coulomb_case_slips_ten_times_and_din_friction_creeps():
    result = figure_9_with_din().result["figure_9"]
    assert result["coulomb, printed"]["mode_changes"] == 20
    assert result["coulomb, printed"]["slips"] == 10
    assert result["geometric"]["stuck_share"] < 0.1


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The folder that the command writes."""
    folder = tmp_path_factory.mktemp("paper")
    done = CliRunner().invoke(main, ["--out", str(folder), "gear-paper"])
    assert done.exit_code == 0, done.output
    return folder / "gear-paper"


def test_the_command_writes_pictures_numbers_and_findings(written):
    names = {path.name for path in written.iterdir()}
    assert {"figure_7.png", "figure_12.png", "figure_13.png", "result.json", "findings.txt"} <= names
    assert names == {*json.loads((written / "result.json").read_text())["files"], "finished.jsonl"}
    assert "85 %" in (written / "findings.txt").read_text(encoding="utf-8")


def test_what_is_kept_is_not_computed_again_and_gives_the_same_files(written, tmp_path, monkeypatch):
    for name in ("simulate", "balance"):
        monkeypatch.setattr(f"studies.checks.gear_paper.{name}", None)
    out = tmp_path / "again"
    out.mkdir()
    (out / "finished.jsonl").write_bytes((written / "finished.jsonl").read_bytes())
    done = CliRunner().invoke(main, ["gear-paper", "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert "0 results computed" in done.output and "4 reused from" in done.output
    for path in written.iterdir():
        assert (out / path.name).read_bytes() == path.read_bytes()
