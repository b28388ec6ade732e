"""What every node of the control chain takes for granted: the robot, its working mode, and the time between samples."""

from __future__ import annotations

from fivebar_description.ros.parameters import Spec, whole_period

ROBOT = Spec("robot", "dextar", "Robot that the node believes in: a shipped parameter file's name or a path to one.")
RATE = Spec("rate_hz", 500, "Sampling rate; it must divide 1e9.", "Hz", 1, 10_000, check=whole_period)
WORKING_MODE = Spec(
    "working_mode", [1, -1], "Elbow side of each leg: +1 counter-clockwise of the line from base to platform."
)

LEAD = Spec(
    "lead_samples",
    0,
    "Samples from a measurement to the moment that its answer is for: the drives' delay where an estimator predicts.",
    "samples",
    0,
    100,
)
