"""The examples of the documentation do what they say."""

import importlib.util
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import ModuleType

import pytest

from tests.client.fakes import FakeStation

FOLDER = Path(__file__).parents[2] / "docs" / "examples" / "python"


def load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_game_shows_what_is_live_and_pauses_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    game = load("game")
    drawn: list[str] = []
    monkeypatch.setattr(game, "draw", drawn.append)
    with FakeStation() as station:
        playing = threading.Thread(target=game.play, args=(station.endpoint, 60))
        playing.start()
        station.publish_until(lambda: not playing.is_alive())
    assert drawn[0] == "pause: no station"
    assert "pause: m0_not_seen" in drawn  # what this station has to say


def test_the_log_has_every_sample() -> None:
    with FakeStation() as station:
        logging = subprocess.Popen([sys.executable, FOLDER / "log.py", station.endpoint], stdout=subprocess.PIPE, text=True)
        try:
            assert logging.stdout is not None
            time.sleep(0.5)
            station.publish(300, period_s=0.005)
            lines = [logging.stdout.readline() for _ in range(20)]
        finally:
            logging.kill()
            logging.communicate()
    seqs = [int(line.split()[1]) for line in lines if line.endswith(" lost -\n")]
    assert len(seqs) > 10
    assert seqs == list(range(seqs[0], seqs[0] + len(seqs)))
