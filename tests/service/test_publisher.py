"""What a subscriber in another process gets, and what can be asked for."""

import json
import socket
import subprocess
import sys
import threading

import jsonschema
import numpy as np
import pytest
import zenoh

from ghest_rt.config.load import load_station
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.config.station import StationConfig
from ghest_rt.errors import BadInputError, GhestError
from ghest_rt.messages.published import json_schemas
from ghest_rt.messages.results import GhEstimate, Reason, Status
from ghest_rt.security.session import open_session
from ghest_rt.service.compose import AnglesComposer, Numbering
from ghest_rt.service.publisher import ZenohPublisher

SAMPLES = 2000

# Prints the sequence numbers it got, once the last one has come; knows nothing but Zenoh and JSON.
SUBSCRIBER = """
import json, sys, threading, zenoh
config = zenoh.Config()
for key, value in {"mode": '"peer"', "listen/endpoints": "[]", "connect/endpoints": json.dumps([sys.argv[1]]),
                   "scouting/multicast/enabled": "false", "scouting/gossip/enabled": "false"}.items():
    config.insert_json5(key, value)
last, got, done = int(sys.argv[2]), [], threading.Event()
def keep(sample):
    message = json.loads(sample.payload.to_bytes())
    got.append((message["seq"], str(sample.encoding), str(sample.key_expr)))
    if message["seq"] >= last:
        done.set()
with zenoh.open(config) as session, session.declare_subscriber("ghest/*/gh/angles", keep):
    print("ready", flush=True)
    done.wait(20)
print(json.dumps(got))
"""


@pytest.fixture(scope="module")
def config() -> StationConfig:
    return load_station(shipped_config_dir() / "station-sim.toml").config


def estimate(t_ns: int, valid: bool = True) -> GhEstimate:
    newest = {"r0": t_ns, "r1": t_ns, "encoders": t_ns}
    if not valid:
        return GhEstimate(t_ns, Status.LOST, Reason.M0_NOT_SEEN, None, None, None, None, None, newest)
    return GhEstimate(t_ns, Status.VALID, Reason.NONE, np.eye(3), np.eye(4), np.eye(4), np.eye(4), 1e-6 * np.eye(3), newest)


def composer() -> AnglesComposer:
    return AnglesComposer("right", "refined", "cal", 0, Numbering())


@pytest.mark.parametrize("lossless", [False, True])
def test_a_subscriber_in_another_process_gets_every_sequence_number(config: StationConfig, lossless: bool) -> None:
    session, (endpoint,) = open_session(("tcp/127.0.0.1:0",))
    compose = composer().compose
    with (
        session,
        ZenohPublisher(session, config, lossless) as publisher,
        subprocess.Popen(
            [sys.executable, "-c", SUBSCRIBER, endpoint, str(SAMPLES - 1)], stdout=subprocess.PIPE, text=True
        ) as process,
    ):
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        matched = threading.Event()
        probe = session.declare_publisher("ghest/*/gh/angles")
        listener = probe.declare_matching_listener(lambda status: matched.set() if status.matching else None)
        assert probe.matching_status.matching or matched.wait(10.0)
        pause = threading.Event()
        for k in range(SAMPLES):
            publisher.angles(compose(estimate(k * 15_000_000), k * 15_000_000), estimate(k))
            if not lossless and k % 20 == 0:
                pause.wait(0.002)  # far above 66.6 Hz still
        listener.undeclare()
        got = json.loads(process.communicate(timeout=30)[0])
    assert [seq for seq, _, _ in got] == list(range(SAMPLES))
    assert {(encoding, key) for _, encoding, key in got} == {("application/json", "ghest/sim/gh/angles")}


def test_every_message_fits_its_schema() -> None:
    schema = json_schemas()["gh_angles"]
    jsonschema.Draft202012Validator.check_schema(schema)
    compose = composer().compose
    for valid in (True, False):
        document = json.loads(compose(estimate(10**9, valid), 1_045_000_000).model_dump_json())
        jsonschema.validate(document, schema)
        assert document["t_sample_ns"] == 10**9
        assert document["age_ms"]["r0"] == pytest.approx(45.0)
        assert (document["angles_deg"] is None) is not valid
        assert (document["quaternion_wxyz"] is None) is not valid


def test_schema_config_calibration_and_last_can_be_asked_for(config: StationConfig) -> None:
    session, (endpoint,) = open_session(("tcp/127.0.0.1:0",))
    client, _ = open_session(connect=(endpoint,))

    def ask(what: str) -> zenoh.Reply:
        (reply,) = client.get(f"ghest/sim/{what}", timeout=5.0)
        return reply

    with session, client, ZenohPublisher(session, config) as publisher:
        with client.liveliness().declare_subscriber("ghest/*/alive", history=True) as alive:
            assert str(alive.recv().key_expr) == "ghest/sim/alive"
        assert json.loads(ask("schema").ok.payload.to_bytes()) == json_schemas()
        assert json.loads(ask("config").ok.payload.to_bytes())["station"]["id"] == "sim"
        assert json.loads(ask("calibration").ok.payload.to_bytes())["id"] == config.calibration.id
        assert "no sample" in ask("last").err.payload.to_string()
        publisher.angles(composer().compose(estimate(5), 5), estimate(5))
        assert json.loads(ask("last").ok.payload.to_bytes())["t_sample_ns"] == 5


def test_the_liveliness_token_goes_with_the_publisher(config: StationConfig) -> None:
    session, (endpoint,) = open_session(("tcp/127.0.0.1:0",))
    client, _ = open_session(connect=(endpoint,))
    with session, client:
        publisher = ZenohPublisher(session, config)
        with client.liveliness().declare_subscriber("ghest/*/alive", history=True) as alive:
            assert alive.recv().kind == zenoh.SampleKind.PUT
            publisher.close()
            assert alive.recv().kind == zenoh.SampleKind.DELETE


def test_a_taken_port_is_named_with_a_remedy() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(GhestError, match=r"port is taken.*--listen") as caught:
            open_session((endpoint,))
    assert endpoint in str(caught.value)
    assert ".rs" not in str(caught.value)


@pytest.mark.parametrize(
    "endpoint", ["7447", "tcp/127.0.0.1", "tpc/127.0.0.1:7447", "tcp/127.0.0.1:port", "tcp/127.0.0.1:99999"]
)
def test_a_malformed_endpoint_is_named_with_an_example(endpoint: str) -> None:
    with pytest.raises(BadInputError, match=r"tcp/127\.0\.0\.1:7447"):
        open_session((endpoint,))


def test_by_default_it_listens_on_this_machine_only(config: StationConfig) -> None:
    assert config.publisher.listen == ("tcp/127.0.0.1:7447",)
    assert config.publisher.connect == ()
