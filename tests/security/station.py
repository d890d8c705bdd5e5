"""A station in a process of its own: publishes with its identity and tells what came in. `python -m tests.security.station`.

Reads commands on standard input, a line each: `report` prints what has come in since the last report as JSON; the end of the
input ends it.
"""

import json
import sys
import threading
from collections import Counter
from pathlib import Path

import numpy as np
import zenoh

from ghest_rt.config.load import load_station
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.messages.results import GhEstimate, Reason, Status
from ghest_rt.security.identity_check import load_identity
from ghest_rt.security.session import open_session
from ghest_rt.service.compose import AnglesComposer, Numbering
from ghest_rt.service.publisher import ZenohPublisher

CALIBRATE_KEY = "ghest/sim/calibrate/run"
_PERIOD_S = 0.015


def main() -> None:
    """Run until the input ends."""
    (folder,) = sys.argv[1:]
    identity = load_identity(Path(folder))
    config = load_station(shipped_config_dir() / "station-sim.toml").config
    session, (endpoint,) = open_session(("tls/127.0.0.1:0",), (), identity)
    lock, came_in = threading.Lock(), Counter[str]()

    def count(what: str) -> None:
        with lock:
            came_in[what] += 1

    def calibrate(query: zenoh.Query) -> None:
        count("calibrate query")
        query.reply(CALIBRATE_KEY, b'"done"')

    def forged(sample: zenoh.Sample) -> None:
        if b"forged" in sample.payload.to_bytes():
            count(f"put {sample.key_expr}")

    stop = threading.Event()
    with session, ZenohPublisher(session, config) as publisher:
        declared = [session.declare_queryable(CALIBRATE_KEY, calibrate), session.declare_subscriber("ghest/**", forged)]
        thread = threading.Thread(target=_publish, args=(publisher, stop))
        thread.start()
        _say(endpoint)
        for _ in sys.stdin:
            with lock:
                _say(json.dumps(came_in))
                came_in.clear()
        stop.set()
        thread.join()
        for item in declared:
            item.undeclare()


def _say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def _publish(publisher: ZenohPublisher, stop: threading.Event) -> None:
    composer = AnglesComposer("right", "refined", "cal", 0, Numbering())
    t_ns = 0
    while not stop.wait(_PERIOD_S):
        t_ns += 15_000_000
        newest = {"r0": t_ns, "r1": t_ns, "encoders": t_ns}
        pose = np.eye(4)
        estimate = GhEstimate(t_ns, Status.VALID, Reason.NONE, np.eye(3), pose, pose, pose, 1e-6 * np.eye(3), newest)
        publisher.angles(composer.compose(estimate, t_ns + 45_000_000), estimate)


if __name__ == "__main__":
    main()
