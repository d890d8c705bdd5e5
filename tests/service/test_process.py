"""Preparing the process for pacing, and putting it back."""

import gc
import signal
import sys

import pytest

from ghest_rt.service.process import punctual_process
from ghest_rt.service.stop_signals import StopSignals


def test_a_punctual_process_is_put_back_as_it_was() -> None:
    interval_s = sys.getswitchinterval()
    with punctual_process() as achieved:
        assert not gc.isenabled()
        assert sys.getswitchinterval() < interval_s
        assert achieved
    assert gc.isenabled()
    assert gc.get_freeze_count() == 0
    assert sys.getswitchinterval() == interval_s


def test_a_signal_is_noted_told_and_the_handlers_put_back() -> None:
    before = signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGINT)
    told: list[str] = []
    with StopSignals() as stop:
        assert not stop.is_set()
        with stop.calling(lambda: told.append("first")):
            signal.raise_signal(signal.SIGTERM)
        assert stop.is_set()
        with stop.calling(lambda: told.append("already")):
            pass
        signal.raise_signal(signal.SIGTERM)
    assert told == ["first", "already"]
    assert (signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGINT)) == before


def test_a_second_interrupt_interrupts_as_usual() -> None:
    with StopSignals():
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
