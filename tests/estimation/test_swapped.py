"""Cameras plugged in the wrong way round: no angles instead of wrong ones."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason="needs the extra sim")

from ghest_drivers.samples import RgbdFrame
from ghest_rt.estimation.offline import estimate_events
from ghest_rt.estimation.pipeline import Pipeline
from ghest_rt.messages.results import Reason, Status
from ghest_rt.recording.reader import Recording
from ghest_rt.simulation.command import simulate
from ghest_rt.simulation.options import SimulateOptions


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    out: Path = tmp_path_factory.mktemp("swapped") / "right.mcap"
    simulate(SimulateOptions(out=out, movement="SIR", duration_s=0.4, seed=2), lambda share: None)
    return Recording(out)


def events(recording: Recording, *, swapped: bool) -> Iterator[object]:
    other = {"r0": recording.camera_infos["r1"], "r1": recording.camera_infos["r0"]}
    for event in recording.events():
        yield replace(event, info=other[event.info.name]) if swapped and isinstance(event, RgbdFrame) else event


@pytest.mark.parametrize("method", ["refined", "fused"])
def test_the_other_cameras_marker_is_not_taken_for_ones_own(recording: Recording, method: str) -> None:
    told = []
    for swapped in (False, True):
        pipeline = Pipeline(recording.station, recording.camera_infos, recording.encoder_joints, method)
        found = list(estimate_events(events(recording, swapped=swapped), pipeline))[5:20]
        assert len(found) == 15
        assert all((each.gh_from_arm is None) == swapped for each in found)
        told.append({(each.status, each.reason) for each in found})
    assert Status.LOST not in {status for status, _ in told[0]}
    assert told[1] == {(Status.LOST, Reason.M0_NOT_SEEN)}
