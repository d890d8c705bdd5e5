"""How a fault is judged from what a subscriber got: silence counts as well as bad samples, and stale angles are found."""

from collections.abc import Callable

import pytest

from tests.chaos.run import broken_promises
from tests.hil.faults import Fault, Seen, judge, table
from tests.hil.injection import Window
from tests.hil.rig import Sample

MS = 1_000_000
FAULT = Fault("test", (), "", frozenset())


class Subscriber:
    """Samples of every 15 ms, some of them changed or left out."""

    def __init__(self, change: Callable[[int], dict[str, object] | None]) -> None:
        self.tokens: list[tuple[int, bool]] = []
        self.samples = []
        for k in range(500):
            body = {
                "status": "valid",
                "reason": "none",
                "t_sample_ns": k * 15 * MS,
                "t_publish_ns": k * 15 * MS,
                "quaternion_wxyz": [1.0, 0.0, 0.0, 0.0],
                "seq": k,
                "run_id": "a",
            }
            changed = change(k)
            if changed is not None:
                self.samples.append(Sample(k * 15 * MS, body | changed))

    def between(self, from_ns: int, until_ns: int) -> list[Sample]:
        return [sample for sample in self.samples if sample.t_received_ns >= from_ns]


class Scene:
    def error_deg(self, t_ns: int, quaternion_wxyz: list[float]) -> float:
        return 0.1 if quaternion_wxyz[0] == 1.0 else 30.0


class FakeRig:
    name = "fake"
    scene = Scene()

    def __init__(self, change: Callable[[int], dict[str, object] | None]) -> None:
        self.subscriber = Subscriber(change)

    def wait_valid(self, count: int, timeout_s: float) -> bool:
        return True


def judged(change: Callable[[int], dict[str, object] | None]) -> Seen:
    """Judge a fault from 1.5 s to 3 s (samples 100 to 200)."""
    return judge(FakeRig(change), FAULT, Window((), "", 1500 * MS, 3000 * MS))  # type: ignore[arg-type]


LOST = {"status": "lost", "reason": "r0_no_frames", "quaternion_wxyz": None}


def test_nothing_happened() -> None:
    seen = judged(lambda k: {})
    assert (seen.detected_ms, seen.recovered_ms, seen.lost, seen.stale, seen.missing) == (None, 0, 0, 0, 0)
    assert broken_promises([seen]) == []


def test_bad_samples() -> None:
    seen = judged(lambda k: LOST if 105 <= k < 220 else {})
    assert seen.detected_ms == pytest.approx(75)
    assert seen.recovered_ms == pytest.approx(300)
    assert seen.lost == pytest.approx(115, abs=2)
    assert seen.missing == 0


def test_silence_with_a_new_process_after_it() -> None:
    seen = judged(lambda k: None if 105 <= k < 220 else {"run_id": "b", "seq": k - 220} if k >= 220 else {})
    assert seen.detected_ms == pytest.approx(60 + 200)
    assert seen.recovered_ms == pytest.approx(300)
    assert seen.longest_gap_ms == pytest.approx(116 * 15)
    assert seen.missing == 0
    assert "nothing for 1.7 s" in table([seen])


def test_a_lost_message_is_missing() -> None:
    assert judged(lambda k: None if k == 150 else {}).missing == 1


def test_a_stale_angle_called_valid_breaks_the_promise_and_one_called_degraded_does_not() -> None:
    wrong = {"quaternion_wxyz": [0.5, 0.5, 0.5, 0.5]}
    seen = judged(lambda k: wrong if k == 120 else {})
    assert seen.stale == 1
    assert "passed for fresh" in broken_promises([seen])[0]
    assert judged(lambda k: wrong | {"status": "degraded"} if k == 120 else {}).stale == 0


def test_a_late_recovery_breaks_the_promise() -> None:
    assert "in 3150 ms" in broken_promises([judged(lambda k: LOST if 105 <= k < 410 else {})])[0]
    assert broken_promises([judged(lambda k: LOST if 105 <= k < 390 else {})]) == []
    assert "recovered never" in broken_promises([judged(lambda k: LOST if k >= 105 else {})])[0]
