"""Does the strength that a compass shows tell how far its heading deviates as the vehicle turns?

    .venv/bin/python benchmarks/iron.py LABELS.json ...

Iron and currents on board add a field. Of its three parts one changes the strength, two turn the
heading; if it comes from anywhere alike, all three are equally large. Prints, for every compass of
a recorded flight that turned by 40 degrees and more before anything failed: by how much
the strength is off the Earth's at first, over the horizontal field, and the root mean square of the
deviation since then, over how far the vehicle had turned. Both in rad; the estimated yaw counts as
true. Then in how many the deviation is within twice what `shared/compass.yaml` expects, with a
calibration's deviation alone and with the strength.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np

from fdi.errors import FdiError
from fdi.evaluation import load_labels
from fdi.methods.setup.compass import all_readings, earth_field, in_flight
from fdi.methods.setup.records import attitude
from fdi.model.evaluate import Floats, wrap
from fdi.telemetry import Log, read

CALIBRATED: float = 0.025
"""rad, the first entry of `swings` in models/shared/compass.yaml."""
MEAN_S: float = 2.0
FIRST_S: float = 20.0
TURNED: float = 0.7
"""Twice the sine of half of 40 degrees."""
FEWEST: int = 3


def main() -> int:
    """Print the table."""
    labels = [one for path in sys.argv[1:] for one in load_labels(path)]
    expected, found = [], []
    print(f"{'flight':<44}compass  strength off  deviates")
    for label in labels:
        if label.origin != "recorded":
            continue
        until = min(one for one in (label.onset, label.evaluate_until, np.inf) if one is not None)
        try:
            rows = list(deviations(read(label.path), until))
        except FdiError:
            continue
        for number, off, deviates in rows:
            print(f"{label.key[-43:]:<44}{number:^7}{off:>13.2f}{deviates:>10.2f}")
            expected.append(abs(off))
            found.append(deviates)
    off, deviates = np.array(expected), np.array(found)
    if not off.size:
        print("no such flight")
        return 1
    by_strength = np.hypot(CALIBRATED, off)
    for name, sd in (
        ("a calibration's alone", np.full(off.shape, CALIBRATED)),
        ("with the strength", by_strength),
    ):
        print(f"within twice {name}: {np.count_nonzero(deviates < 2 * sd)} of {off.size}")
    print(f"deviation over what is expected, root mean square: {_rms(deviates / by_strength):.2f}")
    return 0


def deviations(log: Log, until: float) -> Iterator[tuple[int, float, float]]:
    """Yield number, strength off over the horizontal field, and deviation over turned, rad."""
    known, model = attitude(log), earth_field(log)
    if known is None or model is None:
        return
    flat, declination = np.hypot(*model[:2]), np.arctan2(model[1], model[0])
    for number, readings in all_readings(log).items():
        turn, field = in_flight(log, readings, known, end=until)
        if not turn.t.size:
            continue
        north, east = np.einsum("nji,nj->in", turn.values, field)[:2]
        apart = declination - np.arctan2(east, north)
        yaw = np.arctan2(turn.values[:, 0, 1], turn.values[:, 0, 0])
        t, (error, heading) = _means(turn.t, apart, yaw)
        at_first = t < t[0] + FIRST_S
        off = np.median(np.linalg.norm(field, axis=1)[turn.t < turn.t[0] + FIRST_S])
        since = wrap(error - np.angle(np.exp(1j * error[at_first]).mean()))
        turned = 2 * np.sin(wrap(heading - np.angle(np.exp(1j * heading[at_first]).mean())) / 2)
        far = np.abs(turned) > TURNED
        if np.count_nonzero(far) >= FEWEST:
            yield number, float((off - np.linalg.norm(model)) / flat), _rms((since / turned)[far])


def _means(t: Floats, *angles: Floats) -> tuple[Floats, list[Floats]]:
    """Return the middles of stretches of `MEAN_S`, and the means of angles there."""
    place = np.unique(np.floor((t - t[0]) / MEAN_S), return_inverse=True)[1]
    count = np.bincount(place)
    means = [
        np.angle(np.bincount(place, np.cos(one)) + 1j * np.bincount(place, np.sin(one)))
        for one in angles
    ]
    return np.bincount(place, t) / count, means


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


if __name__ == "__main__":
    sys.exit(main())
