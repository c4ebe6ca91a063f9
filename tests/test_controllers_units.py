"""Rules: the sentence said where a number breaks the rule of its annotation."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pytest
from annotated_types import Ge, Gt, Le, Lt, Unit

from gear.quantities import check, check_choice


@dataclass(frozen=True, kw_only=True)
class Sample:
    """One field per rule."""

    above: Annotated[float, Unit("s"), Gt(0)] = 1.0
    least: Annotated[float, Unit("rad/s"), Ge(-2.5)] = 0.0
    below: Annotated[float, Unit("-"), Ge(0), Lt(1)] = 0.0
    most: Annotated[float, Unit("rad"), Gt(0), Le(math.pi)] | None = None
    word: str = "one"

    def __post_init__(self):
        check(self)
        check_choice(self, "word", ("one", "two", "three"))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"above": 0.0}, "Sample.above must be > 0 s, got 0 s"),
        ({"above": math.inf}, "Sample.above must be a finite number \\[s\\], got inf"),
        ({"above": "1 s"}, "Sample.above must be a finite number \\[s\\], got '1 s'"),
        ({"least": -3}, "Sample.least must be >= -2.5 rad/s, got -3 rad/s"),
        ({"below": 1.0}, "Sample.below must be < 1, got 1"),
        ({"below": -0.5}, "Sample.below must be >= 0, got -0.5"),
        ({"most": 4.0}, "Sample.most must be <= 3.14159 rad, got 4 rad"),
        ({"most": -1.0}, "Sample.most must be > 0 rad, got -1 rad"),
        ({"word": "four"}, """Sample.word must be "one", "two" or "three", got 'four'"""),
    ],
)
def test_a_broken_rule_names_class_field_rule_value_and_unit(values, message):
    with pytest.raises(ValueError, match=message):
        Sample(**values)


def test_numbers_of_other_kinds_and_on_the_edge_are_taken():
    assert Sample(above=np.float32(2), least=np.int64(1), most=math.pi).above == 2
    assert Sample(least=-2.5, below=0).least == -2.5
