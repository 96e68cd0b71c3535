"""Calibration of strain gauges, and diagnosis of the gap between a simulator and a recording.

`calibrate` fits a calibration that converts the signal of a gauge to a length or an angle. `diagnose` compares a simulator with
recordings and names the effects that the simulator lacks. `compare` compares two recordings, without a simulator.

>>> import numpy as np, stretch_gap
>>> time_s = np.arange(0, 20, 0.01)
>>> angle_deg = 45 - 45 * np.cos(1.5 * time_s)
>>> gauge = 0.002 * np.interp(time_s - 0.05, time_s, angle_deg)  # a gauge with a delay of 50 ms
>>> calibration = stretch_gap.calibrate(gauge, angle_deg, time_s=time_s, model="poly13", reference_name="angle_deg")
>>> estimate = calibration.apply(gauge, rate_hz=100.0)
>>> bool(np.nanmax(np.abs(estimate.value - angle_deg)) < 3.0)
True
"""

from ._stretch import Reading, Receptor, Refused, StretchError, __version__
from .calibration import Calibration, Estimate, calibrate
from .compare import compare
from .diagnosis import Diagnosis, diagnose, wrappers
from .evaluation import Evaluation, evaluate
from .fix import Fix, Prediction
from .problem import Argument, Effect, Parameter, Stage, Trial
from .reading import Recording, convert, read
from .recordings import DoubtWarning

__all__ = [
    "Argument",
    "Calibration",
    "Diagnosis",
    "DoubtWarning",
    "Effect",
    "Estimate",
    "Evaluation",
    "Fix",
    "Parameter",
    "Prediction",
    "Reading",
    "Receptor",
    "Recording",
    "Refused",
    "Stage",
    "StretchError",
    "Trial",
    "__version__",
    "calibrate",
    "compare",
    "convert",
    "diagnose",
    "evaluate",
    "read",
    "wrappers",
]
