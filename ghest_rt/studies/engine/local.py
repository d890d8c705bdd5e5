"""Tasks on the cores of this machine, by joblib."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ghest_rt.errors import GhestError
from ghest_rt.extras import need_extra
from ghest_rt.studies.engine.run import Job, Outcome
from ghest_rt.studies.engine.store import ResultStore


@dataclass(frozen=True, slots=True)
class LocalExecutor:
    """Worker processes; each puts its results into the store itself, so that an interruption loses nothing finished.

    Attributes:
        workers: How many; None for one per core. With one, tasks run in this process.
    """

    workers: int | None = None

    def run(self, jobs: Sequence[Job], store: ResultStore) -> Iterator[Outcome]:
        """Yield what became of each job as it ends.

        Raises:
            GhestError: joblib is not installed, or a worker process was killed.
        """
        need_extra("study", "a study")
        from joblib import Parallel, delayed, parallel_config  # noqa: PLC0415 - an extra, imported only when used
        from joblib.externals.loky.process_executor import TerminatedWorkerError  # noqa: PLC0415

        workers = min(self.workers or os.cpu_count() or 1, max(1, len(jobs)))
        if workers == 1:
            for job in jobs:
                yield run_and_keep(job, store)
            return
        try:
            with parallel_config(backend="loky", n_jobs=workers, inner_max_num_threads=1):
                # Tasks are long and unlike: one at a time goes to whoever is free.
                pool = Parallel(return_as="generator_unordered", batch_size=1, pre_dispatch=f"{2 * workers}")
                yield from pool(delayed(run_and_keep)(job, store) for job in jobs)
        except TerminatedWorkerError as error:
            raise GhestError(
                "a worker process was killed (out of memory?); what was finished is kept: run the same command again, "
                "perhaps with fewer --workers"
            ) from error


def run_and_keep(job: Job, store: ResultStore) -> Outcome:
    """Run a job whose needs are in the store, and keep its result."""
    try:
        store.save(job.key, *job.task.run([store.load(key) for key in job.need_keys]))
    except Exception as error:
        # One task that fails must not end the others.
        return Outcome(job, f"{job.task}: {type(error).__name__}: {error}")
    return Outcome(job)
