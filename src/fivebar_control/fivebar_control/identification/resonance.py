# SPDX-License-Identifier: Apache-2.0
"""Finds the elastic transmissions of a robot from the recording of a chirp: frequency, damping and share of the rotors.

The frequency response from both motors' torques to both motors' angles is estimated from cross spectra, and a model of
two masses per leg is fitted to it: the rotor, a spring with a damper, and the links with the platform, whose inertia
the robot's file gives. Torques are held over a period, which the model's discretisation has exactly; what lags besides,
current loop and bus, is an unknown delay. A chirp of two amplitudes shows play, by which transmissions are the softer
the less torque they pass on. docs/identification.md has the method.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import csd
from scipy.special import stdtrit

from fivebar_control.identification.equations import Record, bridged
from fivebar_control.identification.identification import NotIdentifiable, stretches
from fivebar_control.identification.least_squares import CONFIDENCE
from fivebar_control.identification.motor_map import MotorValue
from fivebar_control.model.dynamics import inverse_dynamics
from fivebar_control.model.kinematics import state_from_motors
from fivebar_control.model.singularity import inverse_condition
from fivebar_description.parameters import FiveBar, without_external_force

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

WINDOW = 1.0
"""s. Length of the spectra's windows, with Hann's weights and overlapping by half."""

CORRELATED_BINS = 1.5
"""Equivalent noise bandwidth of these windows in bins: neighbouring frequencies are not independent."""

LEAST_KAPPA = 0.2
"""Least 1/cond(A) of the posture: near the Type 2 locus the inertia changes within the chirp's amplitude."""

LEAST_POWER = 0.02
"""Least power of the torques' spectrum, relative to its largest value: what is not swept has less."""

LOWEST_HZ, HIGHEST = 8.0, 0.4
"""Frequencies that are used: from here on, where the motors' holding no longer matters, to this part of the rate."""

LEAST_FREQUENCIES = 30

MODEL_ERROR = 0.05
"""Error of the response beside its noise: what the model lacks, friction's dependence on amplitude above all."""

LEAST_GAIN = 1.5
"""Least factor by which the elastic model has to lower the squared misfit of a rigid one to be believed."""

WIDEST = 0.2
"""Half width of a frequency's interval, relative to the frequency, beyond which it is not determined."""

FREQUENCY_ERROR = 0.03
"""Error of a frequency beside its noise: what the model lacks, in simulated robots whose inertias are known."""

STRONG, WEAK = 0.8, (0.2, 0.7)
"""Root mean square of the torques over a window, relative to its largest value, of the parts with the larger and with
the smaller amplitude."""

PLAY_ERROR = 1.2
"""Factor on what play has softened, at most: that it is as a constant angle beside the spring's is an approximation."""

LEAST_SHARE, MOST_DAMPING = 0.05, 0.5
"""Least share of the rotor, and largest damping, with which a fit says something of a spring: play may look so."""

PASSED_ON = 0.05
"""Least part of the amplitude that friction leaves to the links."""

STARTS_HZ = ((30.0, 30.0), (60.0, 60.0), (120.0, 120.0), (50.0, 110.0), (110.0, 50.0))
"""Frequencies of both legs from which the fit begins; the best result counts."""

MOST_STEPS = 40

SERIES = 14
"""Terms of an exponential of a matrix with a norm of at most a half."""

NOISY = 0.5
"""Deviation of a response relative to its size, beyond which a frequency shows nothing."""

ASSEMBLED = 1.5
"""The links swing on locked rotors at up to so many times the frequency of a leg's whole inertia."""

FREQUENCY, DAMPING, SHARE, COULOMB, GAIN = range(5)
"""Unknowns of a leg: the logarithms of f, zeta and rho / (1 - rho), the Coulomb friction f_s, and the logarithm of the
scale of its torque. The delay in periods comes after both legs."""


LIMITS = (
    np.array([math.log(5.0), math.log(1e-3), -4.0, -10.0, -0.5] * 2 + [-2.0]),
    np.array([math.log(2000.0), 0.0, 4.0, 10.0, 0.5] * 2 + [10.0]),
)
"""Limits of the unknowns, for the steps of the fit."""


class NoResonance(NotIdentifiable):
    """The robot is rigid as far as the record can tell; the text says up to which frequency."""


class OnlyBounded(NotIdentifiable):
    """Play may have softened the transmissions by so much that their resonance is not told, only a bound of it.

    Attributes:
        at_least: lower end (Hz) of the interval in which the softer one swings under the larger amplitude.
        likely: frequency (Hz) of the softer one without play, of those whose fit looks like a spring's; infinite where
            none does, or where play explains it all.
    """

    def __init__(self, seen: bool, at_least: float, likely: float) -> None:
        """Tell both frequencies (Hz), and whether play is seen or cannot be excluded."""
        reason = (
            "the transmissions are softer under small torques than under large ones, and play hides their resonance"
            if seen
            else "the smaller amplitude of the chirp is too weak to tell play from elasticity"
        )
        super().__init__(f"{reason}: it is at {at_least:.3g} Hz or above")
        self.at_least, self.likely = at_least, likely


class Response(NamedTuple):
    """A frequency response to sweeps.

    Attributes:
        frequencies: [n] (Hz).
        values: [n, 2, 2], angle i per torque with both motors alike, and against each other (rad/Nm).
        deviations: [n, 2, 2], standard deviations of real and imaginary part each.
        amplitude: of the torques (Nm).
    """

    frequencies: FloatArray
    values: ComplexArray
    deviations: FloatArray
    amplitude: float


class LegResonance(NamedTuple):
    """The transmission of a leg, as the section `transmission` of a plant has it.

    Attributes:
        frequency: of the leg's whole grouped inertia on the transmission's stiffness (Hz).
        damping: ratio of that oscillation.
        rotor_share: of the rotor in that inertia.
    """

    frequency: MotorValue
    damping: MotorValue
    rotor_share: MotorValue


class Resonance(NamedTuple):
    """The findings from a chirp.

    Attributes:
        legs: of both legs.
        locked: frequencies (Hz) at which the links swing in this posture with locked rotors, the lower one first.
        delay: of the torque beyond its hold (s).
        highest: frequency (Hz) up to which the response stands out from its noise and the motors swing by a count.
        misfit: root mean square of the residuals in units of their deviations, about 1.
        amplitudes: of the chirp, 2 where play would have shown.
    """

    legs: tuple[LegResonance, LegResonance]
    locked: tuple[float, float]
    delay: MotorValue
    highest: float
    misfit: float
    amplitudes: int

    @property
    def lowest(self) -> float:
        """The lower of both legs' frequencies (Hz)."""
        return min(leg.frequency.value for leg in self.legs)


class _Fitted(NamedTuple):
    values: FloatArray
    cost: float
    derivatives: FloatArray


def find_resonance(robot: FiveBar, record: Record) -> Resonance:
    """Return the elastic transmissions of a robot whose lengths, inertias and mass are known.

    Args:
        robot: its lengths, inertias and mass; its friction is a first guess.
        record: of a chirp of both motors' torques, alike and against each other, in one posture. With two amplitudes
            its intervals include what play may have softened.

    Raises:
        NoResonance: the robot is rigid as far as the record can tell.
        OnlyBounded: play hides it.
        NotIdentifiable: the record is unsuitable, or determines no resonance.
    """
    inertia, (strong, *weaker) = inertia_at(robot, record), by_amplitude(bridged(record))
    grouped, period = np.array([robot.leg1.inertia, robot.leg2.inertia]), 1.0 / record.rate_hz
    noise = np.median(strong.deviations / np.abs(strong.values), axis=(1, 2))
    swing = 2.0 * strong.amplitude * np.median(np.abs(strong.values), axis=(1, 2))
    clear = strong.frequencies[(noise < NOISY) & (swing >= smallest_step(record.angles))]
    highest = float(clear[-1]) if len(clear) else 0.0
    friction = [robot.leg1.coulomb, robot.leg2.coulomb]

    def off_rigid(values: FloatArray) -> FloatArray:
        friction, gains = values[:4].reshape(2, 2).T
        return _residuals(strong, modelled(rigid_model(inertia), friction, np.exp(gains), values[4], strong, period))

    rigid = _fitted(off_rigid, [friction[0], 0.0, friction[1], 0.0, 0.0])
    elastic = _elastic_fit(inertia, grouped, strong, period, friction)
    result = _resonance(inertia, grouped, strong, period, elastic, highest)
    if rigid.cost < LEAST_GAIN * elastic.cost or any(leg.frequency.value > highest for leg in result.legs):
        raise NoResonance(
            f"no resonance is visible up to {highest:.0f} Hz, so no transmission is softer than some"
            f" {highest / ASSEMBLED:.0f} Hz: the robot is rigid as far as this chirp can tell"
        )
    widened = _with_model_error(result)
    for number, leg in enumerate(widened.legs, start=1):
        if not leg.frequency.half_width < WIDEST * leg.frequency.value:
            raise NotIdentifiable(
                f"the resonance of leg {number} is not determined: {leg.frequency.value:.3g} ±"
                f" {leg.frequency.half_width:.2g} Hz: expected a stronger or longer chirp"
            )
    if weaker:
        (weak,) = weaker
        softer = _resonance(
            inertia, grouped, weak, period, _elastic_fit(inertia, grouped, weak, period, friction), highest
        )
        return _without_play(result, softer, strong, weak, np.clip(elastic.values, *LIMITS)[[COULOMB, 5 + COULOMB]])
    return widened


def by_amplitude(record: Record) -> list[Response]:
    """Return the response to the larger and that to the smaller amplitude of the torques; to all if there is one.

    Raises:
        NotIdentifiable: the record is unsuitable.
    """
    length = round(WINDOW * record.rate_hz)
    if len(record.torques) < length:
        return [frequency_response(record)]
    known = np.isfinite(record.torques).all(axis=1)
    power = np.where(known, np.mean(np.square(np.nan_to_num(record.torques)), axis=1), 0.0)
    window = np.ones(length)
    count = np.convolve(known.astype(float), window, "same")
    size = np.sqrt(np.convolve(power, window, "same") / np.maximum(count, 1.0))
    size = size / max(float(size.max(initial=0.0)), 1e-12)
    # what is not in a part is missing in it
    parts = [
        record._replace(
            angles=np.where(chosen, record.angles, np.nan), torques=np.where(chosen, record.torques, np.nan)
        )
        for chosen in ((size > STRONG)[:, None], ((size > WEAK[0]) & (size < WEAK[1]))[:, None])
    ]
    try:
        weak = frequency_response(parts[1])
    except NotIdentifiable:
        return [frequency_response(record)]
    return [frequency_response(parts[0]), weak]


def _without_play(
    strong: Resonance, weak: Resonance, by_strong: Response, by_weak: Response, friction: FloatArray
) -> Resonance:
    """Return what transmissions are without their play, by how much softer they are under the smaller amplitude.

    Play turns by a constant angle, a spring in proportion to its torque: the compliance 1 / f^2 that is seen grows with
    the inverse of the torque that is passed on, which friction lowers. Between the frequency under the larger amplitude
    and that which follows for torques without bound lies the truth.

    Raises:
        OnlyBounded: it is not determined so.
    """
    legs, lows, likely, plays = list[LegResonance](), list[float](), list[float](), False
    for leg, softer, coulomb in zip(strong.legs, weak.legs, friction.tolist(), strict=True):
        (f, half), (g, wide) = leg.frequency, softer.frequency
        if g > f and not (g <= strong.highest and _like_a_spring(softer)):
            # rigid as far as the smaller amplitude tells: that shows nothing, and at a limit of the fit has no width
            wide = math.inf
        loss = 4.0 / math.pi * coulomb
        large = max(by_strong.amplitude - loss, PASSED_ON * by_strong.amplitude)
        small = max(by_weak.amplitude - loss, PASSED_ON * by_weak.amplitude)
        seen = f**-2 - g**-2
        uncertain = 2.0 * math.hypot(half * f**-3, wide * g**-3)
        reach = small / (large - small)

        def stiffer(softening: float, f: float = f, reach: float = reach) -> float:
            compliance = f**-2 - max(0.0, softening) * reach
            return compliance**-0.5 if compliance > 0.0 else math.inf

        central, high = stiffer(-seen), stiffer(PLAY_ERROR * (uncertain - seen))
        plays = plays or -seen > uncertain
        lows.append(f - math.hypot(half, FREQUENCY_ERROR * f))
        if _like_a_spring(leg):
            likely.append(central)
        widened = max(central - f, high - central) if math.isfinite(high) else math.inf
        legs.append(leg._replace(frequency=MotorValue(central, math.hypot(widened, leg.frequency.half_width))))
    resonance = _with_model_error(strong._replace(legs=(legs[0], legs[1]), amplitudes=2))
    if not all(leg.frequency.half_width < WIDEST * leg.frequency.value for leg in resonance.legs):
        raise OnlyBounded(plays, min(lows), min(likely, default=math.inf))
    return resonance


def _like_a_spring(leg: LegResonance) -> bool:
    return leg.rotor_share.value > LEAST_SHARE and leg.damping.value < MOST_DAMPING


def _with_model_error(resonance: Resonance) -> Resonance:
    """Return a result whose frequencies' intervals include what the model lacks, more of it where it explains less."""
    error = FREQUENCY_ERROR * max(1.0, resonance.misfit**2)

    def widened(leg: LegResonance) -> LegResonance:
        value, half = leg.frequency
        return leg._replace(frequency=MotorValue(value, math.hypot(half, error * value)))

    leg1, leg2 = map(widened, resonance.legs)
    return resonance._replace(legs=(leg1, leg2))


def _elastic_fit(
    inertia: FloatArray, grouped: FloatArray, response: Response, period: float, friction: Sequence[float]
) -> _Fitted:
    """Return the best fit of elastic transmissions, from a first guess of the friction (Nm)."""

    def off(values: FloatArray) -> FloatArray:
        within = np.clip(values, *LIMITS)
        legs = within[:10].reshape(2, 5)
        model, gains = elastic_model(inertia, grouped, legs), np.exp(legs[:, GAIN])
        return _residuals(response, modelled(model, legs[:, COULOMB], gains, within[10], response, period))

    fits = []
    for starts in STARTS_HZ:
        start1, start2 = (
            [math.log(hz), math.log(0.05), 0.5, f_s, 0.0] for hz, f_s in zip(starts, friction, strict=True)
        )
        fits.append(_fitted(off, [*start1, *start2, 0.0]))
    return min(fits, key=lambda fit: fit.cost)


def _residuals(response: Response, model: ComplexArray) -> FloatArray:
    """Return real and imaginary parts of measured minus modelled response, in units of their deviations."""
    deviations = np.hypot(response.deviations, MODEL_ERROR * np.abs(response.values))
    off = ((response.values - model) / deviations).ravel()
    return np.concatenate([off.real, off.imag])


def _fitted(residuals: Callable[[FloatArray], FloatArray], guess: list[float]) -> _Fitted:
    steps = MOST_STEPS * (len(guess) + 1)
    # MINPACK needs no LAPACK, whose threads take longer than the work on matrices of this size
    solution = least_squares(residuals, np.array(guess), method="lm", x_scale="jac", max_nfev=steps)
    return _Fitted(solution.x, 2.0 * float(solution.cost), solution.jac)


def _resonance(
    inertia: FloatArray, grouped: FloatArray, response: Response, period: float, elastic: _Fitted, highest: float
) -> Resonance:
    """Return the result with its intervals."""
    independent = elastic.derivatives.shape[0] / CORRELATED_BINS - len(elastic.values)
    scatter = max(1.0, elastic.cost / elastic.derivatives.shape[0])
    covariance = np.linalg.pinv(elastic.derivatives.T @ elastic.derivatives) * CORRELATED_BINS * scatter
    half = stdtrit(independent, 0.5 + 0.5 * CONFIDENCE) * np.sqrt(np.maximum(np.diag(covariance), 0.0))
    values = np.clip(elastic.values, *LIMITS)
    legs, halves = values[:10].reshape(2, 5), half[:10].reshape(2, 5)

    def scaled(leg: int, which: int) -> MotorValue:
        value = math.exp(legs[leg, which])
        return MotorValue(value, value * float(halves[leg, which]))

    def share(leg: int) -> MotorValue:
        value = 1.0 / (1.0 + math.exp(-legs[leg, SHARE]))
        return MotorValue(value, value * (1.0 - value) * float(halves[leg, SHARE]))

    rotors = np.diag([share(leg).value for leg in (0, 1)] * grouped)
    stiffness = np.diag(grouped * (2.0 * math.pi * np.exp(legs[:, FREQUENCY])) ** 2)
    squares = np.linalg.eigvals(np.linalg.solve(inertia - rotors, stiffness)).real
    low, high = np.sort(np.sqrt(np.maximum(squares, 0.0)) / (2.0 * math.pi)).tolist()
    leg1, leg2 = (LegResonance(scaled(leg, FREQUENCY), scaled(leg, DAMPING), share(leg)) for leg in (0, 1))
    return Resonance(
        (leg1, leg2),
        (low, high),
        MotorValue(float(values[10]) * period, float(half[10]) * period),
        highest,
        math.sqrt(elastic.cost / elastic.derivatives.shape[0]),
        1,
    )


def smallest_step(angles: FloatArray) -> float:
    """Return the smallest change of angles [n, 2] (rad) from sample to sample, a count of an encoder.

    A motion of less than a count from end to end is not in the readings as it was: what they show of it depends on
    where in the count it happens.
    """
    steps = np.abs(np.diff(angles, axis=0))
    return float(np.min(steps, initial=math.inf, where=np.isfinite(steps) & (steps > 0.0)))


def inertia_at(robot: FiveBar, record: Record) -> FloatArray:
    """Return [2, 2], the inertia (kg m^2) that both motors feel in the mean posture of a record.

    Raises:
        NotIdentifiable: its assembly mode is not known, or it is too close to the Type 2 locus.
    """
    known = np.isfinite(record.angles).all(axis=1) & np.isfinite(record.assembly) & (record.assembly != 0.0)
    modes = np.unique(record.assembly[known])
    if len(modes) != 1:
        raise NotIdentifiable("the assembly mode changes or is not known: expected a chirp in one posture")
    q11, q21 = np.mean(record.angles[known], axis=0).tolist()
    state = state_from_motors(robot, int(modes[0]), q11, q21, 0.0, 0.0)
    kappa = inverse_condition(state)
    if not kappa > LEAST_KAPPA:
        raise NotIdentifiable(
            f"1/cond(A) is {kappa:.2f} in this posture, expected above {LEAST_KAPPA:g}: chirp elsewhere"
        )
    free = without_external_force(robot)
    columns = [inverse_dynamics(free, state, ddq11, 1.0 - ddq11, 0.0, 0.0) for ddq11 in (1.0, 0.0)]
    return np.array(columns).T


def frequency_response(record: Record) -> Response:
    """Return the response that a record shows.

    Raises:
        NotIdentifiable: it is too short, or the torques are not those of sweeps of both kinds.
    """
    rate = record.rate_hz
    length = round(WINDOW * rate)
    # each between two gaps, as a loaded machine leaves them
    parts = [stretch for stretch in stretches(np.hstack([record.angles, record.torques])) if len(stretch) >= length]
    total = sum(map(len, parts))
    if total < 4 * length:
        raise NotIdentifiable(
            f"too short: {total / rate:.1f} s without a gap, expected at least {4 * WINDOW:.0f} s of a chirp"
        )
    angles, torques = [part[:, :2] for part in parts], [part[:, 2:] for part in parts]
    inputs = [0.5 * np.array([torque[:, 0] + torque[:, 1], torque[:, 0] - torque[:, 1]]).T for torque in torques]

    def spectra(signals: Sequence[FloatArray], references: Sequence[FloatArray]) -> ComplexArray:
        """Return [n, 2, 2], the spectra of columns times the conjugates of other columns, over all parts."""
        options = {"fs": rate, "window": "hann", "nperseg": length, "detrend": "linear"}
        products = [
            len(part)
            / total
            * np.array([[csd(b, a, **options)[1] for b in reference.T] for a in part.T]).transpose(2, 0, 1)
            for part, reference in zip(signals, references, strict=True)
        ]
        pooled: ComplexArray = np.sum(products, axis=0)
        return pooled

    frequencies = np.fft.rfftfreq(length, 1.0 / rate)
    used = (frequencies >= LOWEST_HZ) & (frequencies <= HIGHEST * rate)
    driving, across = spectra(inputs, inputs)[used], spectra(angles, inputs)[used]
    own = spectra(angles, angles)[used].real
    power = np.einsum("njj->nj", driving).real
    swept = (power > LEAST_POWER * power.max()).all(axis=1)
    if np.count_nonzero(swept) < LEAST_FREQUENCIES:
        raise NotIdentifiable(
            f"{np.count_nonzero(swept)} frequencies of 1 Hz are swept with the motors alike and against each other,"
            f" expected at least {LEAST_FREQUENCIES}: the scenario excitation_resonance does it"
        )
    driving, across, own, power = driving[swept], across[swept], own[swept], power[swept]
    values = across @ np.linalg.inv(driving)
    unexplained = np.einsum("nii->ni", own) - np.einsum("nij,nij->ni", values, across.conj()).real
    # overlapping windows are worth some two thirds of independent ones; half of a variance is that of the real part
    windows = (2.0 * total / length - len(parts)) / 1.5
    variance = np.maximum(unexplained, 0.0)[:, :, None] / (2.0 * windows * power[:, None, :])
    amplitude = math.sqrt(2.0) * np.std(np.concatenate(torques))
    return Response(frequencies[used][swept], values, np.sqrt(variance), float(amplitude))


def elastic_model(inertia: FloatArray, grouped: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the matrices of the first-order system of both rotors' and links' angles and rates.

    Args:
        inertia: [2, 2] that the motors feel (kg m^2).
        grouped: [2], grouped inertias of the legs (kg m^2).
        values: [2, 5], the legs' unknowns.
    """
    rate = 2.0 * math.pi * np.exp(values[:, FREQUENCY])
    rotors = grouped / (1.0 + np.exp(-values[:, SHARE]))
    links = np.linalg.inv(inertia - np.diag(rotors))
    per_rotor = np.diag(1.0 / rotors)
    system, entry = np.zeros((8, 8)), np.zeros((8, 2))
    system[:4, 4:] = np.eye(4)
    springs = np.diag(grouped * rate**2), np.diag(2.0 * np.exp(values[:, DAMPING]) * grouped * rate)
    for first, spring in zip((0, 4), springs, strict=True):
        system[4:6, first : first + 2] = -per_rotor @ spring
        system[4:6, first + 2 : first + 4] = per_rotor @ spring
        system[6:8, first : first + 2] = links @ spring
        system[6:8, first + 2 : first + 4] = -links @ spring
    entry[4:6] = per_rotor
    return system, entry


def rigid_model(inertia: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the matrices of the first-order system of a rigid robot."""
    system, entry = np.zeros((4, 4)), np.zeros((4, 2))
    system[:2, 2:] = np.eye(2)
    entry[2:] = np.linalg.inv(inertia)
    return system, entry


def modelled(
    model: tuple[FloatArray, FloatArray],
    friction: FloatArray,
    gains: FloatArray,
    delay: float,
    response: Response,
    period: float,
) -> ComplexArray:
    """Return what a model makes of the sweeps: the response of the motors' angles, its first two states.

    Coulomb friction is in phase with the speed and 4 f_s / pi in size (harmonic balance): a loss in inverse proportion
    to the angle's amplitude, which the measured response gives.

    Args:
        model: matrices of the system and of its inputs.
        friction: [2], Coulomb friction f_s (Nm).
        gains: [2], actual torque over the recorded one.
        delay: of the torque beyond its hold (periods).
        response: measured.
        period: s. Torques are held over it, before the sample.
    """
    system, entry = model
    size = len(system)
    whole = np.zeros((size + 2, size + 2))
    whole[:size, :size], whole[:size, size:] = system * period, entry * period
    step = _exponential(whole)
    after = np.exp(2j * math.pi * response.frequencies * period)
    held = np.broadcast_to(step[:size, size:], (len(after), size, 2))
    free = np.linalg.solve(after[:, None, None] * np.eye(size) - step[:size, :size], held)[:, :2]
    free *= after[:, None, None]
    stiffness = np.linalg.inv(free)
    columns = []
    for sweep, signs in enumerate(((1.0, 1.0), (1.0, -1.0))):
        amplitude = response.amplitude * np.abs(response.values[:, :, sweep])
        losses = 4j / math.pi * friction / np.maximum(amplitude, 1e-12)
        matrix = stiffness + np.einsum("ni,ij->nij", losses, np.eye(2))
        columns.append(np.linalg.solve(matrix, np.broadcast_to((gains * np.array(signs))[:, None], (len(after), 2, 1))))
    lag = np.exp(-2j * math.pi * response.frequencies * delay * period)
    lagged: ComplexArray = np.concatenate(columns, axis=2) * lag[:, None, None]
    return lagged


def _exponential(matrix: FloatArray) -> FloatArray:
    """Return the exponential of a small matrix, by its series with scaling and squaring."""
    halvings = max(0, math.ceil(math.log2(max(float(np.abs(matrix).sum(axis=1).max()), 1e-9))) + 1)
    scaled = matrix / 2.0**halvings
    term = total = np.eye(len(matrix))
    for order in range(1, SERIES + 1):
        term = term @ scaled / order
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return total
