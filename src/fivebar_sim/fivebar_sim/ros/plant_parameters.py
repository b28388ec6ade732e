"""The parameters of the plant node."""

from __future__ import annotations

from fivebar_description.ros.parameters import Spec, whole_period

LOCKSTEP, REALTIME = "lockstep", "realtime"
ALL_JOINTS, MOTORS = "joint_states", "motor_states"

START_JOINTS = [1.6573402912344397, -0.9225800732005386, 1.4842523623553534, 0.9225800732005386]
"""At rest at (0, 0.15) m with the elbows outwards, where the middle crossing starts."""

SPECS = (
    Spec("robot", "dextar", "Robot that is simulated: a shipped parameter file's name or a path to one."),
    Spec("rate_hz", 500, "Sampling rate; it must divide 1e9.", "Hz", 1, 10_000, check=whole_period),
    Spec("samples", 1000, "Number of the last sample of the run.", "", 1, 100_000_000),
    Spec(
        "mode",
        LOCKSTEP,
        "Lockstep waits for the torque of each sample; realtime follows the steady clock.",
        choices=(LOCKSTEP, REALTIME),
    ),
    Spec(
        "publishes",
        ALL_JOINTS,
        "The four joints for the controllers, or the two motors for an estimator with the exact state beside.",
        choices=(ALL_JOINTS, MOTORS),
    ),
    Spec("initial_joints", START_JOINTS, "Posture at the start: q11, q12, q21, q22 of a closed loop.", "rad"),
    Spec("wait_for_nodes", [""], "Nodes that must have announced themselves on run/ready before sample 0."),
    Spec("ready_timeout_s", 30.0, "Longest wait for those nodes.", "s", 0.1, 3600.0),
    Spec("command_timeout_s", 5.0, "Lockstep: longest wait for a torque, on the steady clock.", "s", 0.1, 3600.0),
    Spec(
        "freshness_samples", 10, "Real time: age of the latest torque beyond which it is a fault.", "samples", 1, 10_000
    ),
    Spec("mass_scale", 1.0, "Factor on the platform mass.", "", 1e-3, 1e3),
    Spec("inertia_scale", 1.0, "Factor on the inertias.", "", 1e-3, 1e3),
    Spec("friction_scale", 1.0, "Factor on the friction.", "", 0.0, 1e3),
    Spec("torque_limit", 10.0, "Largest torque that the drives apply, 0 for no limit.", "Nm", 0.0, 1e6),
    Spec("torque_quantum", 0.0, "Step of the applied torque, 0 for continuous.", "Nm", 0.0, 10.0),
    Spec("encoder_counts", 0, "Encoder counts per revolution of every joint, 0 for exact.", "counts", 0, 1_000_000_000),
    Spec("delay_samples", 0, "Sampling periods between a command and its effect.", "samples", 0, 100),
    Spec("seed", 0, "Seed of the sensors' noise.", "", 0, 2**31 - 1),
    Spec("imu_noise", 0.0, "Standard deviation of the accelerometer's white noise.", "m/s^2", 0.0, 100.0),
)
