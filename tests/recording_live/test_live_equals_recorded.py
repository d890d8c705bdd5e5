"""A recording made live gives the angles that were published live, bit for bit."""

import asyncio
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason="needs the extra sim")

from ghest_drivers.replay import ReplayPlayer
from ghest_drivers.samples import EncoderInfo
from ghest_rt.config.load import LoadedStation, parse_station
from ghest_rt.estimation.offline import estimate_events
from ghest_rt.estimation.pipeline import Pipeline
from ghest_rt.messages.results import Status
from ghest_rt.recording.reader import Recording, open_recordings
from ghest_rt.service.clocks import ScaledClock
from ghest_rt.service.compose import AnglesComposer, Numbering
from ghest_rt.service.contract import ServiceSettings
from ghest_rt.service.inputs import InputSettings
from ghest_rt.service.loop import Service
from ghest_rt.service.recorder import Recorder
from ghest_rt.service.recorder_parts import Parts
from ghest_rt.service.recorder_settings import RecorderSettings
from ghest_rt.service.recorder_taps import RecordedCamera, RecordedEncoders, RecorderOutput
from ghest_rt.simulation.command import simulate
from ghest_rt.simulation.options import SimulateOptions
from tests.recording_live.conftest import STARTED_UNIX_NS
from tests.service.fakes import Collector

PATIENT_LAG_MS = 400  # so that a busy machine loses no frame


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    out = tmp_path_factory.mktemp("simulated") / "sfe.mcap"
    simulate(SimulateOptions(out=out, movement="SFE", duration_s=0.8, seed=5), lambda share: None)
    return Recording(Path(out))


def patient(station: LoadedStation) -> LoadedStation:
    toml_text = station.toml_text.replace("lag_ms = 45.0", f"lag_ms = {PATIENT_LAG_MS}.0")
    assert toml_text != station.toml_text
    return replace(station, toml_text=toml_text, config=parse_station(toml_text, "test"))


async def test_what_was_published_can_be_estimated_from_the_recording(source: Recording, tmp_path: Path) -> None:
    station, clock, out = patient(source.station), ScaledClock(), Collector()
    config = station.config
    player = ReplayPlayer(source.events(), source.camera_infos, EncoderInfo("encoders", source.encoder_joints), clock)
    settings = RecorderSettings(part_ns=300_000_000)
    parts = Parts(tmp_path, station, {}, settings, started_unix_ns=STARTED_UNIX_NS, now_ns=clock.now_ns())
    recorder = Recorder(parts, settings, clock)
    recorder.start()
    output = RecorderOutput(recorder)
    service = Service(
        settings=ServiceSettings(
            config.rate_hz,
            PATIENT_LAG_MS * 1_000_000,
            InputSettings(reconnect=False, max_backlog_ns=PATIENT_LAG_MS * 1_000_000),
        ),
        cameras={name: RecordedCamera(player.camera(name), recorder) for name in source.camera_infos},
        encoders=RecordedEncoders(player.encoders(), recorder),
        make_pipeline=lambda infos, joints: Pipeline(station, infos, joints, "refined"),
        composer=AnglesComposer(config.station.arm, "refined", config.calibration.id, 0, Numbering()),
        outputs=(out, output),
        clock=clock,
    )
    output.attach(service)
    await asyncio.wait_for(service.run(), 30.0)
    player.close()
    counts = recorder.close()
    assert counts.dropped == {} and len(counts.parts) >= 2

    recordings = open_recordings(tmp_path)
    first = recordings[0]
    assert first.grid_t_0_ns == service.anchor_ns
    pipeline = Pipeline(first.station, first.camera_infos, first.encoder_joints, "refined")
    events = (event for recording in recordings for event in recording.events())
    composer = AnglesComposer(config.station.arm, "refined", config.calibration.id, 0, Numbering())
    offline = {
        estimate.t_sample_ns: composer.compose(estimate, estimate.t_sample_ns)
        for estimate in estimate_events(events, pipeline, t_0_ns=first.grid_t_0_ns)
    }
    live = [sample for sample in out.samples if sample.status is Status.VALID]
    assert len(live) >= 40
    for sample in live:
        again = offline[sample.t_sample_ns]
        assert (again.angles_deg, again.quaternion_wxyz, again.sigma_deg) == (
            sample.angles_deg,
            sample.quaternion_wxyz,
            sample.sigma_deg,
        )
