"""Pairing of colour and depth by time; the queue to the reading thread; numbering."""

import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ghest_drivers.errors import BadDeviceData, DeviceLost, EndOfStream, ReadTimeout
from ghest_drivers.hardware.cameras.frame_queue import FrameQueue
from ghest_drivers.hardware.cameras.numbering import FrameNumbering
from ghest_drivers.hardware.cameras.pairing import Image, Pair, Pairer
from ghest_drivers.hardware.cameras.stats import CameraStats
from ghest_drivers.samples import CameraInfo, Intrinsics, RgbdFrame

_PERIOD = 100
_INFO = CameraInfo("r0", "m", "s", Intrinsics(2, 2, 1, 1, 0, 0), Intrinsics(2, 2, 1, 1, 0, 0), 0.001, np.eye(4), 60.0)


def _run(events: list[tuple[str, int]]) -> tuple[list[tuple[int, int | None]], CameraStats]:
    """Feed ("c"|"d", time) events; return (colour time, depth time) pairs."""
    stats = CameraStats()
    pairer: Pairer[str] = Pairer(_PERIOD, stats)
    pairs: list[Pair[str]] = []
    for stream, t_ns in events:
        pairs += pairer.add_color(Image(t_ns, "c")) if stream == "c" else pairer.add_depth(Image(t_ns, "d"))
    pairs += pairer.flush()
    return [(pair.color.t_capture_ns, pair.depth.t_capture_ns if pair.depth else None) for pair in pairs], stats


@pytest.mark.parametrize(
    ("events", "expected"),
    [
        ([("d", 0), ("c", 10), ("c", 110), ("d", 100)], [(10, 0), (110, 100)]),
        ([("d", 0), ("c", 60)], [(60, None)]),  # more than half a period apart
        ([("c", 0), ("c", 100), ("d", 100), ("c", 200), ("d", 200)], [(0, None), (100, 100), (200, 200)]),
        ([("c", 0), ("d", 100), ("c", 100)], [(0, None), (100, 100)]),  # depth of frame 0 was dropped
        ([("d", 0), ("d", 100), ("d", 200), ("c", 200)], [(200, 200)]),
        ([("c", 0), ("c", 100), ("c", 200), ("c", 300)], [(0, None), (100, None), (200, None), (300, None)]),
        ([("c", 0), ("d", 0), ("c", 0), ("d", 0)], [(0, 0)]),  # delivered twice
    ],
)
def test_pairs(events: list[tuple[str, int]], expected: list[tuple[int, int | None]]) -> None:
    assert _run(events)[0] == expected


@given(
    st.lists(
        st.tuples(st.booleans(), st.booleans(), st.integers(-40, 40), st.integers(0, 150), st.integers(0, 150)), max_size=40
    )
)
def test_every_colour_image_leaves_once_in_order_with_depth_of_its_own_time_or_none(
    frames: list[tuple[bool, bool, int, int, int]],
) -> None:
    arrivals: list[tuple[int, int, str, int]] = []
    last = {"c": 0, "d": 0}
    for k, (has_color, has_depth, offset, color_delay, depth_delay) in enumerate(frames):
        for present, stream, t_ns, delay in (
            (has_color, "c", 1000 + k * _PERIOD, color_delay),
            (has_depth, "d", 1000 + k * _PERIOD + offset, depth_delay),
        ):
            if present:
                last[stream] = max(last[stream], t_ns + delay)  # a stream arrives in order
                arrivals.append((last[stream], k, stream, t_ns))
    pairs, stats = _run([(stream, t_ns) for _, _, stream, t_ns in sorted(arrivals)])
    assert [color for color, _ in pairs] == [1000 + k * _PERIOD for k, frame in enumerate(frames) if frame[0]]
    for color_ns, depth_ns in pairs:
        assert depth_ns is None or abs(depth_ns - color_ns) <= _PERIOD // 2
    used = [depth for _, depth in pairs if depth is not None]
    assert len(used) == len(set(used))
    assert stats.repeated == 0


def test_depth_that_is_late_by_no_more_than_the_patience_is_never_missed() -> None:
    events = [("c", 0), ("c", 100)] + [e for k in range(2, 50) for e in (("d", (k - 2) * 100 + 20), ("c", k * 100))]
    pairs, _ = _run(events)
    assert [depth for _, depth in pairs[:-2]] == [color + 20 for color, _ in pairs[:-2]]


def _frame(seq: int) -> RgbdFrame:
    return RgbdFrame(_INFO, seq, np.zeros((2, 2, 3), np.uint8), None, 0, 0, 0, 0)


def test_a_live_queue_drops_the_oldest() -> None:
    stats = CameraStats()
    queue = FrameQueue(2, stats)
    for seq in range(5):
        queue.put(_frame(seq))
    assert [queue.get(0.0).seq, queue.get(0.0).seq] == [3, 4]
    assert stats.overruns == 3
    with pytest.raises(ReadTimeout):
        queue.get(0.0)


def test_a_lossless_queue_makes_the_writer_wait() -> None:
    queue = FrameQueue(2, CameraStats(), lossless=True)
    writer = threading.Thread(target=lambda: [queue.put(_frame(seq)) for seq in range(20)])
    writer.start()
    assert [queue.get(10.0).seq for _ in range(20)] == list(range(20))
    writer.join(10.0)


def test_closing_frees_a_writer_that_waits() -> None:
    queue = FrameQueue(1, CameraStats(), lossless=True)
    writer = threading.Thread(target=lambda: [queue.put(_frame(seq)) for seq in range(3)])
    writer.start()
    queue.close()
    writer.join(10.0)
    assert not writer.is_alive()
    with pytest.raises(DeviceLost):
        queue.get(0.0)


def test_the_end_comes_after_the_last_frame_and_errors_in_their_turn() -> None:
    queue = FrameQueue(4, CameraStats())
    queue.put(_frame(0))
    queue.put(BadDeviceData("garbled"))
    queue.put(_frame(2))
    queue.end(EndOfStream("through"))
    queue.end(DeviceLost("too late to matter"))
    assert queue.get(0.0).seq == 0
    with pytest.raises(BadDeviceData):
        queue.get(0.0)
    assert queue.get(0.0).seq == 2
    for _ in range(2):
        with pytest.raises(EndOfStream):
            queue.get(10.0)


@pytest.mark.parametrize(
    ("numbers", "seqs", "missing"),
    [
        ([7, 8, 9], [0, 1, 2], 0),
        ([7, 10, 11], [0, 3, 4], 2),
        ([7, 8, 1, 2], [0, 1, 2, 3], 0),  # restarted
        ([7, 1_000_000, 1_000_001], [0, 1, 2], 0),  # jumped
    ],
)
def test_numbering(numbers: list[int], seqs: list[int], missing: int) -> None:
    stats = CameraStats()
    numbering = FrameNumbering(stats)
    assert [numbering.next(number) for number in numbers] == seqs
    assert stats.missing == missing
