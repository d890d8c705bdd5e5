"""Markers that move on their bones: seen, named, and taken out as far as that is possible."""

import numpy as np
import pytest

from ghest_rt.messages.results import MarkerDrift, Reason, Status
from tests.estimation_fused.stand import LENGTH_M, Drift, Judged, Trial, estimator_for, rms_deg, run, slide, turn

BEFORE_S = 2.5


def drift_of(judged: Judged, marker: str) -> MarkerDrift:
    assert judged.estimate.drift is not None
    return judged.estimate.drift.m0 if marker == "m0" else judged.estimate.drift.m1


def flagged_after_s(judged: list[Judged], marker: str, from_s: float) -> float | None:
    found = (j.t_s for j in judged if j.estimate.drift is not None and drift_of(j, marker).flagged)
    first = next(found, None)
    return None if first is None else first - from_s


def other(marker: str) -> str:
    return "m1" if marker == "m0" else "m0"


def test_without_drift_nothing_is_flagged() -> None:
    judged = [j for j in run(Trial(duration_s=10.0)) if j.estimate.drift is not None]
    assert not any(drift_of(j, marker).flagged for j in judged for marker in ("m0", "m1"))


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("marker", ["m0", "m1"])
def test_a_slide_during_the_session_is_flagged_and_taken_out(marker: str, axis: int) -> None:
    judged = run(Trial(duration_s=5.0, drifts=(Drift(marker, slide(axis), BEFORE_S),)))
    after_s = flagged_after_s(judged, marker, BEFORE_S)
    assert after_s is not None
    assert 0.0 < after_s < 0.3
    assert not drift_of(judged[-1], other(marker)).flagged
    assert rms_deg(judged, BEFORE_S + 0.1) < 0.4
    assert np.allclose(drift_of(judged[-1], marker).slide_m, 0.02 * np.eye(3)[axis], atol=0.002)
    last = judged[-1].estimate
    assert (last.status, last.reason) == (Status.VALID, Reason.NONE)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("marker", ["m0", "m1"])
def test_a_turn_during_the_session_is_flagged_and_taken_out(marker: str, axis: int) -> None:
    trial = Trial(duration_s=5.0, drifts=(Drift(marker, turn(axis), BEFORE_S),))
    estimator = estimator_for(trial)
    judged = run(trial, estimator)
    assert estimator.counts() == {f"{marker}_outlier": 3, f"{marker}_jump": 1}
    after_s = flagged_after_s(judged, marker, BEFORE_S)
    assert after_s is not None
    assert 0.0 < after_s < 0.3
    assert rms_deg(judged, BEFORE_S + 0.1) < 0.4
    assert np.allclose(np.degrees(drift_of(judged[-1], marker).turn_rad), 5.0 * np.eye(3)[axis], atol=0.4)


def test_slides_from_the_start_cost_far_less_than_they_cost_the_paper() -> None:
    """20 mm along each axis of each marker, all session long: 3.6 deg on average in the paper; 0.8 deg is asked for."""
    errors = []
    for marker in ("m0", "m1"):
        for axis in range(3):
            judged = run(Trial(duration_s=4.5, drifts=(Drift(marker, slide(axis)),), arm_length_m=LENGTH_M))
            after_s = flagged_after_s(judged, marker, 0.0)
            assert after_s is not None
            assert after_s < 3.0
            errors.append(rms_deg(judged, 1.0))
    assert np.mean(errors) < 0.8


@pytest.mark.parametrize("mm", [8, 10, 12])
def test_a_smaller_slide_of_m0_across_the_line_to_the_gh_centre_passes_for_no_turn(mm: int) -> None:
    """Where the GH centre is found says as much for a turn of m0: such a turn, wrongly taken out, would cost 5 deg."""
    judged = run(Trial(duration_s=6.0, drifts=(Drift("m0", slide(1, 1e-3 * mm)),)))
    assert rms_deg(judged, 3.0) < 2.5


def test_a_slide_along_the_arm_does_no_harm_where_the_arm_length_is_unknown() -> None:
    """Nothing tells it from a longer arm; the angles do not depend on it."""
    judged = run(Trial(duration_s=4.0, drifts=(Drift("m1", slide(1)),)))
    assert rms_deg(judged, 0.5) < 0.2


@pytest.mark.parametrize(("marker", "axis"), [("m0", 0), ("m0", 1), ("m1", 0), ("m1", 2)])
def test_the_stated_uncertainty_covers_what_cannot_be_told_of_a_turn_from_the_start(marker: str, axis: int) -> None:
    """A turn that was there from the start cannot be told from a slide for certain: sigma and status must say so."""
    judged = [j for j in run(Trial(duration_s=4.0, drifts=(Drift(marker, turn(axis)),))) if j.t_s > 1.0]
    assert flagged_after_s(judged, marker, 0.0) is not None
    assert max(j.error_deg / j.sigma_deg for j in judged) < 3.0
    last = judged[-1].estimate
    assert (last.status, last.reason) == (Status.DEGRADED, Reason.MARKER_DRIFT)


@pytest.mark.parametrize("axis", [0, 2])
def test_a_cuff_turned_far_across_the_arm_is_no_slide_that_no_cuff_can_make(axis: int) -> None:
    """10 deg move the GH centre in m1 by 5 cm. A slide as far explains it as well, and would leave all of the turn in."""
    judged = run(Trial(duration_s=4.0, drifts=(Drift("m1", turn(axis, 10.0)),)))
    assert drift_of(judged[-1], "m1").flagged
    assert rms_deg(judged, 2.0) < 3.0
