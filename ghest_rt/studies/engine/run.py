"""Run a study's tasks: what is not there yet, in the order of their needs, each result kept as soon as it is there."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Protocol

from ghest_rt.errors import GhestError
from ghest_rt.studies.engine.salt import code_salt
from ghest_rt.studies.engine.store import ResultStore
from ghest_rt.studies.engine.task import Task

Progress = Callable[[float, float], None]


@dataclass(frozen=True, slots=True)
class Job:
    """A task about to be run.

    Attributes:
        task: The task.
        key: Where its result goes.
        need_keys: Where the results are that it needs, in their order.
    """

    task: Task
    key: str
    need_keys: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a job: its result is in the store, or `error` says why not."""

    job: Job
    error: str | None = None


class Executor(Protocol):
    """Carries out jobs whose needs are in the store, in any order, and puts their results there."""

    def run(self, jobs: Sequence[Job], store: ResultStore) -> Iterator[Outcome]:
        """Yield what became of each job as it ends."""
        ...


def run_tasks(
    tasks: Sequence[Task], store: ResultStore, executor: Executor, progress: Progress | None = None
) -> list[dict[str, object]]:
    """Return the values of every task, running those whose result is not in the store yet, and what they need.

    Args:
        tasks: The tasks; the same one may be there more than once.
        store: Where results are kept.
        executor: What carries them out.
        progress: Told (cost done, cost of all that was missing).

    Raises:
        GhestError: Tasks failed; those that did not are kept.
    """
    keys: dict[Task, str] = {}
    for task in tasks:
        _add_keys(task, keys)
    waves = _waves(tasks, keys, store)
    total = sum(job.task.cost for wave in waves for job in wave)
    done = 0.0
    for wave in waves:
        errors: list[str] = []
        for outcome in executor.run(sorted(wave, key=lambda job: -job.task.cost), store):
            done += outcome.job.task.cost
            if outcome.error is not None:
                errors.append(outcome.error)
            if progress is not None:
                progress(done, total)
        if errors:
            kept = "what was finished is kept and will not be run again"
            raise GhestError(f"{len(errors)} of {len(wave)} tasks failed, {kept}; the first: {errors[0]}")
    return [store.values(keys[task]) for task in tasks]


def spent_cpu_s(tasks: Sequence[Task], store: ResultStore) -> float:
    """Return the processor time that finished tasks and what they need took, now or in earlier runs."""
    keys: dict[Task, str] = {}
    for task in tasks:
        _add_keys(task, keys)
    return sum(store.cpu_s(key) for key in keys.values() if store.has(key))


def _add_keys(task: Task, keys: dict[Task, str]) -> None:
    if task not in keys:
        for need in task.needs:
            _add_keys(need, keys)
        keys[task] = task.key(code_salt)


def _waves(tasks: Sequence[Task], keys: Mapping[Task, str], store: ResultStore) -> list[list[Job]]:
    """Return the jobs whose results are missing, those needed before those that need them."""
    level: dict[Task, int] = {}
    has = cache(store.has)  # reads the whole result

    def visit(task: Task) -> int:
        if task not in level:
            missing = [need for need in task.needs if not has(keys[need])]
            level[task] = 1 + max((visit(need) for need in missing), default=-1)
        return level[task]

    for task in tasks:
        if not has(keys[task]):
            visit(task)
    waves: list[list[Job]] = [[] for _ in range(max(level.values(), default=-1) + 1)]
    for task, at in level.items():
        waves[at].append(Job(task, keys[task], tuple(keys[need] for need in task.needs)))
    return waves
