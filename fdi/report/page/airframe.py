"""Where on the vehicle is what is accused? The airframe from above, nose up, as SVG.

In: an analysis. Out: a picture: motors where the log says they are, with their numbers and which
way they turn; of a plane wings, tail and surfaces; all other parts of the model as labels below.
The parts are marked as accused, following from it, cleared, open or not testable. A frame that the
log does not tell is not drawn: its motors are labels.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import cos, hypot, pi, sin
from typing import Final

from fdi.model.naming import component_words
from fdi.report.page.drawing import escaped
from fdi.report.words import shortened
from fdi.result import Analysis
from fdi.telemetry.motors import Motor, motors_of

WIDTH: Final = 380
MIDDLE: Final = 190
TALL: Final = 290
REACH: Final = 105.0
"""From the middle to the outermost motors."""
RADIUS: Final = 27
ASIDE: Final = 46
"""From a motor to the other one on its arm."""
COLUMNS: Final = 2
PILL: Final = 25
HIDDEN: Final = ("outside_model",)
STATES: Final = {
    "accused": "accused",
    "second": "as likely: cannot be told from it",
    "follows": "follows from it",
    "cleared": "ruled out",
    "open": "neither accused nor cleared",
    "untested": "this telemetry cannot show it",
}
_HUB: Final = f'<rect class="hull" x="{MIDDLE - 27}" y="118" width="54" height="64" rx="14"/>'
_WINGED: Final = ("plane", "vtol")
_PLANE: Final = (
    '<path class="hull" d="M190 22c12 0 17 20 17 48l0 34 126 26 0 30-126-4-5 66 46 20 0 20-58-6'
    '-58 6 0-20 46-20-5-66-126 4 0-30 126-26 0-34c0-28 5-48 17-48z"/>'
)
_SURFACES: Final = {
    "aileron": ("M62 152l84 3v10l-84-3z", "M318 152l-84 3v10l84-3z"),
    "elevator": ("M134 258l50 -5v11l-50 5z", "M246 258l-50 -5v11l50 5z"),
    "rudder": ("M187 226h6v42h-6z",),
    "engine": ("M160 18h60v7h-60z",),
    "airspeed": ("M290 108h5v22h-5z",),
}


def states_of(analysis: Analysis) -> dict[str, str]:
    """Return how every component stands, by `STATES`."""
    diagnosis = analysis.diagnosis
    found = dict.fromkeys((one.component for one in diagnosis.not_testable), "untested")
    found |= dict.fromkeys((one.component for one in diagnosis.open), "open")
    found |= dict.fromkeys((one.component for one in diagnosis.ruled_out), "cleared")
    found |= dict.fromkeys((one.component for one in diagnosis.consequences), "follows")
    for finding in diagnosis.findings:
        found |= dict.fromkeys(finding.inseparable_from, "second")
    return found | dict.fromkeys((one.component for one in diagnosis.findings), "accused")


def airframe_svg(analysis: Analysis) -> str:
    """Return the picture."""
    states = states_of(analysis)
    components = analysis.system.components
    log = analysis.log
    motors = motors_of(log.parameters, log.autopilot, log.vehicle)
    places = _places(motors)
    drawn = {f"motor_{motor.number}" for motor in motors}
    picture = [f'<path class="arm" d="M{MIDDLE} 150L{x:.0f} {y:.0f}"/>' for x, y in places]
    if log.vehicle in _WINGED:
        own = [name for name in _SURFACES if name in components]
        picture.append(_PLANE)
        picture += [_part(name, path, states) for name in own for path in _SURFACES[name]]
        picture += _plane_words(states, set(own))
        drawn.update(own)
    elif motors:
        picture.append(_HUB)
    picture += _motors(motors, places, states)
    top = TALL if picture else 8
    rest = [name for name in components if name not in drawn and name not in HIDDEN]
    order = list(STATES)
    rest.sort(key=lambda name: order.index(states.get(name, "open")))
    labels = [
        _label(place, component_words(name, components), states.get(name, "open"), top)
        for place, name in enumerate(rest)
    ]
    height = top + PILL * -(-len(rest) // COLUMNS) + 6
    accused = [component_words(one.component, components) for one in analysis.findings]
    told = f"accused: {shortened(accused, 6)}" if accused else "nobody is accused"
    nose = '<path class="nose" d="M190 2l7 11h-14z"/>' if picture else ""
    return (
        f'<svg class="airframe" viewBox="0 0 {WIDTH} {height}" role="img" '
        f'aria-label="The airframe from above, nose up; {escaped(told)}">'
        + nose
        + "".join([*picture, *labels])
        + "</svg>"
    )


def _motors(
    motors: tuple[Motor, ...], places: Sequence[tuple[float, float]], states: Mapping[str, str]
) -> Iterator[str]:
    apart = [hypot(a - x, b - y) for i, (a, b) in enumerate(places) for x, y in places[:i]]
    radius = min(RADIUS, int(min(apart) / 2) - 1) if apart else RADIUS  # none covers another
    for motor, (x, y) in zip(motors, places, strict=True):
        state = states.get(f"motor_{motor.number}", "open")
        turn = _turn(motor)
        told = escaped(f"motor {motor.number}{turn and f', turns {turn}'}: {STATES[state]}")
        yield (
            f'<g class="motor {state}"><title>{told}</title>'
            f'<circle cx="{x:.0f}" cy="{y:.0f}" r="{radius}"/>'
            + (_arrow(x, y, radius - 5, clockwise=turn == "clockwise") if turn else "")
            + f'<text x="{x:.0f}" y="{y + 6:.0f}">{motor.number}</text></g>'
        )


def _turn(motor: Motor) -> str:
    return "counter-clockwise" if motor.yaw > 0 else "clockwise" if motor.yaw < 0 else ""


def _places(motors: tuple[Motor, ...]) -> list[tuple[float, float]]:
    """Return where each motor is drawn; of two at one place the second stands beside the first."""
    found: list[tuple[float, float]] = []
    for motor in motors:
        x, y = MIDDLE - motor.roll * REACH, 150 - motor.pitch * REACH
        while any(abs(x - a) < RADIUS and abs(y - b) < RADIUS for a, b in found):
            x += ASIDE if x >= MIDDLE else -ASIDE
        found.append((x, y))
    return found


def _arrow(x: float, y: float, radius: float, *, clockwise: bool) -> str:
    """Return an arc with a head: three quarters of a turn, as the propeller goes."""
    way = 1 if clockwise else -1
    angles = [way * (-0.75 * pi), way * (0.45 * pi)]
    ends = [(x + radius * sin(a), y - radius * cos(a)) for a in angles]
    (x0, y0), (x1, y1) = ends
    ahead = angles[1] + way * pi / 2  # along the circle
    head = [
        (x1 + 7 * sin(ahead + side), y1 - 7 * cos(ahead + side)) for side in (pi - 0.5, pi + 0.5)
    ]
    return (
        f'<path class="turn" d="M{x0:.1f} {y0:.1f}A{radius} {radius} 0 1 {1 if clockwise else 0} '
        f"{x1:.1f} {y1:.1f}M{head[0][0]:.1f} {head[0][1]:.1f}L{x1:.1f} {y1:.1f}"
        f'L{head[1][0]:.1f} {head[1][1]:.1f}"/>'
    )


def _part(name: str, path: str, states: dict[str, str]) -> str:
    state = states.get(name, "open")
    told = escaped(f"{name.replace('_', ' ')}: {STATES[state]}")
    return f'<path class="part {state}" d="{path}"><title>{told}</title></path>'


def _plane_words(states: dict[str, str], drawn: set[str]) -> Iterator[str]:
    places = {
        "aileron": (104, 182),
        "elevator": (190, 284),
        "rudder": (154, 212),
        "engine": (248, 30),
        "airspeed": (314, 106),
    }
    for name, (x, y) in places.items():
        if name in drawn:
            state = states.get(name, "open")
            yield f'<text class="name {state}" x="{x}" y="{y}">{escaped(name)}</text>'


def _label(place: int, words: str, state: str, top: int) -> str:
    column, row = place % COLUMNS, place // COLUMNS
    wide = WIDTH / COLUMNS
    x, y = column * wide + 2, top + row * PILL
    shown = words if len(words) <= 27 else words[:26] + "…"
    return (
        f'<g class="pill {state}"><title>{escaped(f"{words}: {STATES[state]}")}</title>'
        f'<rect x="{x:.0f}" y="{y}" width="{wide - 4:.0f}" height="{PILL - 4}" rx="5"/>'
        f'<text x="{x + 7:.0f}" y="{y + 15}">{escaped(shown)}</text></g>'
    )
