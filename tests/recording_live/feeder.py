"""A process that records at 100 Hz and tells what it has handed over; to be killed, or to run out of disk.

`python -m tests.recording_live.feeder FOLDER [--max-file-bytes N] [--seconds S] [--recipient AGE1…]`
"""

import argparse
import resource
import sys
import time
from pathlib import Path

from ghest_drivers.clock import MonotonicClock
from ghest_rt.service.recorder import Recorder
from ghest_rt.service.recorder_parts import Parts
from ghest_rt.service.recorder_settings import RecorderSettings
from tests.recording_live.conftest import STATION, Feed


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--max-file-bytes", type=int)
    parser.add_argument("--recipient", action="append", default=[])
    parser.add_argument("--seconds", type=float, default=60.0)
    arguments = parser.parse_args()
    if arguments.max_file_bytes is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (arguments.max_file_bytes, arguments.max_file_bytes))
    clock = MonotonicClock()
    t_0_ns = clock.now_ns()
    feed = Feed(160, 120, t_0_ns)
    settings = RecorderSettings(recipients=tuple(arguments.recipient))
    parts = Parts(arguments.folder, STATION, {}, settings, started_unix_ns=time.time_ns(), now_ns=t_0_ns)
    recorder = Recorder(parts, settings, clock)
    recorder.start()
    for info in feed.infos.values():
        recorder.camera(info)
    for seq in range(round(arguments.seconds * 100)):
        clock.sleep_until_ns(feed.sample(seq).t_arrival_ns)
        feed.into(recorder, range(seq, seq + 1))
        failed = " failed" if recorder.counts().failure else ""
        sys.stdout.write(f"{seq}{failed}\n")
        sys.stdout.flush()
    counts = recorder.close()
    sys.stdout.write(f"end {sum(counts.dropped.values())} {counts.failure}\n")


if __name__ == "__main__":
    main()
