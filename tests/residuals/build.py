"""Small models written as text, for the tests."""

from pathlib import Path

from fdi.model import load_airframe

GLIDER = """
format: 1
name: glider
components:
  gps: {group: sensor}
variables:
  v_n: {unit: m/s}
  v_e: {unit: m/s}
  v_ground: {unit: m/s, domain: [0, null]}
  course: {unit: rad, circular: true}
  h: {unit: m}
  climb: {unit: m/s}
parameters:
  slow: {value: 3, unit: m/s, log: {name: SLOW_CM, scale: 0.01}}
equations:
  k_1: v_ground = sqrt(v_n**2 + v_e**2)
  k_2: {text: "course = atan2(v_e, v_n)", when: "v_ground > slow", solves: [course]}
  k_3: climb = der(h)
limits:
  l_1: {variable: h, min: 0, max: 5000}
measurements:
  LOCAL_POSITION_NED:
    component: estimator
    fields:
      vx: {variable: v_n, accuracy: 0.2 m/s}
      vy: {variable: v_e, accuracy: 0.2 m/s}
  GPS_RAW_INT:
    component: gps
    when: fix_type >= 3
    fields:
      vel: {variable: v_ground, accuracy: 0.3 m/s}
      cog: {variable: course, accuracy: 3 deg}
  VFR_HUD:
    component: barometer
    fields:
      alt: {variable: h, accuracy: 0.1 m}
      climb: {variable: climb, accuracy: 0.4 m/s}
"""


def airframe(folder: Path, text: str = GLIDER):
    """The airframe of a text."""
    path = folder / "m.yaml"
    path.write_text(text, encoding="utf-8")
    return load_airframe(path)
