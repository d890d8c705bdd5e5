"""The example of another limb, through rendered images: config/examples/knee."""

import math
from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason="needs the extra sim")

from ghest_rt.config.load import load_station
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.errors import BadInputError
from ghest_rt.estimation.angles import clinical, euler_yxz, signs_of
from ghest_rt.messages.results import Status
from ghest_rt.service.compose import AnglesComposer, Numbering
from ghest_rt.simulation.command import simulate
from ghest_rt.simulation.disturbances import parse_shift
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.studies.score import JudgedRun, run_with_truth, score_recording

STATION = shipped_config_dir() / "examples" / "knee" / "station.toml"


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("knee") / "knee.mcap"
    simulate(
        SimulateOptions(out=out, station=STATION, duration_s=5.0, seed=1), lambda share: None
    )  # those of docs/other-limbs.md
    return out


@pytest.fixture(scope="module")
def run(recording: Path) -> JudgedRun:
    return run_with_truth(recording)


def test_the_angles_are_those_of_the_knee(run: JudgedRun) -> None:
    config = load_station(STATION).config
    assert run.method == "fused"
    assert {estimate.status for estimate in run.estimates[20:]} == {Status.VALID}
    flexion_deg = []
    for estimate in run.estimates[20:]:
        truth = run.truth.at(estimate.t_sample_ns)
        assert estimate.gh_from_arm is not None and truth is not None
        seen, meant = (
            clinical(euler_yxz(R), "right", signs_of(config.joint)) for R in (estimate.gh_from_arm, truth.gh_from_arm)
        )
        for name in ("flexion_rad", "abduction_rad", "rotation_rad"):
            assert math.degrees(getattr(seen, name)) == pytest.approx(math.degrees(getattr(meant, name)), abs=0.1)
        flexion_deg.append(math.degrees(seen.flexion_rad))
    assert max(flexion_deg) - min(flexion_deg) > 20.0
    assert min(flexion_deg) > 0.0  # a knee bends one way


def test_no_marker_is_said_to_have_drifted(run: JudgedRun) -> None:
    """The knee turns about one axis almost alone; a filter that knows shoulders alone takes that for a marker that slides."""
    for estimate in run.estimates:
        assert estimate.drift is None or not (estimate.drift.m0.flagged or estimate.drift.m1.flagged)
    assert run.estimates[-1].drift is not None


@pytest.mark.parametrize(("method", "when_published_deg"), [("refined", 2.5), ("fused", 0.03)])
def test_it_is_as_accurate_as_at_the_shoulder(recording: Path, method: str, when_published_deg: float) -> None:
    found = score_recording(recording, method)
    assert found.orientation_rmse_deg < 0.03
    assert found.position_rmse_m < 1e-4
    assert found.published_orientation_rmse_deg is not None
    assert found.published_orientation_rmse_deg < when_published_deg
    assert found.valid_fraction > 0.98


def test_the_message_names_the_joint_and_leaves_the_shoulders_sets_out(run: JudgedRun) -> None:
    config = load_station(STATION).config
    composer = AnglesComposer("right", "refined", "nominal", 0, Numbering(), joint=config.joint)
    message = composer.compose(run.estimates[30], run.estimates[30].t_sample_ns)
    assert message.joint == "knee"
    assert message.angles_deg is not None and message.angles_deg.flexion > 0
    assert (message.isb_yxy_deg, message.swing_twist_deg) == (None, None)


def test_what_the_simulated_knee_cannot_do_is_said(tmp_path: Path) -> None:
    options = SimulateOptions(out=tmp_path / "k.mcap", station=STATION, marker_moves=(parse_shift("m1:z:0.02"),))
    with pytest.raises(BadInputError, match="no marker shifts"):
        simulate(options, lambda share: None)
