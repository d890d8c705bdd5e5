"""Tasks on a Dask cluster, named by its scheduler; the results come back here, so no folder needs to be shared."""

import importlib
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

from ghest_rt.errors import BadInputError
from ghest_rt.extras import need_extra
from ghest_rt.studies.engine.run import Job, Outcome
from ghest_rt.studies.engine.salt import code_salt
from ghest_rt.studies.engine.store import ResultStore
from ghest_rt.studies.engine.task import Result, Task


@dataclass(frozen=True, slots=True)
class ClusterExecutor:
    """A Dask cluster. A worker that dies loses nothing but time: its tasks go to the others.

    Attributes:
        address: Of the scheduler, such as tcp://node1:8786.
        connect_s: How long to wait for it.
        worker_s: How long to wait for its first worker.
    """

    address: str
    connect_s: float = 10.0
    worker_s: float = 60.0

    def __post_init__(self) -> None:
        """Check the address, whether there will be anything to run or not.

        Raises:
            BadInputError: It is none.
        """
        _check(self.address)

    def run(self, jobs: Sequence[Job], store: ResultStore) -> Iterator[Outcome]:
        """Yield what became of each job as it ends.

        Raises:
            BadInputError: No scheduler answers at the address, or it has no worker.
            GhestError: Dask is not installed.
        """
        dask = _distributed()
        try:
            client = dask.Client(self.address, timeout=self.connect_s, set_as_default=False)
        except (OSError, ValueError) as error:
            raise BadInputError(f"--scheduler {self.address}: no Dask scheduler answers there: {error}") from error
        with client:
            try:
                client.wait_for_workers(1, timeout=self.worker_s)
            except TimeoutError as error:
                raise BadInputError(
                    f"--scheduler {self.address}: the scheduler has no worker; start one with `dask worker {self.address}`"
                ) from error
            waiting = deque(jobs)
            under_way: dict[Any, Job] = {}
            completed = dask.as_completed(loop=client.loop)

            def submit() -> None:
                # Never more under way than keeps every thread busy, as many as there are by now: what tasks need travels with
                # them.
                while waiting and len(under_way) < 2 * max(1, sum(client.nthreads().values())):
                    job = waiting.popleft()
                    needs = [store.load(key) for key in job.need_keys]
                    future = client.submit(run_there, job.task, needs, key=f"ghest-{job.key}", pure=False)
                    under_way[future] = job
                    completed.add(future)

            submit()
            for future in completed:
                outcome = _keep(under_way.pop(future), future, store)
                submit()
                yield outcome


def run_there(task: Task, needs: list[Result]) -> tuple[str, Result, float]:
    """Run a task on a worker; return the worker's hash of the code, the result, and its processor time."""
    return code_salt(task.kind), *task.run(needs)


def _check(address: str) -> None:
    # Dask would start its client before it reads the address, and wait for it to end.
    try:
        parts = urlsplit(address)
        complete = bool(parts.scheme and parts.hostname and parts.port)
    except ValueError:
        complete = False
    if not complete:
        raise BadInputError(f"--scheduler {address}: give protocol, host and port, such as tcp://node1:8786")


def _distributed() -> Any:
    need_extra("cluster", "a cluster of Dask")
    return importlib.import_module("distributed")


def _keep(job: Job, future: Any, store: ResultStore) -> Outcome:
    if future.status != "finished":
        error = future.exception()
        return Outcome(job, f"{job.task}: {type(error).__name__}: {error}")
    salt, result, cpu_s = future.result()
    if salt != code_salt(job.task.kind):
        return Outcome(job, "a worker of the cluster has other code or other versions of libraries than this machine")
    store.save(job.key, result, cpu_s)
    return Outcome(job)
