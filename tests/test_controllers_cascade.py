"""Cascade: its loops against their own design rules."""

import pytest

from controllers import PI, Cascade, P

SERVO = {
    "position": 30.0,
    "speed": 200.0,
    "current": 2000.0,
    "inertia": 1e-4,
    "resistance": 0.5,
    "inductance": 1e-3,
    "speed_limit": 300.0,
}


def test_cascade_is_designed_loop_by_loop():
    cascade = Cascade.for_bandwidths(**SERVO)
    assert cascade.position == P.for_bandwidth(30.0)
    assert cascade.speed == PI.for_inertia(inertia=1e-4, bandwidth=200.0, integral_bandwidth=40.0)
    assert cascade.current == PI.for_winding(resistance=0.5, inductance=1e-3, bandwidth=2000.0)
    slower = Cascade.for_bandwidths(**SERVO, integral=5.0)
    assert slower.speed == PI.for_inertia(inertia=1e-4, bandwidth=200.0, integral_bandwidth=5.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Cascade.for_bandwidths(**SERVO | {"speed_limit": 0.0}), "Cascade.speed_limit must be > 0 rad/s"),
        (
            lambda: Cascade.for_bandwidths(**SERVO, feedback="output"),
            """Cascade.feedback must be "load" or "motor", got 'output'""",
        ),
    ],
)
def test_a_cascade_without_meaning_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
