"""Dynamic systems that are simulated from their own equations, with faults, to be diagnosed.

The three tanks and the induction motor are the models of the toolbox of record (its examples
ThreeTank and InductionMotor; Aguilera et al. 2016), the engine is a mean value model of an intake
manifold and a crankshaft (Hendricks and Sorenson, SAE 900616, 1990) with numbers of a car.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fdi.residuals import Bank
from fdi.telemetry import Signals
from fdi.telemetry.events import flight_state

TANKS = """
format: 1
name: three_tanks
variables:
  p1: {unit: Pa}
  p2: {unit: Pa}
  p3: {unit: Pa}
  q0: {unit: m^3/s}
  q1: {unit: m^3/s}
  q2: {unit: m^3/s}
  q3: {unit: m^3/s}
  dp1: {unit: Pa/s}
  dp2: {unit: Pa/s}
  dp3: {unit: Pa/s}
parameters:
  r: {value: 1.0e+7, unit: Pa*s/m^3}
  c: {value: 1.0e-6, unit: m^3/Pa}
equations:
  valve_1: {text: "q1 = (p1 - p2)/r", fault: V1, component: valve_1}
  valve_2: {text: "q2 = (p2 - p3)/r", fault: V2, component: valve_2}
  valve_3: {text: "q3 = p3/r", fault: V3, component: valve_3}
  tank_1: {text: "dp1 = (q0 - q1)/c", fault: T1, component: tank_1}
  tank_2: {text: "dp2 = (q1 - q2)/c", fault: T2, component: tank_2}
  tank_3: {text: "dp3 = (q2 - q3)/c", fault: T3, component: tank_3}
  rise_1: dp1 = der(p1)
  rise_2: dp2 = der(p2)
  rise_3: dp3 = der(p3)
inputs:
  DATA:
    fields:
      y1: {variable: p1, accuracy: 30 Pa}
      y2: {variable: q2, accuracy: 1.0e-5 m^3/s}
      y3: {variable: q0, accuracy: 1.0e-5 m^3/s}
"""

MOTOR = """
format: 1
name: induction_motor
variables:
  i_a: {unit: A}
  i_b: {unit: A}
  flux_a: {unit: V*s}
  flux_b: {unit: V*s}
  w: {unit: rad/s}
  di_a: {unit: A/s}
  di_b: {unit: A/s}
  dflux_a: {unit: V}
  dflux_b: {unit: V}
  dw: {unit: rad/s^2}
  e_a: {unit: V}
  e_b: {unit: V}
  load: {unit: N*m}
  u_a: {unit: V}
  u_b: {unit: V}
parameters:
  a: {value: 120, unit: 1/s}
  b: {value: 60, unit: 1/H}
  c: {value: 8, unit: 1/s}
  d: {value: 60, unit: 1/H}
  mutual: {value: 0.1, unit: H}
  k: {value: 40, unit: 1/kg/m^2}
  drag: {value: 0.002, unit: N*m*s}
equations:
  emf_a: e_a = w*flux_a
  emf_b: e_b = w*flux_b
  stator_a: di_a = -a*i_a + b*c*flux_a + b*e_b + d*u_a
  stator_b: di_b = -a*i_b + b*c*flux_b - b*e_a + d*u_b
  rotor_a: dflux_a = mutual*c*i_a - c*flux_a - e_b
  rotor_b: dflux_b = mutual*c*i_b - c*flux_b + e_a
  shaft: dw = k*(i_b*flux_a - i_a*flux_b) - k*drag*w - k*load
  rise_ia: di_a = der(i_a)
  rise_ib: di_b = der(i_b)
  rise_fa: dflux_a = der(flux_a)
  rise_fb: dflux_b = der(flux_b)
  rise_w: dw = der(w)
inputs:
  DATA:
    fields:
      u_a: {variable: u_a, accuracy: 0.5 V}
      u_b: {variable: u_b, accuracy: 0.5 V}
      y3: {variable: w, accuracy: 0.2 rad/s}
measurements:
  CURRENT:
    component: sensors
    fields:
      y1: {variable: i_a, accuracy: 0.1 A}
      y2: {variable: i_b, accuracy: 0.1 A}
"""

ENGINE = """
format: 1
name: engine
variables:
  p: {unit: Pa, domain: [10000, 110000]}
  n: {unit: rad/s, domain: [50, 700]}
  dp: {unit: Pa/s}
  dn: {unit: rad/s^2}
  air: {unit: kg/s}
  charge: {unit: kg/s}
  angle: {unit: rad}
  load: {unit: N*m}
parameters:
  filling: {value: 2.5e+7, unit: Pa/kg}
  bore: {value: 0.35, unit: kg/s}
  ambient: {value: 101325, unit: Pa}
  pumped: {value: 2.0e-9, unit: kg/Pa/rad}
  burnt: {value: 1.2e+6, unit: J/kg}
  drag: {value: 0.05, unit: N*m*s}
  inertia: {value: 0.4, unit: kg*m^2}
equations:
  throttle: {text: "air = bore*sin(angle)**2*sqrt(1 - p/ambient)", solves: [air]}
  cylinders: {text: "charge = pumped*p*n", solves: [charge]}
  manifold: dp = filling*(air - charge)
  shaft: {text: "dn = (burnt*charge/n - drag*n - load)/inertia", solves: [dn]}
  rise_p: dp = der(p)
  rise_n: dn = der(n)
inputs:
  BRAKE:
    fields:
      load: {variable: load, accuracy: 0.5 N*m}
measurements:
  ECU:
    component: sensors
    fields:
      angle: {variable: angle, accuracy: 0.002 rad}
      maf: {variable: air, accuracy: 3.0e-4 kg/s}
      map: {variable: p, accuracy: 300 Pa}
      speed: {variable: n, accuracy: 0.5 rad/s}
"""

Columns = dict[str, np.ndarray]


@dataclass(frozen=True)
class Simulated:
    """A plant: its model, its rates and outputs with a fault of a size, and how it is sampled.

    ``sizes``: of every fault by name; ``noise``: standard deviation of every channel.
    """

    text: str
    start: tuple[float, ...]
    rates: Callable
    shown: Callable
    sizes: dict[str, float]
    noise: dict[str, float]
    rate_hz: float
    samples: int
    substeps: int = 10

    def run(self, fault: str = "", at: float = 0.5, seed: int = 0) -> Columns:
        """Return noisy channels; the fault begins after a share of the samples and stays."""
        rng = np.random.default_rng(seed)
        h = 1 / self.rate_hz / self.substeps
        x = np.array(self.start)
        rows = []
        for k in range(self.samples):
            now = {fault: self.sizes[fault]} if fault and k >= at * self.samples else {}
            rows.append(self.shown(k / self.rate_hz, x, now))
            for j in range(self.substeps):
                t = k / self.rate_hz + j * h
                first = self.rates(t, x, now)
                x = x + h * self.rates(t + h / 2, x + h / 2 * first, now)
        table = {name: np.array([row[name] for row in rows]) for name in self.noise}
        return {
            name: column + rng.normal(0, self.noise[name], len(column))
            for name, column in table.items()
        }


def _tanks(t, p, fault):
    q0 = 3e-4 + 1e-4 * np.sin(t / 40)
    open_ = [1 - fault.get(f"V{i}", 0.0) for i in (1, 2, 3)]
    q = [(p[0] - p[1]) / 1e7 * open_[0], (p[1] - p[2]) / 1e7 * open_[1], p[2] / 1e7 * open_[2]]
    return q0, q


def _tank_rates(t, p, fault):
    q0, q = _tanks(t, p, fault)
    leak = [fault.get(f"T{i}", 0.0) * p[i - 1] / 1e7 for i in (1, 2, 3)]
    return np.array([q0 - q[0] - leak[0], q[0] - q[1] - leak[1], q[1] - q[2] - leak[2]]) / 1e-6


def _tank_shown(t, p, fault):
    q0, q = _tanks(t, p, fault)
    return {"DATA.y1": p[0], "DATA.y2": q[1], "DATA.y3": q0}


def _volts(t):
    slip = 2 * np.pi * 10 * t  # 10 Hz of the grid
    return 60 * np.cos(slip), 60 * np.sin(slip)


def _motor_rates(t, x, fault):
    i_a, i_b, f_a, f_b, w = x
    u_a, u_b = _volts(t)
    return np.array(
        [
            -120 * i_a + 60 * 8 * f_a + 60 * w * f_b + 60 * u_a,
            -120 * i_b + 60 * 8 * f_b - 60 * w * f_a + 60 * u_b,
            0.1 * 8 * i_a - 8 * f_a - w * f_b,
            0.1 * 8 * i_b - 8 * f_b + w * f_a,
            40 * (i_b * f_a - i_a * f_b) - 40 * 0.002 * w - 40 * 1.0,
        ]
    )


def _motor_shown(t, x, fault):
    u_a, u_b = _volts(t)
    return {
        "DATA.u_a": u_a,
        "DATA.u_b": u_b,
        "DATA.y3": x[4],
        "CURRENT.y1": x[0] + fault.get("CURRENT.y1", 0.0),
        "CURRENT.y2": x[1] + fault.get("CURRENT.y2", 0.0),
    }


def _driven(t):
    return 0.25 + 0.05 * np.sin(t / 3), 40 + 10 * np.sin(t / 7)


def _engine_rates(t, x, fault):
    p, n = x
    angle, load = _driven(t)
    charge = 2e-9 * p * n
    dp = 2.5e7 * (0.35 * np.sin(angle) ** 2 * np.sqrt(1 - p / 101325) - charge)
    return np.array([dp, (1.2e6 * charge / n - 0.05 * n - load) / 0.4])


def _engine_shown(t, x, fault):
    angle, load = _driven(t)
    air = 0.35 * np.sin(angle) ** 2 * np.sqrt(1 - x[0] / 101325)
    clean = {
        "ECU.angle": angle,
        "ECU.maf": air,
        "ECU.map": x[0],
        "ECU.speed": x[1],
        "BRAKE.load": load,
    }
    return {name: value + fault.get(name, 0.0) for name, value in clean.items()}


PLANTS = {
    "three tanks": Simulated(
        TANKS,
        (9e3, 6e3, 3e3),
        _tank_rates,
        _tank_shown,
        {"V1": 0.3, "V2": 0.3, "V3": 0.3, "T1": 0.2, "T2": 0.2, "T3": 0.2},
        {"DATA.y1": 30.0, "DATA.y2": 1e-5, "DATA.y3": 1e-5},
        2.0,
        500,
    ),
    "induction motor": Simulated(
        MOTOR,
        (0.0, 0.0, 0.0, 0.0, 0.0),
        _motor_rates,
        _motor_shown,
        {"CURRENT.y1": 2.0, "CURRENT.y2": 2.0},
        {"DATA.u_a": 0.5, "DATA.u_b": 0.5, "DATA.y3": 0.2, "CURRENT.y1": 0.1, "CURRENT.y2": 0.1},
        500.0,
        1000,
    ),
    "engine": Simulated(
        ENGINE,
        (4e4, 300.0),
        _engine_rates,
        _engine_shown,
        {"ECU.angle": 0.02, "ECU.maf": 3e-3, "ECU.map": 3e3, "ECU.speed": 15.0},
        {
            "ECU.angle": 0.002,
            "ECU.maf": 3e-4,
            "ECU.map": 300.0,
            "ECU.speed": 0.5,
            "BRAKE.load": 0.5,
        },
        20.0,
        200,
        20,
    ),
}


def signals_of(bank: Bank, columns: Columns, rate_hz: float) -> Signals:
    """Signals by hand; the channels' own period is 0, so that times are certain."""
    t = np.arange(len(next(iter(columns.values())))) / rate_hz
    by_channel = {
        request.channel: columns[str(request.channel)] for request in bank.system.channels
    }
    period = dict.fromkeys(by_channel, 0.0)
    return Signals(t, by_channel, period, flight_state(t, (), ()), rate_hz, (), (), {}, "by hand")
