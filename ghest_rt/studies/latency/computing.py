"""How long this machine takes from an image to an answer, method by method."""

from collections.abc import Callable
from dataclasses import dataclass
from statistics import median

from ghest_rt.estimation.pipeline import Pipeline
from ghest_rt.simulation.world import World
from ghest_rt.vision.station import Method

Clock = Callable[[], int]

_WARM_UP_FRAMES = 5


@dataclass(frozen=True, slots=True)
class ComputingTime:
    """Medians over frames, milliseconds.

    Attributes:
        vision_ms: To find the marker in an image; of the two cameras, which work side by side, the slower one.
        answer_ms: To take in encoder rows and both markers and answer for an instant.
    """

    vision_ms: float
    answer_ms: float


def measure_computing(world: World, method: Method, frames: int, clock: Clock) -> ComputingTime:
    """Run the first frames of a session through a method's pipeline against a clock.

    Args:
        world: The session.
        method: The method.
        frames: How many frames of each camera, beyond those that warm up.
        clock: Nanoseconds from any origin, such as `time.perf_counter_ns`.
    """
    infos = {name: world.camera_info(name) for name in world.camera_names}
    pipeline = Pipeline(world.station, infos, world.encoder_info().joint_names, method)
    vision_ns: list[int] = []
    answer_ns: list[int] = []
    row = 0
    for k in range(min(_WARM_UP_FRAMES + frames, *(world.frame_count(name) for name in infos))):
        seen = []
        slower_ns = 0
        for name in infos:
            frame = world.frame(name, k)
            if frame is None:
                continue
            start = clock()
            seen.append(pipeline.observe(frame))
            slower_ns = max(slower_ns, clock() - start)
        arrived_ns = max(observation.t_arrival_ns for observation in seen)
        rows = []
        while row < world.encoder_count and world.encoder_arrival_ns(row) <= arrived_ns:
            rows.append(world.encoder_sample(row))
            row += 1
        start = clock()
        for sample in rows:
            if sample is not None:
                pipeline.add(sample)
        for observation in seen:
            pipeline.add(observation)
        pipeline.estimate(arrived_ns - pipeline.lag_ns)
        if k >= _WARM_UP_FRAMES:
            vision_ns.append(slower_ns)
            answer_ns.append(clock() - start)
    return ComputingTime(median(vision_ns) * 1e-6, median(answer_ns) * 1e-6)
