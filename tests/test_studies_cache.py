"""What studies keep: the file, and the parts of a study.

Oracles: what was put in comes out, to the last bit, from another mapping over the same file; a file cut anywhere, as a
kill leaves it, gives the lines that are whole; another program's file gives nothing.
"""

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import actuator
from actuator import SinePoint, SineStream
from actuator.response.frequency_response import point_key
from actuator.simulation.many import run_many
from studies.cache import (
    FILE,
    PACKAGES,
    Cache,
    StepError,
    Steps,
    fingerprint,
    hash_source,
    open_cache,
    program_fingerprint,
)
from studies.cases import load_case

# -- the file -----------------------------------------------------------------------------------------------


@given(lines=st.integers(0, 4), cut=st.integers(0, 200))
def test_a_file_cut_anywhere_gives_its_whole_lines_and_can_be_gone_on_with(tmp_path_factory, lines, cut):
    path = tmp_path_factory.mktemp("cut") / FILE
    cache = Cache(path)
    for k in range(lines):
        cache[str(k)] = {"x": k / 3}
    whole = path.read_bytes() if path.exists() else b""
    path.write_bytes(whole[: max(0, len(whole) - cut)])
    left = max(0, path.read_bytes().count(b"\n") - 1)
    again = Cache(path)
    assert dict(again) == {str(k): {"x": k / 3} for k in range(left)}
    again["new"] = {"x": math.inf}
    assert dict(Cache(path)) == dict(again)
    assert len(again) == left + 1


DAMAGE = [
    b"\0" * 100,
    b"{",
    b"[]",
    b"3",
    b"{}",
    b'{"key": "b"}',
    b'{"key": 1, "result": {}}',
    b'{"key": "b", "result": 2}',
]


@pytest.mark.parametrize("damage", [*DAMAGE, b"\xff\xfe"])
def test_a_damaged_line_is_passed_over_and_counted(tmp_path, damage):
    path = tmp_path / FILE
    first = Cache(path, "program")
    first["a"] = {"x": 1.0}
    with path.open("ab") as file:
        file.write(damage + b"\n")
    first["c"] = {"x": 3.0}
    again = Cache(path, "program")
    assert dict(again) == {"a": {"x": 1.0}, "c": {"x": 3.0}}
    assert again.damaged == 1
    again["b"] = {"x": 2.0}
    assert dict(Cache(path, "program")) == {"a": {"x": 1.0}, "b": {"x": 2.0}, "c": {"x": 3.0}}


def test_what_another_program_found_is_not_used_and_does_not_pile_up(tmp_path):
    path = tmp_path / FILE
    for version in ("one", "two", "three"):
        cache = Cache(path, program=version)
        assert not cache
        cache["a"] = {"x": version}
    assert [json.loads(line) for line in path.read_text().splitlines()] == [
        {"program": "three"},
        {"key": "a", "result": {"x": "three"}},
    ]
    assert not Cache(path)


def test_looking_at_another_programs_file_leaves_it_as_it_is(tmp_path):
    path = tmp_path / FILE
    Cache(path, program="long work")["a"] = {"x": 1.0}
    assert not Cache(path)
    assert Cache(path, program="long work")["a"] == {"x": 1.0}


def test_every_study_keeps_in_the_same_file(tmp_path):
    cache = open_cache(tmp_path / "a" / "b")
    assert cache.path == tmp_path / "a" / "b" / FILE
    assert list(cache.path.parent.iterdir()) == []  # nothing before there is a result


def test_a_folder_that_cannot_be_written_is_told_before_the_work(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError):
        open_cache(tmp_path / "file" / "out")


# -- the program --------------------------------------------------------------------------------------------


def test_the_program_is_the_text_in_all_folders_below(tmp_path):
    room = tmp_path / "room"
    room.mkdir()
    (tmp_path / "a.py").write_text("a")
    (room / "b.py").write_text("b")
    (room / "notes.txt").write_text("no part of it")
    before = hash_source([tmp_path])
    (room / "notes.txt").write_text("still none")
    assert hash_source([tmp_path]) == before
    (room / "b.py").write_text("c")
    assert hash_source([tmp_path]) != before
    (room / "b.py").rename(room / "c.py")
    (room / "c.py").write_text("b")
    assert hash_source([tmp_path]) != before


def test_the_program_has_its_rooms():
    root = Path(actuator.__file__).parent.parent
    assert all((root / package).is_dir() for package in PACKAGES)
    whole = hash_source([root / "actuator"])
    assert whole != hash_source(sorted(path for path in (root / "actuator").iterdir() if path.is_dir()))
    assert program_fingerprint() == program_fingerprint() and len(program_fingerprint()) == 16


# -- an actuator --------------------------------------------------------------------------------------------


def test_an_actuator_is_told_by_its_choices_and_whole_numbers_too():
    made = load_case("aileron").actuator
    first, loops = made.gear.meshes["first"], made.controller
    meshes = {**made.gear.meshes, "first": replace(first, pair=replace(first.pair, teeth_b=91))}
    others = (
        replace(made, gear=replace(made.gear, meshes=meshes)),
        replace(made, motor=replace(made.motor, pole_pairs=5)),
        replace(made, controller=replace(loops, speed=replace(loops.speed, anti_windup="clamping"))),
        replace(made, controller=replace(loops, decoupling=False)),
        replace(made, controller=replace(loops, feedback="motor")),
    )
    point = SinePoint(amplitude=1.0, frequency=1.0)
    for name in (fingerprint, lambda each: point_key(SineStream(plant=each), point)):
        assert len({name(each) for each in (made, *others)}) == 1 + len(others)
        assert name(replace(made)) == name(made)
    assert fingerprint(made, 1.0) != fingerprint(made)


# -- parts --------------------------------------------------------------------------------------------------


class Event(NamedTuple):
    time: float
    modes: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class Part:
    value: float
    values: np.ndarray
    number: complex
    events: tuple[Event, ...]
    image: bytes
    other: "Part | None" = None


def part(**changes):
    given = {
        "value": 0.1 + 0.2,
        "values": np.array([1 + 1j / 3, math.inf]),
        "number": complex(math.pi, -1 / 7),
        "events": (Event(math.nan, (1, 0)),),
        "image": bytes(range(256)),
    }
    return Part(**(given | changes))


def test_a_part_comes_back_as_it_was(tmp_path):
    made = part(other=part(values=np.array([np.nextafter(1, 2)])))
    first = Steps(Cache(tmp_path / FILE), "case").compute("part", Part, lambda: made)
    cache = Cache(tmp_path / FILE)
    steps = Steps(cache, "case")
    again = steps.compute("part", Part, lambda: pytest.fail("made again"))
    assert cache.reused == {"part, case"}
    for found in (first, again):
        assert repr(found) == repr(made)
        np.testing.assert_array_equal(found.values, made.values)
        assert found.values.dtype == complex and found.other.values.dtype == float


def test_a_part_of_another_case_is_made_anew(tmp_path):
    cache = Cache(tmp_path / FILE)
    Steps(cache, "one").put("part", 1.0)
    steps = Steps(cache, "two")
    assert steps.compute("part", float, lambda: 2.0) == 2.0
    assert cache.reused == set()
    assert Steps(cache, "one").read("part", float) == 1.0


def test_a_failure_is_kept_like_a_result_and_others_go_through(tmp_path):
    def fails():
        raise ValueError("no such cycle")

    for make in (fails, lambda: pytest.fail("made again")):
        with pytest.raises(StepError, match="no such cycle"):
            Steps(Cache(tmp_path / FILE)).compute("part", float, make, failures=(ValueError,))
    with pytest.raises(ValueError, match="no such cycle"):
        Steps(Cache(tmp_path / FILE)).compute("another", float, fails, failures=(KeyError,))
    assert "another" not in Steps(Cache(tmp_path / FILE))


def test_many_parts_of_a_type_are_a_mapping_that_says_which_were_there(tmp_path):
    cache, points = Cache(tmp_path / FILE), {"half 1": 1, "half 2": 2}
    found = run_many(half, points, done=Steps(cache, "case").results(float), workers=1)
    assert found == {"half 1": 0.5, "half 2": 1.0}
    assert cache.reused == set()
    cache = Cache(tmp_path / FILE)
    again = Steps(cache, "case")
    found = run_many(half, {"half 2": 2, "half 3": 3}, done=again.results(float), workers=1)
    assert found == {"half 2": 1.0, "half 3": 1.5}
    assert cache.reused == {"half 2, case"}


def half(item):
    return item / 2
