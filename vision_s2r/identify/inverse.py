"""The inverse method: least squares on the torque balance, with velocities and accelerations from positions.

Positions are filtered by a zero-phase low-pass and differentiated centrally, to high order: accelerations of the
usual central differences are too small by 2 % at the edge of the band. The torque and every column of the regressor
are then decimated alike, which filters the equation itself. Rows around reversals, where the joint may stick, are
left out, and intervals allow for errors that go together from row to row (Newey and West, Econometrica 55, 1987).

(IDIM-LS: Janot, Vandanjon and Gautier, IEEE Transactions on Control Systems Technology 22, 2014. Cut-offs of 5 times
the modelled bandwidth for positions and twice for the equation: Janot, Gautier and Brunot, "Data Set and Reference
Models of EMPS", 2019.)
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.signal import butter, decimate, savgol_filter, sosfiltfilt
from scipy.stats import t as student
from statsmodels.regression.linear_model import OLS

from vision_s2r.errors import UserError
from vision_s2r.fit.case import Hypothesis, Intervals, Segments, Values
from vision_s2r.fit.joint.discrepancy import OWN_BIAS
from vision_s2r.identify.config import InverseConfig
from vision_s2r.identify.estimate import Label, ParameterEstimates, offsets
from vision_s2r.joint import JOINT_EFFECTS
from vision_s2r.recording import JointRecording

BANDWIDTH = 1 / 50  # of the sampling rate: what is modelled, where nothing else is said
POSITION, RATE = 5.0, 5.0  # times the bandwidth: where positions are cut off, and the rate after decimation
EDGE = 1.0  # periods of the bandwidth that are left out at either end of an episode: there the filters are wrong
TAPS = 9  # of the central differences, which are exact for polynomials of this order
HELD = np.array([-1, 13, 13, -1]) / 24  # what a held command is at a sample, as slow motion sees it: to fourth order
LAGS = 10  # rows over which errors go together
SLOW = 0.05  # of the fastest: the joint may stick, and what dry friction is then no column says
LEAST = 40  # samples between the edges of an episode …
ROWS = 30  # … and rows in all

# Torques that are linear in a parameter.
COLUMNS: tuple[Label, ...] = (
    ("inertia", "value"),
    ("viscous_damping", "value"),
    ("coulomb_friction", "value"),
    ("gravity_torque", "value"),
    ("bias_torque", "value"),
    ("asymmetric_friction", "viscous"),
    ("asymmetric_friction", "coulomb"),
)
KNOWN = frozenset(effect for effect, _ in COLUMNS)


@dataclass(frozen=True)
class Regression:
    """The torque balance, row by row: torque = columns @ parameters."""

    torque: np.ndarray  # [N] of the motor, and from outside
    columns: np.ndarray  # [N, 7], as COLUMNS
    terms: np.ndarray  # [N, K] of functions that are fitted beside them
    segment: np.ndarray  # [N] int: to be held out together
    source: np.ndarray  # [N] int: the recording, of several

    def error(self, nominal: Mapping[str, float], values: Values, more: Sequence[float] = ()) -> float:
        """Relative torque error ‖τ − Wθ‖ / ‖τ‖ of the nominal parameters with these effects.

        `more` is the bias torque that recordings after the first have more than that.
        """
        theta = np.array([_value(label, nominal, values) for label in COLUMNS])
        rest = self.torque - self.columns @ theta - sum(each * (self.source == k) for k, each in enumerate(more, 1))
        return float(np.linalg.norm(rest) / np.linalg.norm(self.torque))


def regression(
    recording: JointRecording, cfg: InverseConfig, segment: np.ndarray, terms: np.ndarray | None = None
) -> Regression:
    """The torque balance of a recording; `segment` [E, T] int says what is held out together.

    `terms` [E, T, K] are torques against the motor, each times a coefficient that is fitted.

    Raises UserError where its episodes are too short for the filters, or its sampling is too slow, or uneven, and where
    no torque was recorded.
    """
    if recording.servo or recording.times is not None:
        raise UserError("method=inverse takes torques in even samples, expected method=forward for this recording")
    rate = 1 / recording.sample_time
    bandwidth = cfg.bandwidth or BANDWIDTH * rate
    if POSITION * bandwidth > 0.45 * rate:
        raise UserError(
            f"inverse.bandwidth is {bandwidth:g} Hz, expected {0.45 * rate / POSITION:g} or less at {rate:g} samples/s"
        )
    edge = round(EDGE / bandwidth * rate)
    terms = np.empty((*recording.position.shape, 0)) if terms is None else terms
    source = np.zeros(len(recording), int) if recording.source is None else recording.source
    parts = [
        (
            *(rows := _episode(recording, k, cfg, bandwidth, slice(edge, length - edge), segment[k], terms[k])),
            np.full(len(rows[0]), source[k]),
        )
        for k, length in enumerate(recording.lengths)
        if length - 2 * edge >= LEAST
    ]
    if sum(len(torque) for torque, *_ in parts) < ROWS:
        raise UserError(
            f"method=inverse: the longest episode has {recording.lengths.max()} samples, too short for an "
            f"inverse.bandwidth of {bandwidth:g} Hz, which leaves out {edge} at either end and takes every "
            f"{_every(rate, bandwidth)}th, or none of them moves for long. Record longer ones, or take method=forward"
        )
    return Regression(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def _episode(
    recording: JointRecording,
    k: int,
    cfg: InverseConfig,
    bandwidth: float,
    inside: slice,
    segment: np.ndarray,
    terms: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Torque [N], columns [N, 7], terms [N, K] and segment [N] of an episode."""
    step, length = recording.sample_time, recording.lengths[k]
    every = _every(1 / step, bandwidth)
    low_pass = butter(8, POSITION * bandwidth, output="sos", fs=1 / step)
    position = sosfiltfilt(low_pass, recording.position[k, :length])
    velocity, acceleration = (savgol_filter(position, TAPS, TAPS - 1, deriv=k, delta=step) for k in (1, 2))
    sign, ones = np.sign(velocity), np.ones(length)
    columns = [acceleration, velocity, sign, np.sin(position), ones, np.abs(velocity), np.abs(sign)]
    given, load_inertia = _given(recording, k)
    if cfg.held:
        given = np.convolve(np.pad(given, (2, 1), mode="edge"), HELD, mode="valid")
    rows = np.arange(length)[inside][::every]
    kept = cfg.reversals | ~_around_reversals(velocity, every)[rows]

    def thinned(values: np.ndarray) -> np.ndarray:
        return (decimate(values[inside], every) if every > 1 else values[inside])[kept]

    more = [thinned(each) for each in terms[:length].T]
    return (
        thinned(given - load_inertia * acceleration),
        np.stack([thinned(each) for each in columns], axis=1),
        np.stack(more, axis=1) if more else np.empty((kept.sum(), 0)),
        segment[rows[kept]],
    )


def _given(recording: JointRecording, k: int) -> tuple[np.ndarray, np.ndarray]:
    """What drives an episode, torque of the motor and from outside [T], and the inertia that its load adds [T]."""
    length, samples = recording.lengths[k], recording.command.shape[1]
    supply = 1.0 if recording.supply is None else recording.supply[k, :length]
    external, load_inertia = (
        np.zeros(length) if each is None else each[k].reshape(samples, -1).mean(axis=1)[:length]
        for each in (recording.external, recording.load_inertia)
    )
    return recording.nominal["torque_constant"] * recording.command[k, :length] * supply + external, load_inertia


def _around_reversals(velocity: np.ndarray, every: int) -> np.ndarray:
    """Which samples are slow, or so near to slow ones that the filters mix them; bool [T]."""
    slow = np.abs(velocity) < SLOW * np.abs(velocity).max()
    return maximum_filter1d(slow.astype(np.uint8), every).astype(bool)


def _every(rate: float, bandwidth: float) -> int:
    """Samples a row."""
    return max(1, round(rate / (RATE * bandwidth)))


def _value(label: Label, nominal: Mapping[str, float], values: Values) -> float:
    effect, parameter = label
    return values[effect][parameter] if effect in values else nominal.get(effect, 0.0)


class Inverse:
    """Least squares of the parameters of some effects; the others are nominal."""

    def __init__(self, rows: Regression, nominal: Mapping[str, float], names: frozenset[str]) -> None:
        self._rows = rows
        self._free = [k for k, (effect, _) in enumerate(COLUMNS) if effect in names]
        held = [0.0 if k in self._free else _value(label, nominal, {}) for k, label in enumerate(COLUMNS)]
        self._torque = rows.torque - rows.columns @ held
        later = rows.source[:, None] == np.arange(1, rows.source.max() + 1)  # a bias torque is each recording's own
        self._own = later.astype(float) if "bias_torque" in names else np.empty((len(later), 0))
        self._columns = np.hstack([rows.columns[:, self._free], self._own, rows.terms])

    def estimate(self) -> ParameterEstimates:
        """From all rows."""
        covariances = {"maxlags": LAGS, "use_correction": True}
        found = OLS(self._torque, self._columns).fit(cov_type="HAC", cov_kwds=covariances)
        theta, covariance, degrees = found.params, found.cov_params(), found.df_resid
        hypothesis = self._hypothesis(theta)
        reach = float(student.ppf(0.975, degrees)) * np.sqrt(np.diag(covariance))
        labels = tuple(COLUMNS[k] for k in self._free)
        intervals: Intervals = {effect: {} for effect, _ in labels}
        for (effect, parameter), value, each in zip(labels, theta, reach, strict=False):
            intervals[effect][parameter] = (float(value - each), float(value + each))
        own = slice(len(labels), len(labels) + self._own.shape[1])
        more = {"bias_torque": offsets(theta[own], reach[own])} if self._own.size else {}
        return ParameterEstimates(hypothesis, intervals, labels, covariance[: own.start, : own.start], more)

    def fit(self, segments: Segments) -> Hypothesis:
        """From the rows of some segments."""
        inside = np.isin(self._rows.segment, list(segments))
        return self._hypothesis(np.linalg.lstsq(self._columns[inside], self._torque[inside], rcond=None)[0])

    def terms(self) -> np.ndarray:
        """The coefficients [K] of the regression's terms, from all rows."""
        theta = np.linalg.lstsq(self._columns, self._torque, rcond=None)[0]
        return np.asarray(theta[theta.size - self._rows.terms.shape[1] :])

    def _hypothesis(self, theta: np.ndarray) -> Hypothesis:
        values: dict[str, dict[str, float]] = {}
        for k, value in zip(self._free, theta, strict=False):
            effect, parameter = COLUMNS[k]
            bounds = JOINT_EFFECTS[effect].parameter(parameter)
            values.setdefault(effect, {})[parameter] = min(max(float(value), bounds.low), bounds.high)
        own = theta[len(self._free) : len(self._free) + self._own.shape[1]]
        return Hypothesis(values, {OWN_BIAS: own} if len(own) else {})
