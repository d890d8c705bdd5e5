"""The movements that studies run through: the paper's, or recorded ones."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ghest_rt.errors import BadInputError
from ghest_rt.simulation.opensim_file import read_motion_table
from ghest_rt.simulation.sensors import find_sensors
from ghest_rt.simulation.therapy import find_movement
from ghest_rt.studies.observing.scenario import Scenario, SensorName, motion_file
from ghest_rt.studies.paper_values import MOVEMENTS
from ghest_rt.vision.station import Method

METHODS: tuple[Method, ...] = ("paper", "refined", "fused")
"""The methods that studies compare unless told otherwise."""


MEAN_OF_MOVEMENTS = "mean"
"""What stands in place of a movement's name for the mean of all."""


@dataclass(frozen=True, slots=True)
class Movements:
    """What the simulated patient does in a study.

    Attributes:
        names: Movements of Table 2; all four if neither these nor `motions` are given.
        motions: OpenSim motion files.
        duration_s: Only the first seconds of each; None for all.
    """

    names: tuple[str, ...] = ()
    motions: tuple[Path, ...] = ()
    duration_s: float | None = None

    def or_else(self, small: "Movements") -> "Movements":
        """Return these, what was not named taken from a small version of a study."""
        names = self.names or (() if self.motions else small.names)
        return Movements(names, self.motions, self.duration_s or small.duration_s)

    def scenarios(self, sensor: SensorName, seed: int, methods: Sequence[Method]) -> list[Scenario]:
        """Return the undisturbed session of every movement, each once.

        Raises:
            BadInputError: A movement is unknown, a motion file cannot be read, or its name is that of another movement.
        """
        names = self.names or (() if self.motions else MOVEMENTS)
        names = tuple(dict.fromkeys(find_movement(name).name for name in names))
        motions = _once(self.motions)
        common = {"sensor": sensor, "seed": seed, "duration_s": self.duration_s, "methods": tuple(methods)}
        named = [Scenario.model_validate({"movement": name, **common}) for name in names]
        recorded = [Scenario.model_validate({"motion": motion_file(path), **common}) for path in motions]
        return named + recorded


def _once(motions: Sequence[Path]) -> list[Path]:
    """Return every file once; movements are told apart by the files' names without ending.

    Raises:
        BadInputError: Two files would be one movement, or one has a name that results use otherwise.
    """
    files = {path.resolve(): path for path in reversed(motions)}
    named: dict[str, Path] = {}
    for path in reversed(files.values()):
        name = path.stem.lower()
        if name in {movement.lower() for movement in MOVEMENTS}:
            raise BadInputError(f"--motion {path}: {path.stem} is a movement of Table 2; give the file another name")
        if name == MEAN_OF_MOVEMENTS:
            raise BadInputError(f"--motion {path}: tables call the mean of all movements so; give the file another name")
        if name in named:
            raise BadInputError(
                f"--motion {path}: {named[name]} has the same name, and results tell movements apart by it; rename one of them"
            )
        named[name] = path
    return list(named.values())


def frames_of(scenario: Scenario) -> int:
    """Return how many frames each camera takes, about.

    Raises:
        BadInputError: The motion file cannot be read.
    """
    if scenario.motion is not None:
        t_s = read_motion_table(Path(scenario.motion.path)).t_s
        whole_s = float(t_s[-1] - t_s[0])
    else:
        whole_s = find_movement(scenario.movement or "").duration_s
    duration_s = whole_s if scenario.duration_s is None else min(scenario.duration_s, whole_s)
    return round(duration_s * find_sensors(scenario.sensor).camera.rate_hz)
