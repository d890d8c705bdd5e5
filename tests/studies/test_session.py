"""Sessions in memory: the same figures as from a recording, and nothing rendered twice."""

from pathlib import Path

import numpy as np
import pytest

from ghest_rt.errors import BadInputError
from ghest_rt.simulation.command import simulate
from ghest_rt.simulation.disturbances import parse_shift
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.studies.observing.observed import observe
from ghest_rt.studies.observing.packing import pack, unpack
from ghest_rt.studies.observing.scenario import MountError, Scenario, motion_file
from ghest_rt.studies.observing.tasks import observe_session, observe_task
from ghest_rt.studies.score import score_recording
from ghest_rt.studies.session.tasks import judge_session, judge_task

METHODS = ("paper", "refined", "fused")
DURATION_S = 0.6


def scenario(**changes: object) -> Scenario:
    return Scenario.model_validate({"movement": "COMB", "seed": 3, "duration_s": DURATION_S, "methods": METHODS, **changes})


def judged(case: Scenario, *, base: bool = False) -> dict[str, dict[str, dict[str, float]]]:
    task = judge_task(case, 40, observe_task(case.undisturbed(), 40) if base else None)
    seen = [observe_session(need.parameters, ()) for need in task.needs]
    return judge_session(task.parameters, seen).values  # type: ignore[return-value]


def test_in_memory_the_figures_are_those_of_score_on_a_recording(tmp_path: Path) -> None:
    path = tmp_path / "comb.mcap"
    shift = parse_shift("m1:x:0.01")
    simulate(SimulateOptions(out=path, movement="COMB", seed=3, duration_s=DURATION_S, marker_moves=(shift,)), lambda _: None)
    here = judged(scenario(shifts=("m1:x:0.01",)), base=True)
    for method in METHODS:
        score = score_recording(path, method)
        assert here[method]["samples"] == score.samples
        assert here[method]["valid_fraction"] == score.valid_fraction
        assert here[method]["orientation_deg"]["rms"] == pytest.approx(score.orientation_rmse_deg, rel=1e-9)
        assert here[method]["position_m"]["rms"] == pytest.approx(score.position_rmse_m, rel=1e-9)
        assert here[method]["m0_m"]["rms"] == pytest.approx(score.m0_rmse_m, rel=1e-9)
        assert here[method]["m1_m"]["rms"] == pytest.approx(score.m1_rmse_m, rel=1e-9)


@pytest.mark.parametrize("shift", ["m0:y:0.02", "m1:z:0.02"])
def test_rendering_only_what_the_marker_touches_changes_nothing(shift: str) -> None:
    case = scenario(shifts=(shift,))
    everything, touched = judged(case), judged(case, base=True)
    for method in METHODS:
        for quantity in ("m0_m", "m1_m", "position_m", "orientation_deg"):
            assert touched[method][quantity]["rms"] == pytest.approx(everything[method][quantity]["rms"], rel=1e-9)


def test_a_session_survives_packing() -> None:
    session = observe(scenario(duration_s=0.2).world(), METHODS)
    again = unpack(pack(session, "paper"))
    assert again.joints == session.joints
    assert again.camera_infos.keys() == session.camera_infos.keys()
    assert [e.t_arrival_ns for e in again.encoders] == [e.t_arrival_ns for e in session.encoders]
    assert again.truth[5].joints_rad == session.truth[5].joints_rad
    for key, found in session.markers.items():
        for one, other in zip(found, again.markers[key], strict=True):
            assert (one.seq, one.status, one.disks_used) == (other.seq, other.status, other.disks_used)
            np.testing.assert_array_equal(one.camera_from_marker, other.camera_from_marker)
            assert (one.covariance is None) == (other.covariance is None)


def test_a_mount_or_encoder_that_is_told_wrongly_moves_the_estimate_by_what_geometry_says() -> None:
    mount = MountError(translation_m=(0.003, 0.0, 0.0))
    shifted = judged(scenario(mount_errors={"r0": mount}), base=True)["refined"]
    assert shifted["m0_m"]["rms"] == pytest.approx(0.003, rel=0.02)
    assert shifted["m1_m"]["rms"] < 1e-4
    biased = judged(scenario(encoder_bias_rad={"j0": 0.01}), base=True)["refined"]
    assert biased["m0_m"]["rms"] < 1e-4  # camera r0 stands on the base
    assert 0.002 < biased["m1_m"]["rms"] < 0.01  # 10 mrad at half a metre


def test_what_cannot_be_told_wrongly_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"j99.*joints with encoders are j0"):
        judged(scenario(encoder_bias_rad={"j99": 0.1}, duration_s=0.1), base=True)
    with pytest.raises(BadInputError, match="no camera r9"):
        judged(scenario(mount_errors={"r9": MountError()}, duration_s=0.1), base=True)
    with pytest.raises(BadInputError, match="name a motion file"):
        motion_file(tmp_path / "none.mot")
