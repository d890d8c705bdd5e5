"""Uncertainty while nothing is seen, the limit of it, and what is said when the markers are back."""

import itertools

import numpy as np
import pytest

from ghest_rt.messages.results import Reason, Status
from tests.estimation_fused.stand import Blind, Judged, Trial, run

FROM_S = 2.5


def largest_deg(judged: Judged) -> float:
    assert judged.estimate.covariance is not None
    return float(np.degrees(np.sqrt(np.linalg.eigvalsh(judged.estimate.covariance)[-1])))


@pytest.mark.parametrize("limit_deg", [1.0, 3.0])
def test_with_both_blind_it_is_lost_within_one_tick_of_the_limit(limit_deg: float) -> None:
    blind = (Blind("m0", FROM_S, 9.0), Blind("m1", FROM_S, 9.0))
    free = run(Trial(duration_s=4.5, blind=blind, estimator={"sigma_limit_deg": 170.0}))
    judged = run(Trial(duration_s=4.5, blind=blind, estimator={"sigma_limit_deg": limit_deg}))
    reached = next(k for k, j in enumerate(free) if j.t_s > FROM_S and largest_deg(j) > limit_deg)
    lost = next(k for k, j in enumerate(judged) if j.t_s > FROM_S and j.estimate.status is Status.LOST)
    assert lost == reached
    assert all(j.estimate.status is Status.LOST for j in judged[lost:])
    # Not fresh until then: the angles' own sigma may pass the limit a little before the rotation's does.
    assert all(j.estimate.reason in (Reason.BRIDGED, Reason.UNCERTAIN) for j in judged[lost - 9 : lost])


@pytest.mark.parametrize("markers", [("m0",), ("m1",), ("m0", "m1")], ids=["m0", "m1", "both"])
@pytest.mark.parametrize("seed", [4, 5])
def test_recovery_corrects_by_no_more_than_was_stated(markers: tuple[str, ...], seed: int) -> None:
    """What changes between two instants beyond the movement itself is a change of the error: three sigmas at most."""
    blind = tuple(Blind(marker, FROM_S, FROM_S + 0.4) for marker in markers)
    judged = run(Trial(duration_s=4.0, seed=seed, blind=blind, estimator={"sigma_limit_deg": 30.0}))
    for before, after in itertools.pairwise(j for j in judged if j.t_s > 1.0):
        assert before.error_rad is not None
        assert after.error_rad is not None
        assert before.estimate.covariance is not None
        change = after.error_rad - before.error_rad
        sigma = np.sqrt(np.diag(before.estimate.covariance))
        assert np.linalg.norm(change) < 3.0 * np.linalg.norm(sigma)


def test_uncertainty_grows_while_a_marker_is_not_seen_and_shrinks_when_it_is_back() -> None:
    judged = run(Trial(duration_s=4.0, blind=(Blind("m1", FROM_S, FROM_S + 0.4),)))
    dark = [largest_deg(j) for j in judged if FROM_S + 0.1 < j.t_s < FROM_S + 0.4]
    assert all(later > earlier for earlier, later in itertools.pairwise(dark[1::3]))
    assert dark[-1] > 2.0 * dark[0]
    assert largest_deg(judged[-1]) < 1.5 * largest_deg(next(j for j in judged if j.t_s > FROM_S - 0.1))
