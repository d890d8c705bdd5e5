"""Stations without depth, and depth lost on the way: simulated recordings through the pipeline."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra sim")

from ghest_drivers.samples import RgbdFrame
from ghest_rt.config.load import LoadedStation
from ghest_rt.errors import BadInputError
from ghest_rt.estimation.pipeline import Pipeline
from ghest_rt.messages.results import Reason, Status
from ghest_rt.recording.reader import Recording
from ghest_rt.simulation.command import simulate
from ghest_rt.simulation.faults import parse_fault
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.studies.score import run_with_truth, score_recording

OPTIONS = SimulateOptions(out=Path(), movement="SFE", duration_s=0.8, seed=21)


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("color")
    kinds = {
        "with_depth": OPTIONS,
        "color_only": replace(OPTIONS, color_only=True),
        "depth_lost": replace(OPTIONS, faults=(parse_fault("depth-lost:r0:0.3:0.2"),)),
    }
    for name, options in kinds.items():
        simulate(replace(options, out=folder / f"{name}.mcap"), lambda share: None)
    return {name: folder / f"{name}.mcap" for name in kinds}


@pytest.mark.parametrize("method", ["refined", "photometric", "fused"])
def test_a_station_without_depth_is_valid_and_says_it_knows_less(recordings: dict[str, Path], method: str) -> None:
    less, more = (run_with_truth(recordings[name], method) for name in ("color_only", "with_depth"))
    assert {estimate.status for estimate in less.estimates[5:]} == {Status.VALID}  # the first do not know the speed yet
    # In the direction that is known best: how m1 sits about the arm is less certain than any image.
    spread = [
        float(np.mean([np.linalg.eigvalsh(e.covariance)[0] for e in run.estimates[10:] if e.covariance is not None]))
        for run in (less, more)
    ]
    assert spread[0] > 2.0 * spread[1]
    assert score_recording(recordings["color_only"], method).orientation_rmse_deg < 0.5


def test_its_recording_has_no_depth_and_says_so(recordings: dict[str, Path]) -> None:
    recording = Recording(recordings["color_only"])
    assert [camera.depth for camera in recording.station.config.cameras.values()] == [False, False]
    frames = [event for event in recording.events() if hasattr(event, "depth_counts")]
    assert len(frames) > 50
    assert all(frame.depth_counts is None for frame in frames)
    assert not recording.problems
    assert b"/r0/depth" not in recordings["color_only"].read_bytes()


def test_depth_is_left_aside_where_the_station_says_so(recordings: dict[str, Path]) -> None:
    """The same images with and without depth give the same poses once the station leaves depth out, and only then."""
    with_depth, without = Recording(recordings["with_depth"]), Recording(recordings["color_only"])
    deep, flat = (
        next(event for event in recording.events() if isinstance(event, RgbdFrame)) for recording in (with_depth, without)
    )
    assert deep.depth_counts is not None
    assert flat.depth_counts is None
    assert np.array_equal(deep.color_rgb, flat.color_rgb)

    def pose(station: LoadedStation, frame: RgbdFrame) -> np.ndarray:
        pipeline = Pipeline(station, with_depth.camera_infos, with_depth.encoder_joints, "refined")
        found = pipeline.observe(frame).camera_from_marker
        assert found is not None
        return found

    assert np.array_equal(pose(without.station, deep), pose(without.station, flat))
    assert not np.array_equal(pose(with_depth.station, deep), pose(without.station, deep))


def test_the_papers_method_needs_depth(recordings: dict[str, Path]) -> None:
    with pytest.raises(BadInputError, match="cannot work from colour alone"):
        run_with_truth(recordings["color_only"], "paper")


@pytest.mark.parametrize("method", ["refined", "fused"])
def test_depth_lost_on_the_way_degrades_and_comes_back(recordings: dict[str, Path], method: str) -> None:
    run = run_with_truth(recordings["depth_lost"], method)
    first_ns = run.estimates[0].t_sample_ns
    reasons = {e.reason for e in run.estimates if 0.36 <= (e.t_sample_ns - first_ns) * 1e-9 <= 0.48}
    assert reasons == {Reason.COLOR_ONLY}
    assert {e.status for e in run.estimates if (e.t_sample_ns - first_ns) * 1e-9 > 0.6} == {Status.VALID}
    assert {e.status for e in run.estimates} == {Status.VALID, Status.DEGRADED}
    assert score_recording(recordings["depth_lost"], method).orientation_rmse_deg < 0.3
