"""What is shown while the service runs, and the score against the truth."""

import io
import logging

import numpy as np
import pytest
from rich.console import Console

from ghest_rt.cli.live import LiveFacts, LiveView, gauge
from ghest_rt.cli.report import report_of
from ghest_rt.cli.scoreboard import Scoreboard
from ghest_rt.geometry.so3 import rot_y, rot_z
from ghest_rt.messages.published import Health, InputHealth, InputState, Lateness
from ghest_rt.messages.results import GhEstimate, Reason, Status, TruthSample
from ghest_rt.service.compose import AnglesComposer, Numbering
from ghest_rt.service.health import SampleCounts

FACTS = LiveFacts("bench · COMB.mcap", "refined", ("tcp/127.0.0.1:7447",), "ghest/bench/gh/angles")


def pose(R: np.ndarray, x_m: float = 0.0) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = R
    T[0, 3] = x_m
    return T


def estimate(t_ns: int, angle_deg: float = 0.0, x_m: float = 0.0) -> GhEstimate:
    R = rot_y(np.radians(angle_deg))
    newest = {"r0": t_ns, "r1": t_ns, "encoders": t_ns}
    return GhEstimate(t_ns, Status.VALID, Reason.NONE, R, pose(R, x_m), np.eye(4), np.eye(4), 1e-6 * np.eye(3), newest)


def lost(t_ns: int, reason: Reason = Reason.M0_NOT_SEEN) -> GhEstimate:
    return GhEstimate(t_ns, Status.LOST, reason, None, None, None, None, None, {})


def truth(t_ns: int, angle_deg: float = 0.0) -> TruthSample:
    R = rot_y(np.radians(angle_deg))
    return TruthSample(t_ns, R, pose(R), np.eye(4), np.eye(4), np.eye(4), {})


def health() -> Health:
    inputs = {"r0": InputHealth(state=InputState.STREAMING, received=70, missing=1, skipped=2, bad=3, reopened=0, rate_hz=66.5)}
    late = Lateness(p50_us=90.0, p99_us=1500.0, p999_us=2000.0, max_us=2500.0)
    common = {"seq": 0, "t_ns": 0, "t_unix_ns": 0, "uptime_s": 1.0, "status": Status.VALID, "reason": Reason.NONE}
    counted = {"published": 67, "valid": 60, "rate_hz": 66.6, "missed_ticks": 4, "cpu_percent": 31.0, "memory_mb": 99.0}
    return Health.model_validate({**common, **counted, "lateness": late, "inputs": inputs})


def composer() -> AnglesComposer:
    return AnglesComposer("right", "refined", "cal", 0, Numbering())


def test_the_page_shows_angles_inputs_timing_and_error() -> None:
    out = io.StringIO()
    board = Scoreboard()
    board.truth(truth(0, angle_deg=-30.5))
    with LiveView(Console(file=out, force_terminal=True, width=120, height=40), FACTS, board) as view:
        sample = estimate(0, angle_deg=-30.0)
        message = composer().compose(sample, 45_000_000)
        board.angles(message, sample)
        view.angles(message, sample)
        view.health(health())
    page = out.getvalue()
    for shown in (
        "30.00°",
        "flexion",
        "abduction",
        "rotation",
        "valid",
        "66.60 Hz",
        "missed 4",
        "p99 1.50",
        "tcp/127.0.0.1:7447",
    ):
        assert shown in page
    assert "rms 0.500°" in page
    assert "45 ms" in page


def test_a_lost_sample_shows_its_reason_and_no_angle() -> None:
    out = io.StringIO()
    with LiveView(Console(file=out, force_terminal=True, width=120, height=40), FACTS, Scoreboard()) as view:
        view.angles(composer().compose(lost(0), 0), lost(0))
    assert "lost (m0_not_seen)" in out.getvalue()
    assert "0.00°" not in out.getvalue()


def test_without_a_terminal_there_is_a_line_a_second(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    out = io.StringIO()
    with LiveView(Console(file=out), FACTS, Scoreboard()) as view:
        view.angles(composer().compose(estimate(0, -12.0), 0), estimate(0))
        view.health(health())
    assert out.getvalue() == ""
    (line,) = caplog.messages
    assert "flexion   12.00" in line
    assert "66.60 Hz" in line


def test_gauges_grow_from_the_middle() -> None:
    assert gauge(0.0).count("█") == gauge(float("nan")).count("█") == 0
    assert gauge(60.0).index("│") < gauge(60.0).index("█")
    assert gauge(-60.0).index("█") < gauge(-60.0).index("│")
    assert len({len(gauge(value)) for value in (-1000.0, -60.0, 0.0, 5.0, 120.0, 1000.0)}) == 1


def test_the_score_waits_for_the_truth_and_interpolates_it() -> None:
    board = Scoreboard()
    board.set_time_axis(lambda t_ns: t_ns - 1000)
    sample = estimate(1005, angle_deg=5.0, x_m=0.002)
    board.truth(truth(0, 0.0))
    board.angles(composer().compose(sample, 0), sample)
    assert board.judged == 0
    board.truth(truth(10, 8.0))  # 4 degrees at 5
    board.angles(composer().compose(lost(1015), 0), lost(1015))
    assert board.judged == 1
    assert board.orientation_rmse_deg == pytest.approx(1.0)
    assert board.position_rmse_mm == pytest.approx(2.0)


def test_a_rotation_about_any_axis_counts_with_its_angle() -> None:
    board = Scoreboard()
    R = rot_z(np.radians(2.0)) @ rot_y(np.radians(40.0))
    sample = GhEstimate(5, Status.VALID, Reason.NONE, R, pose(R), np.eye(4), np.eye(4), None, {})
    board.truth(truth(5, 40.0))
    board.angles(composer().compose(sample, 5), sample)
    assert board.newest_orientation_deg == pytest.approx(2.0)


def test_the_report_leaves_the_start_out_of_shares_and_rates() -> None:
    counts = SampleCounts()
    for k in range(10):
        counts.add(lost(k * 10_000_000, Reason.STARTING))
    for k in range(10, 21):
        counts.add(lost(k * 10_000_000) if k == 12 else estimate(k * 10_000_000))
    report = report_of("x.mcap", "refined", counts, None)
    assert report.samples == 21
    assert report.starting == 10
    assert report.valid_fraction == pytest.approx(10 / 11)
    assert report.rate_hz == pytest.approx(100.0)
    assert report.orientation_rmse_deg is None
