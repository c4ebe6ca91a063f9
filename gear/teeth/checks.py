"""Teeth that cannot be cut, put together or kept in contact: each said with the numbers and what would help."""

import math
from typing import Any

from gear.quantities import check_count
from gear.teeth.involute import LOWEST_ANGLE, Gearing, Rack, Teeth, gearing, involute, working_involute

UNDERCUT_ALLOWED = 0.01  # modules; the customary limit of 17 teeth at 20 degrees lacks 0.006


def require_teeth(owner: Any) -> None:
    """Raise where a number of teeth is not a whole number."""
    for name in ("teeth_a", "teeth_b"):
        check_count(owner, name, of="teeth")


def require_possible(name: str, rack: Rack, a: Teeth, b: Teeth) -> None:
    """Raise where two wheels cannot mesh; what is of a ring gear B is negative.

    Roots are not looked at: clearance and fillets are the tool's affair, and a ring is not cut by a rack.

    Raises
    ------
    ValueError
        Naming the pair, what is wrong, the lengths, and the fields that would help, for: a center distance that
        does not exist; a tip inside its base circle or short of the pitch circle; interference at a base circle;
        undercut; pointed teeth; tips of wheel and ring in each other's way; a contact ratio below one.
    """
    _require_center_distance(name, rack, a, b)
    pair = gearing(rack, a, b)
    _require_reach(name, pair)
    _require_no_interference(name, pair)
    _require_no_undercut(name, pair)
    _require_thickness(name, pair)
    _require_clear_tips(name, pair)
    if pair.contact_ratio() < 1:
        raise ValueError(
            f"{name} needs a contact ratio >= 1 to hand over from tooth to tooth, got {pair.contact_ratio():.4g}; "
            f"take {_longer(a, 'a')} or {_longer(b, 'b')}"
        )


def _require_center_distance(name: str, rack: Rack, a: Teeth, b: Teeth) -> None:
    """A sum of shifts for which the involute equation has a solution."""
    reference = involute(rack.transverse_angle)
    lowest = min(involute(LOWEST_ANGLE), reference)
    if working_involute(rack, a, b) < lowest:
        limit = (lowest - reference) * (a.count + b.count) / (2 * math.tan(rack.pressure_angle))
        raise ValueError(
            f"{name} needs shift_a + shift_b {'<=' if b.count < 0 else '>='} {limit:.4g} with {a.count} and "
            f"{abs(b.count)} teeth, got {a.shift + b.shift:.4g}: the wheels come so close that the working pressure "
            f"angle falls below {math.degrees(LOWEST_ANGLE):.0f} deg"
        )


def _require_reach(name: str, pair: Gearing) -> None:
    """Tips beyond the pitch circle, so that contact lasts on both sides of the pitch point."""
    for wheel, teeth, tip, radius in (
        ("a", pair.a, pair.tip_a, pair.radius_a),
        ("b", pair.b, pair.tip_b, pair.radius_b),
    ):
        if tip <= radius:
            raise ValueError(
                f"{name}: no contact beyond the pitch point, as the tip radius of wheel {wheel}, {_mm(tip)}, does not "
                f"reach its working pitch radius of {_mm(radius)}; take {_longer(teeth, wheel)}"
            )
    if pair.b.count < 0 and pair.tip_b >= pair.base_b:
        raise ValueError(
            f"{name}: the tip radius of wheel b, {_mm(pair.tip_b)}, is inside its base circle of {_mm(pair.base_b)}, "
            f"where there is no involute; take {_shorter(pair.b, 'b')}"
        )


def _require_no_interference(name: str, pair: Gearing) -> None:
    """Contact that ends before the base tangent points; a ring has none on its side."""
    path = pair.path()
    sides = [("a", "b", pair.b, path.start)]
    if pair.b.count > 0:
        sides.append(("b", "a", pair.a, path.length - path.end))
    for wheel, other, mate, distance in sides:
        if distance < 0:
            raise ValueError(
                f"{name}: the tip of wheel {other} reaches {_mm(distance)} below the base tangent point of wheel "
                f"{wheel} (interference); needs more teeth on wheel {wheel}, a larger pressure angle, a larger "
                f"shift_{wheel} or {_shorter(mate, other)}"
            )


def _require_no_undercut(name: str, pair: Gearing) -> None:
    """Profile shifts that keep the rack, as deep as the larger addendum of the pair, off the base tangent point.

    shift >= addendum - z sin(alpha_t)^2 / (2 cos(beta))
    """
    rack, depth = pair.rack, max(pair.a.addendum, pair.b.addendum)
    per_tooth = math.sin(rack.transverse_angle) ** 2 / (2 * math.cos(rack.helix_angle))
    for wheel, teeth in (("a", pair.a), ("b", pair.b)):
        least = depth - teeth.count * per_tooth
        if teeth.count > 0 and teeth.shift < least - UNDERCUT_ALLOWED:
            enough = math.ceil((depth - teeth.shift - UNDERCUT_ALLOWED) / per_tooth)
            raise ValueError(
                f"{name}: the {teeth.count} teeth of wheel {wheel} are undercut by a rack with addendum {depth:.4g}; "
                f"needs shift_{wheel} >= {least:.4g}, got {teeth.shift:.4g}, or at least {enough} teeth"
            )


def _require_thickness(name: str, pair: Gearing) -> None:
    """Flanks that do not cross before the tip."""
    for wheel, teeth, tip, base in (("a", pair.a, pair.tip_a, pair.base_a), ("b", pair.b, pair.tip_b, pair.base_b)):
        thickness = 2 * tip * teeth.half_thickness(pair.rack, math.acos(base / tip))
        if thickness <= 0:
            raise ValueError(
                f"{name}: the teeth of wheel {wheel} are pointed, their flanks cross before the tip radius of "
                f"{_mm(tip)} (thickness there {1e3 * thickness:.4g} mm); take {_shorter(teeth, wheel)} or a smaller "
                f"shift_{wheel}"
            )


def _require_clear_tips(name: str, pair: Gearing) -> None:
    """Tips of a wheel and its ring that pass each other where the tip circles cross, away from the path of contact.

    From the position where both flanks are at the pitch point the tip of A turns by at_a + lead_a to where the
    circles cross, and the ring meanwhile by z_A / z_B of that; its own tip must not have come as far as at_b + lead_b.
    """
    if pair.b.count > 0:
        return
    distance, tip_a, tip_b = pair.center_distance, pair.tip_a, -pair.tip_b
    if tip_a < distance + tip_b:
        at_a = math.acos((tip_b**2 - tip_a**2 - distance**2) / (2 * distance * tip_a))
        at_b = math.acos((tip_b**2 - tip_a**2 + distance**2) / (2 * distance * tip_b))
        lead_a = involute(math.acos(pair.base_a / pair.tip_a)) - involute(pair.angle)
        lead_b = involute(math.acos(pair.base_b / pair.tip_b)) - involute(pair.angle)
        gap = tip_b * ((at_a + lead_a) * pair.a.count / -pair.b.count - (at_b + lead_b))
    else:
        gap = distance + tip_b - tip_a  # the circles do not cross, the teeth are in each other all around
    if gap < 0:
        raise ValueError(
            f"{name}: the tips of wheel a and of the ring overlap by {_mm(gap)} where they pass each other away from "
            f"the path of contact; needs a larger difference of teeth than {-pair.b.count} - {pair.a.count}, a larger "
            f"pressure angle, {_shorter(pair.a, 'a')} or {_shorter(pair.b, 'b')}"
        )


def _longer(teeth: Teeth, wheel: str) -> str:
    return _other_tip(teeth, wheel, "larger", "smaller")


def _shorter(teeth: Teeth, wheel: str) -> str:
    return _other_tip(teeth, wheel, "smaller", "larger")


def _other_tip(teeth: Teeth, wheel: str, outward: str, inward: str) -> str:
    """The field by which the tip was given, and the way to change it; the tip radius of a ring goes the other way."""
    if teeth.tip_radius is None:
        return f"a {outward} addendum_{wheel}"
    return f"a {outward if teeth.count > 0 else inward} tip_radius_{wheel}"


def _mm(length: float) -> str:
    return f"{1e3 * abs(length):.4g} mm"
