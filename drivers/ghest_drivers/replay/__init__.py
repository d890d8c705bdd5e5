"""Devices that play a recording back at its pace."""

from ghest_drivers.replay.player import ReplayPlayer

__all__ = ["ReplayPlayer"]
