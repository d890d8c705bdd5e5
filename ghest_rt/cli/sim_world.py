"""The simulated clinic as the devices of a live run, with its truth. Needs the extra `sim` as soon as it is imported."""

from dataclasses import replace

from ghest_rt.cli.scoreboard import Scoreboard
from ghest_rt.cli.sim_pace import PacedWorld
from ghest_rt.cli.simulated_station import checked_station
from ghest_rt.config.load import LoadedStation
from ghest_rt.messages.published import Event, GhAngles, Health
from ghest_rt.messages.results import GhEstimate
from ghest_rt.simulation.building import stage_world
from ghest_rt.simulation.knee import JOINT as KNEE
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.simulation.staged import StagedWorld


class LiveWorld:
    """A simulated patient who starts to move at `start_ns`; as an output it tells a scoreboard the truth of every sample."""

    def __init__(self, options: SimulateOptions, start_ns: int) -> None:
        """Set up the clinic.

        Args:
            options: What to simulate; `out` is not used.
            start_ns: The service clock's time at the beginning of the movement.

        Raises:
            BadInputError: An option or the station file cannot be used.
            GhestError: The exoskeleton cannot follow the movement.
        """
        if options.station is not None and checked_station(options.station).config.joint.name == KNEE:
            options = replace(options, movement=None)  # a knee has one of its own
        self._world: StagedWorld = stage_world(options)
        self._paced = PacedWorld(self._world)
        self._start_ns = start_ns
        self.scoreboard = Scoreboard()
        self.scoreboard.set_time_axis(self.to_world_ns)

    @property
    def station(self) -> LoadedStation:
        """The station, adjusted to this patient."""
        return self._world.station

    @property
    def device_settings(self) -> dict[str, object]:
        """What simulated devices are made with."""
        return {"world": self._paced, "start_ns": self._start_ns}

    @property
    def slowness(self) -> str:
        """That rendering does not keep up with the clock, in words; "" if it does."""
        return self._paced.slowness

    def to_world_ns(self, t_ns: int) -> int:
        """Return the world's time of an instant of the service's clock."""
        return t_ns - self._start_ns

    def angles(self, message: GhAngles, estimate: GhEstimate) -> None:
        """Tell the truth of this sample, then have it judged."""
        if estimate.gh_from_arm is not None:
            self.scoreboard.truth(self._world.truth_at(self.to_world_ns(estimate.t_sample_ns)))
        self.scoreboard.angles(message, estimate)

    def health(self, message: Health) -> None:
        """Nothing to judge in it."""

    def event(self, message: Event) -> None:
        """Nothing to judge in it."""
