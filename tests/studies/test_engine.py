"""The study engine: nothing run twice, nothing finished lost."""

import importlib.util
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ghest_rt.cli.study.running import opened, shown_progress
from ghest_rt.errors import BadInputError, GhestError
from ghest_rt.studies.engine import salt
from ghest_rt.studies.engine.cluster import ClusterExecutor
from ghest_rt.studies.engine.local import LocalExecutor
from ghest_rt.studies.engine.run import run_tasks, spent_cpu_s
from ghest_rt.studies.engine.store import ResultStore
from ghest_rt.studies.engine.task import Result, Task
from tests.studies.study_tasks import square_task


def runs(log: Path) -> list[str]:
    return log.read_text().split()[::2] if log.exists() else []


@pytest.mark.parametrize("workers", [1, 2])
def test_values_come_in_the_order_asked_for_and_needs_first(tmp_path: Path, workers: int) -> None:
    log, store = tmp_path / "log", ResultStore(tmp_path / "tasks")
    base = square_task(3, log)
    tasks = [square_task(n, log, needs=(base,)) for n in (1, 2, 4, 1)]
    shares: list[float] = []
    found = run_tasks(tasks, store, LocalExecutor(workers), lambda done, total: shares.append(done / total))
    assert [value["found"] for value in found] == [10, 13, 25, 10]
    assert runs(log)[0] == "3"
    assert sorted(runs(log)) == ["1", "2", "3", "4"]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert spent_cpu_s(tasks, store) >= 0.0


def test_what_finished_tasks_needed_may_be_gone(tmp_path: Path) -> None:
    log, store = tmp_path / "log", ResultStore(tmp_path / "tasks")
    base = square_task(3, log)
    tasks = [square_task(1, log, needs=(base,))]
    run_tasks([base, *tasks], store, LocalExecutor(1))
    for path in store.folder.glob(f"{base.key(salt.code_salt)}*"):
        path.unlink()
    assert [value["found"] for value in run_tasks(tasks, store, LocalExecutor(1))] == [10]
    assert spent_cpu_s(tasks, store) >= 0.0


def test_what_is_there_is_not_run_again_and_an_interrupted_study_goes_on_where_it_was(tmp_path: Path) -> None:
    log, store = tmp_path / "log", ResultStore(tmp_path / "tasks")
    tasks = [square_task(n, log) for n in range(6)]
    done = 0

    def interrupt(_done: float, _total: float) -> None:
        nonlocal done
        done += 1
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_tasks(tasks, store, LocalExecutor(1), interrupt)
    before = runs(log)
    assert len(before) == 3
    assert [value["found"] for value in run_tasks(tasks, store, LocalExecutor(1))] == [0, 1, 4, 9, 16, 25]
    assert sorted(runs(log)) == [str(n) for n in range(6)]


def test_an_interruption_says_that_nothing_finished_is_lost(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(KeyboardInterrupt), shown_progress("study accuracy"):
        raise KeyboardInterrupt
    assert "study accuracy: interrupted; what is finished is kept" in capsys.readouterr().err


def test_a_task_that_fails_is_named_and_the_others_are_kept(tmp_path: Path) -> None:
    log, store = tmp_path / "log", ResultStore(tmp_path / "tasks")
    tasks = [square_task(n, log) for n in (5, -1, 6)]
    with pytest.raises(GhestError, match=r'1 of 3 tasks failed.*"n":-1.*ValueError: negative'):
        run_tasks(tasks, store, LocalExecutor(1))
    run_tasks([tasks[0], tasks[2]], store, LocalExecutor(1))
    assert sorted(runs(log)) == ["-1", "5", "6"]


def test_a_killed_worker_is_told_and_what_it_had_finished_is_kept(tmp_path: Path) -> None:
    log, store, fuse = tmp_path / "log", ResultStore(tmp_path / "tasks"), tmp_path / "fuse"
    fuse.touch()
    tasks = [square_task(1, log), square_task(2, log), square_task(3, log, sleep_s=1.0, die_once=fuse)]
    with pytest.raises(GhestError, match="run the same command again"):
        run_tasks(tasks, store, LocalExecutor(2))
    assert [value["found"] for value in run_tasks(tasks, store, LocalExecutor(2))] == [1, 4, 9]
    assert sorted(runs(log)) == ["1", "2", "3"]


def test_the_key_depends_on_parameters_needs_and_code_but_not_on_the_cost() -> None:
    def salted(kind: str) -> str:
        return f"code of {kind}"

    task = Task.of("a:b", {"x": 1, "y": [2]}, cost=3.0)
    assert task.key(salted) == Task.of("a:b", {"y": [2], "x": 1}).key(salted)
    others = [
        Task.of("a:b", {"x": 2, "y": [2]}),
        Task.of("a:c", {"x": 1, "y": [2]}),
        Task.of("a:b", {"x": 1, "y": [2]}, needs=(task,)),
    ]
    assert len({other.key(salted) for other in (task, *others)}) == 4
    assert task.key(salted) != task.key(lambda kind: f"newer code of {kind}")


def fresh_salt() -> Any:
    """The module as a new process has it: nothing is kept from before."""
    spec = importlib.util.find_spec("ghest_rt.studies.engine.salt")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_change_of_the_code_beside_a_task_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "kinds").mkdir()
    (tmp_path / "kinds" / "tasks.py").write_text("from kinds import helper\n")
    helper = tmp_path / "kinds" / "helper.py"
    monkeypatch.syspath_prepend(str(tmp_path))
    salts = []
    for text in ("one", "two", "one"):
        helper.write_text(f"# {text}\n")
        salts.append(fresh_salt().code_salt("kinds.tasks:run"))
    assert salts[0] == salts[2] != salts[1]


def test_other_libraries_count_for_what_uses_them() -> None:
    kinds = ("ghest_rt.studies.observing.tasks:observe_session", "ghest_rt.studies.sensitivity.sobol:evaluate")

    def salts(**versions: str) -> list[str]:
        fresh = fresh_salt()
        fresh.version = lambda package: versions.get(package, "1")
        return [fresh.code_salt(kind) for kind in kinds]

    one, newer, mujoco = salts(), salts(SALib="2"), salts(mujoco="2")
    assert (one[0] == newer[0], one[1] == newer[1]) == (True, False)
    assert (one[0] == mujoco[0], one[1] == mujoco[1]) == (False, False)


def test_results_appear_whole_or_not_at_all(tmp_path: Path) -> None:
    store = ResultStore(tmp_path)
    store.save("k", Result({"a": [1.5, None]}), 0.25)
    assert store.values("k") == {"a": [1.5, None]}
    assert store.cpu_s("k") == 0.25
    (tmp_path / "other.npz").touch()  # arrays written, then killed
    assert not store.has("other")
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []
    (tmp_path / "file").touch()
    with pytest.raises(GhestError, match="cannot be kept"):
        ResultStore(tmp_path / "file" / "below").save("k", Result({}), 0.0)


def shortened(content: bytes) -> bytes:
    return content[:-8]


def flipped(content: bytes) -> bytes:
    """One bit of a number: 16 in both files."""
    at = content.index(b"16") if b"16" in content else content.index((16).to_bytes(8, "little"))
    return content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]


@pytest.mark.parametrize("damage", [shortened, flipped])
@pytest.mark.parametrize("ending", ["json", "npz"])
def test_a_damaged_result_is_made_again(tmp_path: Path, ending: str, damage: Callable[[bytes], bytes]) -> None:
    log, store = tmp_path / "log", ResultStore(tmp_path / "tasks")
    task = square_task(4, log)
    run_tasks([task], store, LocalExecutor(1))
    file = next(store.folder.glob(f"*.{ending}"))
    file.write_bytes(damage(file.read_bytes()))
    assert [value["found"] for value in run_tasks([task], store, LocalExecutor(1))] == [16]
    assert runs(log) == ["4", "4"]
    run_tasks([task], store, LocalExecutor(1))
    assert runs(log) == ["4", "4"]


def test_a_folder_that_cannot_be_written_to_is_refused_before_anything_runs(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(BadInputError, match=r"file/study.*cannot be written to.*name another folder"):
        opened(tmp_path / "file" / "study", None, None)
    opened(tmp_path / "new", None, None)
    assert list((tmp_path / "new" / "tasks").iterdir()) == []


def test_a_task_that_needs_a_damaged_result_has_it_made_again_first(tmp_path: Path) -> None:
    log, store = tmp_path / "log", ResultStore(tmp_path / "tasks")
    base = square_task(4, log)
    run_tasks([base], store, LocalExecutor(1))
    file = next(store.folder.glob("*.npz"))
    file.write_bytes(flipped(file.read_bytes()))
    assert [value["found"] for value in run_tasks([square_task(5, log, needs=(base,))], store, LocalExecutor(1))] == [41]
    assert runs(log) == ["4", "4", "5"]


def test_a_result_damaged_after_it_was_looked_for_is_told_with_the_remedy(tmp_path: Path) -> None:
    store = ResultStore(tmp_path)
    store.save("k", Result({}, {"x": np.array([16])}), 0.0)
    file = tmp_path / "k.npz"
    file.write_bytes(flipped(file.read_bytes()))
    with pytest.raises(GhestError, match="run the same command again"):
        store.load("k")


@pytest.mark.parametrize("address", ["bogus", "node1:8786", "tcp://node1", "tcp://node1:port"])
def test_what_is_no_address_of_a_scheduler_is_refused_at_once(address: str) -> None:
    with pytest.raises(BadInputError, match=r"protocol, host and port, such as tcp://"):
        ClusterExecutor(address)  # whether there is anything to run or all results are there already


def test_without_a_scheduler_the_address_is_told(tmp_path: Path) -> None:
    executor = ClusterExecutor("tcp://127.0.0.1:1", connect_s=0.5)
    with pytest.raises(BadInputError, match="no Dask scheduler answers"):
        run_tasks([square_task(1, tmp_path / "log")], ResultStore(tmp_path / "tasks"), executor)
