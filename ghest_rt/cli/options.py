"""Choices offered on the command line."""

from enum import StrEnum


class Method(StrEnum):
    """How markers are found and angles estimated."""

    PAPER = "paper"
    REFINED = "refined"
    FUSED = "fused"
    ARUCO = "aruco"


class Movement(StrEnum):
    """The paper's movements, Table 2."""

    SABAD = "SAbAd"
    SFE = "SFE"
    SIR = "SIR"
    COMB = "COMB"


class Sensor(StrEnum):
    """Simulated sensors."""

    PAPER = "paper"
    SR300 = "sr300"


class Side(StrEnum):
    """Arms."""

    RIGHT = "right"
    LEFT = "left"


class MarkerTexture(StrEnum):
    """What simulated marker plates carry."""

    DISKS = "disks"
    ARUCO = "aruco"
