"""The same jobs on a Dask cluster, by its address."""

from __future__ import annotations

import pytest

from sysid.errors import ConfigError
from sysid.workbench.sweep.dask import DaskWorkers
from sysid.workbench.sweep.trial import Job, run_job
from tests.workbench.sweep.test_workers import bench, collect, job, without_clocks

distributed = pytest.importorskip("distributed")


def test_a_cluster_gives_what_this_process_would() -> None:
    jobs: list[Job] = [job(1), job(2), job(3)]
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": False, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster:
        crew = DaskWorkers(bench(), cluster.scheduler_address)
        try:
            assert crew.free >= 2
            for one in jobs:
                crew.submit(one, None)
            found = collect(crew, 3)
        finally:
            crew.close()
    for one in jobs:
        assert without_clocks(found[one.number]) == without_clocks(run_job(bench(), one, None))


def test_a_cluster_that_does_not_answer_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sysid.workbench.sweep.dask.CONNECT_S", 0.2)
    with pytest.raises(ConfigError, match="no Dask scheduler answers"):
        DaskWorkers(bench(), "tcp://127.0.0.1:9")
