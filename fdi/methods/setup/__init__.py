"""Was the vehicle set up wrongly? The physics of one flight says.

Given a log; sought motors that are swapped or turn the wrong way, reversed surfaces, sensors that
are turned, too little thrust, such that what is told is beyond doubt and a person can check it by
its numbers. `check_setup` takes a `Log` and gives `Check`s.

- ``values.py``: `Check`, and `Setting`, what would make it right
- ``checks.py``: the table of all checks, `check_setup`
- ``records.py``: the log's own records, and the stretches that count
- ``moments.py``: change of body rates against inputs, interval by interval
- ``against.py``: by what angle a vehicle turns against what its motors are asked for
- ``arrangements.py``: other ways in which motors may be arranged
- ``judge.py``: which arrangement the moments speak for
- ``motors.py``, ``surfaces.py``: multicopters, planes
- ``rotations.py``: MAVLink's orientations
- ``orientation.py``: which parameter says how a compass is mounted
- ``turned.py``: by what angle a compass is turned about the vertical, without a heading
- ``agreement.py``: do compasses point the same way before take-off?
- ``compass.py``, ``field.py``, ``heading.py``: compasses, the field at them, and the heading
  against the receiver
- ``witnesses.py``: which compass is wrong by itself, where others fit with the same attitude
- ``mounting.py``: accelerometers and gyroscopes
- ``vibration.py``: how much it shakes, by what the autopilot's makers call too much
- ``oscillation.py``: does it swing about an axis, and its motors with it?
- ``thrust.py``, ``battery.py``: thrust to weight, motors at their limits, a battery that runs down
- ``interval.py``: how far may be off what was measured
"""

from fdi.methods.setup.checks import check_setup
from fdi.methods.setup.values import VERDICTS, Check, Setting

__all__ = ["VERDICTS", "Check", "Setting", "check_setup"]
