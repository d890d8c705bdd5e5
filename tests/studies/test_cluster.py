"""A local cluster of two worker processes, one of which is killed half-way."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ghest_rt.errors import BadInputError
from ghest_rt.studies.engine.cluster import ClusterExecutor
from ghest_rt.studies.engine.local import LocalExecutor
from ghest_rt.studies.engine.run import run_tasks
from ghest_rt.studies.engine.store import ResultStore
from ghest_rt.studies.observing.scenario import Scenario
from ghest_rt.studies.observing.tasks import observe_task
from ghest_rt.studies.session.tasks import judge_task
from tests.studies.study_tasks import square_task

distributed = pytest.importorskip("distributed", reason="needs the extra cluster")


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address=":0",
        local_directory=str(tmp_path_factory.mktemp("dask")),
    ) as found:
        yield found


@pytest.mark.filterwarnings("ignore")  # Dask's own, about the worker that was killed
def test_a_worker_killed_half_way_loses_no_result(cluster: Any, tmp_path: Path) -> None:
    log, store = tmp_path / "log", ResultStore(tmp_path / "tasks")
    base = square_task(10, log)
    tasks = [square_task(n, log, needs=(base,), sleep_s=0.1) for n in range(24)]
    pids = [worker.pid for worker in cluster.workers.values()]
    assert len(set(pids)) == 2
    killed: list[int] = []

    def kill_one(done: float, total: float) -> None:
        if done >= total / 2 and not killed:
            worker = {int(line.split()[1]) for line in log.read_text().splitlines()} - {os.getpid()}
            assert len(worker) == 2  # both took part
            killed.append(worker.pop())
            os.kill(killed[0], signal.SIGKILL)

    found = run_tasks(tasks, store, ClusterExecutor(cluster.scheduler_address), kill_one)
    assert killed
    assert [value["found"] for value in found] == [n**2 + 100 for n in range(24)]


def test_a_cluster_without_a_worker_is_told_and_one_that_grows_is_used(tmp_path: Path) -> None:
    log, store = tmp_path / "log", ResultStore(tmp_path / "tasks")
    place = {"dashboard_address": ":0", "local_directory": str(tmp_path), "threads_per_worker": 1, "protocol": "tcp://"}
    with distributed.LocalCluster(n_workers=0, processes=False, **place) as empty:
        executor = ClusterExecutor(empty.scheduler_address, worker_s=0.5)
        with pytest.raises(BadInputError, match=r"no worker; start one with `dask worker tcp://"):
            run_tasks([square_task(1, log)], store, executor)
        empty.scale(1)
        most: list[int] = []

        def grow(done: float, total: float) -> None:
            empty.scale(4)
            most.append(len([task for task in empty.scheduler.tasks.values() if task.state != "memory"]))

        tasks = [square_task(n, log, sleep_s=0.05) for n in range(60)]
        found = run_tasks(tasks, store, ClusterExecutor(empty.scheduler_address), grow)
        assert [value["found"] for value in found] == [n**2 for n in range(60)]
        assert max(most) > 4  # more than the first worker's share


def test_a_session_judged_on_the_cluster_is_the_one_judged_here(cluster: Any, tmp_path: Path) -> None:
    base = Scenario(movement="SIR", duration_s=0.2, methods=("paper", "refined"))
    task = judge_task(base.model_copy(update={"shifts": ("m1:x:0.01",)}), 13, observe_task(base, 13))
    there = run_tasks([task], ResultStore(tmp_path / "there"), ClusterExecutor(cluster.scheduler_address))
    here = run_tasks([task], ResultStore(tmp_path / "here"), LocalExecutor(1))
    assert there == here
