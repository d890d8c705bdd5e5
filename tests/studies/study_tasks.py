"""Tasks that tests run on workers; imported there by name."""

import os
import signal
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ghest_rt.studies.engine.task import Result, Task

HERE = "tests.studies.study_tasks"


def square_task(n: int, log: Path, *, needs: tuple[Task, ...] = (), sleep_s: float = 0.0, die_once: Path | None = None) -> Task:
    parameters = {"n": n, "log": str(log), "sleep_s": sleep_s, "die_once": None if die_once is None else str(die_once)}
    return Task.of(f"{HERE}:square", parameters, needs=needs)


def square(parameters: dict[str, Any], needs: Sequence[Result]) -> Result:
    """Square a number, add what the needs found, and leave a line in a log."""
    time.sleep(parameters["sleep_s"])
    fuse = parameters["die_once"]
    if fuse is not None and Path(fuse).exists():
        Path(fuse).unlink()
        os.kill(os.getpid(), signal.SIGKILL)
    with Path(parameters["log"]).open("a") as log:
        log.write(f"{parameters['n']} {os.getpid()}\n")
    if parameters["n"] < 0:
        raise ValueError("negative")
    total = parameters["n"] ** 2 + sum(int(need.arrays["found"][0]) for need in needs)
    return Result({"found": total}, {"found": np.array([total])})
