"""Settings that all tests share."""

import copy
import gc
import os
import shutil
import signal
from collections.abc import Callable, Iterator
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import settings
from xdist.scheduler import LoadFileScheduling, Scheduling

from sysid.names import visible
from sysid.reporting.charts import Chart
from sysid.workbench.fits import steps
from sysid.workbench.fits.config import PipelineConfig
from sysid.workbench.fits.data import Data
from sysid.workbench.tracking import mlflow_store

# An FMU for every desk is one compiler run a desk; the test of that asks for it.
os.environ.setdefault("SYSID_FMU_PLATFORMS", "own")

# Seeds are fixed, so that a failure is the same everywhere; machines that are busy are not slow code.
settings.register_profile("sysid", derandomize=True, deadline=None)
settings.load_profile("sysid")

# A shell that starts the tests in the background has them, and what they start, ignore Ctrl-C, which some tests press.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


TOGETHER = ("tests/browser/",)
"""Folders whose files stay in one process, with a run that takes a minute to prepare for all of them."""


class LoadFolderScheduling(LoadFileScheduling):
    """A file of tests stays in one process, and so do some folders."""

    def _split_scope(self, nodeid: str) -> str:
        folders = [folder for folder in TOGETHER if nodeid.startswith(folder)]
        return folders[0] if folders else super()._split_scope(nodeid)


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Scheduling | None:
    """In place of xdist's where the command line asks for files that stay together."""
    return LoadFolderScheduling(config, log) if config.getvalue("dist") == "loadfile" else None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with a test that takes long come first: begun last, one would keep a process busy while others wait."""
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in slow)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """What is imported and collected stays to the end: it is searched for garbage neither now nor at every test.

    A search of it all takes a second. What tests import themselves was searched often enough to take a tenth of the
    processor time of those of reports: garbage is looked for a thirtieth as often as is usual.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(20_000, 10, 50)
        gc.enable()


@pytest.fixture(autouse=True)
def no_store_of_an_earlier_test(monkeypatch: pytest.MonkeyPatch) -> None:
    """MLflow leaves the store that it was last told of in the environment."""
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)


@pytest.fixture(scope="session")
def blank_picture() -> Callable[..., str]:
    """In the place of a drawing: to draw takes longest, and most tests of a page are not of its pictures."""

    def blank(_: object, *, title: str, description: str, name: str) -> str:
        told = escape(visible(description, lines=True))
        words = f'<title id="{name}-title">{escape(visible(title))}</title><desc id="{name}-desc">{told}</desc>'
        return f'<svg role="img" aria-labelledby="{name}-title {name}-desc" viewBox="0 0 1 1">{words}</svg>'

    return blank


@pytest.fixture(scope="session")
def blank_chart() -> Callable[[Chart], None]:
    """In the place of what is drawn of a chart: axes alone take longer to make than most runs of these tests."""

    def blank(chart: Chart) -> None:
        assert all(np.shape(line.x) == np.shape(line.y) for line in chart.lines)

    return blank


@pytest.fixture
def undrawn(
    monkeypatch: pytest.MonkeyPatch, blank_picture: Callable[..., str], blank_chart: Callable[[Chart], None]
) -> None:
    """Pages with empty pictures."""
    monkeypatch.setattr("sysid.reporting.parts.svg", blank_picture)
    monkeypatch.setattr("sysid.reporting.charts.chart_figure", blank_chart)


@pytest.fixture(scope="session", autouse=True)
def looked_at_once() -> Iterator[None]:
    """Pipelines over the same traces share one first look at them: it depends on its key alone, and takes seconds."""
    found: dict[str, list[dict[str, Any]]] = {}
    look = steps.look

    def once(config: PipelineConfig, data: Data, *, suggest: bool = True) -> list[dict[str, Any]]:
        key = steps.advice_key(config, data, suggest=suggest)
        if key not in found:
            found[key] = look(config, data, suggest=suggest)
        return copy.deepcopy(found[key])

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(steps, "look", once)
        yield


@pytest.fixture(scope="session", autouse=True)
def tracking_store_made_once(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Runs of one process share the making of an empty MLflow store, which takes seconds, and get copies of it.

    Programs that tests start make theirs, and ``test_processes_may_touch_a_new_store_at_once`` looks at that.
    """
    make, made = mlflow_store._make_store, list[Path]()

    def copied(database: Path) -> None:
        if not made:
            first = tmp_path_factory.mktemp("store") / "mlflow.db"
            make(first)
            made.append(first)
        shutil.copyfile(made[0], database)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mlflow_store, "_make_store", copied)
        yield
