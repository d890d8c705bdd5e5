"""Cameras plugged in the wrong way round: no angles instead of wrong ones."""

from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason="needs the extra sim")

from ghest_drivers.samples import RgbdFrame
from ghest_rt.estimation.pipeline import Pipeline
from ghest_rt.recording.reader import Recording
from ghest_rt.simulation.command import SimulateOptions, simulate


@pytest.mark.parametrize("method", ["refined", "fused"])
def test_the_other_cameras_marker_is_not_taken_for_ones_own(tmp_path: Path, method: str) -> None:
    out = tmp_path / "swapped.mcap"
    simulate(SimulateOptions(out=out, movement="SIR", duration_s=0.1, seed=2), lambda share: None)
    recording = Recording(out)
    other = {"r0": recording.camera_infos["r1"], "r1": recording.camera_infos["r0"]}
    for swapped in (False, True):
        pipeline = Pipeline(recording.station, recording.camera_infos, recording.encoder_joints, method)
        frames = [event for event in recording.events() if isinstance(event, RgbdFrame)]
        seen = [pipeline.observe(replace(frame, info=other[frame.info.name]) if swapped else frame) for frame in frames]
        assert len(seen) >= 12
        assert {observation.camera_from_marker is None for observation in seen} == {swapped}
