"""What subscribers are told of markers that move, and of the elbow."""

import json

import numpy as np
import pytest

from ghest_rt.messages.published import EventKind
from ghest_rt.messages.results import DriftReport, ElbowAngles, GhEstimate, MarkerDrift, Reason, Status
from ghest_rt.service.compose import AnglesComposer, Numbering
from ghest_rt.service.drift_watch import DriftWatch
from tests.service.fakes import FakePipeline
from tests.service.rig import Rig

MS = 1_000_000


def drift(flagged: bool, x_m: float = 0.0) -> MarkerDrift:
    slide = np.array([x_m, 0.0, -0.5 * x_m])
    return MarkerDrift(flagged, 0.9 if flagged else 0.1, slide, np.full(3, 0.001), np.array([0.0, 0.02, 0.0]), np.full(3, 0.01))


def estimate(report: DriftReport | None, elbow: ElbowAngles | None = None) -> GhEstimate:
    return GhEstimate(
        0, Status.VALID, Reason.NONE, np.eye(3), np.eye(4), np.eye(4), np.eye(4), 1e-6 * np.eye(3), {}, report, elbow
    )


def test_a_flag_is_told_once_it_has_stood_for_half_a_second() -> None:
    watch = DriftWatch()
    told = []
    for k in range(200):
        flagged = 20 <= k < 120 or k == 5  # one flicker, then for a second
        told += [(k, *event[:2]) for event in watch.see(k * 10 * MS, DriftReport(drift(False), drift(flagged, 0.02)))]
    assert told == [(70, "m1", EventKind.MARKER_DRIFTED), (170, "m1", EventKind.MARKER_BACK)]


def test_what_is_told_names_size_direction_and_certainty() -> None:
    watch = DriftWatch()
    report = DriftReport(drift(True, 0.02), drift(False))
    assert watch.see(0, report) == []
    assert watch.see(100 * MS, None) == []
    ((marker, _, text),) = watch.see(500 * MS, report)
    assert marker == "m0"
    assert "moved by 22.4 mm (x +20.0 ± 1.0, y +0.0 ± 1.0, z -10.0 ± 1.0 mm)" in text
    assert "turned by 1.1°" in text
    assert "probability 0.90" in text


def test_a_sample_carries_the_drift_and_the_elbow() -> None:
    composer = AnglesComposer("right", "fused", "cal", 0, Numbering())
    report = DriftReport(drift(True, 0.02), drift(False))
    message = composer.compose(estimate(report, ElbowAngles(np.radians(80.0), 0.0, None, (0.05, 0.05))), 0)
    sent = json.loads(message.model_dump_json())
    assert sent["drift"]["m0"]["flagged"] is True
    assert sent["drift"]["m0"]["slide_mm"] == [20.0, 0.0, -10.0]
    assert sent["drift"]["m1"]["probability"] == 0.1
    assert sent["elbow_deg"]["flexion"] == pytest.approx(80.0)
    assert sent["elbow_sigma_deg"]["carrying"] == pytest.approx(np.degrees(0.05))
    assert len(message.model_dump_json()) < 2200  # two Ethernet frames at most

    none = json.loads(composer.compose(estimate(None), 0).model_dump_json())
    assert (none["drift"], none["elbow_deg"], none["elbow_sigma_deg"]) == (None, None, None)


async def test_the_service_sends_an_event_when_a_marker_has_moved() -> None:
    class Drifting(FakePipeline):
        def estimate(self, t_ns: int) -> GhEstimate:
            found = super().estimate(t_ns)
            return found if found.gh_from_arm is None else estimate(DriftReport(drift(True, 0.02), drift(False)))

    rig = Rig(pipeline=Drifting)

    async def scene() -> None:
        rig.feed()
        await rig.out.until(lambda: EventKind.MARKER_DRIFTED in rig.out.kinds("m0"))

    await rig.during(scene)
    assert rig.out.kinds("m0") == [EventKind.MARKER_DRIFTED]
    assert rig.out.kinds("m1") == []
