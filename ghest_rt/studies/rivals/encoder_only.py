"""Estimators that rest on the encoders alone: one way of taking samples in, several models of the patient."""

from typing import Protocol

from ghest_drivers.samples import EncoderSample
from ghest_rt.geometry.so3 import Array
from ghest_rt.messages.results import GhEstimate, MarkerObservation, Reason, Status
from ghest_rt.sync.encoder_track import EncoderTrack
from ghest_rt.sync.miss import Miss


class PostureModel(Protocol):
    """What the exoskeleton's joints tell about the arm."""

    def gh_from_arm(self, joints: Array) -> Array | None:
        """Return the (3, 3) rotation of the arm in the GH frame.

        Args:
            joints: (n,) positions of the measured joints, rad, in the order of `encoders.joints`; successive calls are
                successive instants.

        Returns:
            The rotation, or None where the model has no answer.
        """
        ...


class EncoderOnlyEstimator:
    """A `GhEstimator` that interpolates the joints to the instant asked for, as `refined` does, and passes them to a model."""

    def __init__(self, model: PostureModel, limits: Array, max_gap_ns: int) -> None:
        """Start without samples.

        Args:
            model: What the joints tell about the arm.
            limits: (n, 2) limits of the joints, rad.
            max_gap_ns: The longest gap that is interpolated over.
        """
        self._model = model
        self._track = EncoderTrack(limits)
        self._max_gap_ns = max_gap_ns

    def add_encoder(self, sample: EncoderSample) -> None:
        """Take an encoder sample."""
        self._track.add(sample)

    def add_marker(self, observation: MarkerObservation) -> None:
        """Pass over a marker: the method does without."""

    def counts(self) -> dict[str, int]:
        """Return how many samples were not used, by reason."""
        return {f"encoders_{reason}": count for reason, count in self._track.rejected.items()}

    def estimate(self, t_ns: int) -> GhEstimate:
        """Return the GH joint at `t_ns`; orientation only."""
        state = self._track.at(t_ns, self._max_gap_ns)
        if isinstance(state, Miss):
            newest_ns = self._track.newest_ns
            seen = {} if newest_ns is None else {"encoders": newest_ns}
            return orientation_only(t_ns, None, Reason.ENCODERS_SILENT, seen)
        rotation = self._model.gh_from_arm(state.positions)
        return orientation_only(t_ns, rotation, Reason.UNCERTAIN, {"encoders": state.newest_ns})


def orientation_only(t_ns: int, gh_from_arm: Array | None, reason_if_none: Reason, newest_ns: dict[str, int]) -> GhEstimate:
    """Return the estimate of a method that knows no positions.

    Args:
        t_ns: The instant it holds for.
        gh_from_arm: (3, 3) rotation, or None.
        reason_if_none: Why there is none.
        newest_ns: Time of the newest sample of each input.
    """
    return GhEstimate(
        t_sample_ns=t_ns,
        status=Status.LOST if gh_from_arm is None else Status.VALID,
        reason=reason_if_none if gh_from_arm is None else Reason.NONE,
        gh_from_arm=gh_from_arm,
        m0_from_arm=None,
        e_from_m0=None,
        e_from_m1=None,
        covariance=None,
        newest_ns=newest_ns,
    )
