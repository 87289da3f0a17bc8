"""The digest of code: what counts as a change of what a function runs, and what does not."""

from __future__ import annotations

import ast
import gc
import shutil
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

import sysid
from sysid import code_digest as module
from sysid.code_digest import code_digest, look_again, reached
from sysid.estimation import Training
from sysid.estimation.estimators import estimator_of
from sysid.models import ARX, NARX, AbstractStructure, Mapping, NeuralStateSpace, TransferFunction
from sysid.traces import Trace
from tests.traces.made import trace_of

PLANT = {
    "__init__.py": '''"""A plant."""
from plant.run import run
from plant.other import other

__all__ = ["run", "other"]
''',
    "run.py": '''"""Runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from numpy.linalg import solve

from plant import gains, valves
from plant.base import Base

if TYPE_CHECKING:
    from plant.kinds import Kind

LIMIT = 3.0


@dataclass
class Tank(Base):
    """A tank."""

    level: float = 0.0

    def step(self, inflow: float) -> float:
        """One step."""
        # Comment.
        self.level += gains.scale(inflow)
        return self.level

    def draw(self) -> str:
        return "tank"


def run(kind: Kind, n: int) -> float:
    """Runs."""
    from plant.late import late

    tank = Tank()
    total: float = 0.0
    for _ in range(n):
        total += tank.step(LIMIT) + solve([[1.0]], [1.0])[0] + late() + kind.factor
    return total


def idle() -> int:
    return 1
''',
    "base.py": "class Base:\n    pass\n",
    "gains.py": "def scale(x):\n    return 2.0 * x\n\n\ndef unused(x):\n    return x\n",
    "valves.py": "def valve():\n    return 1\n",
    "late.py": "def late():\n    return 0.5\n",
    "kinds.py": "class Kind:\n    factor = 1.0\n",
    "other.py": "def other():\n    return 1\n",
}


@pytest.fixture
def plant(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., str]:
    """Writes the package with some texts replaced, and takes the digest of what ``run`` runs."""
    monkeypatch.setattr(module, "_home", lambda top: tmp_path / top)
    number = iter(range(1_000))

    def digest(file: str = "", old: str = "", new: str = "", **more: str) -> str:
        files = {**PLANT, **{f"{name}.py": text for name, text in more.items()}}
        if file:
            assert old in files[file]
            files[file] = files[file].replace(old, new)
        shutil.rmtree(tmp_path / "plant", ignore_errors=True)
        for name, text in files.items():
            path = tmp_path / "plant" / name
            path.parent.mkdir(exist_ok=True)
            # The length differs, so that a file written in the same instant is read again.
            path.write_text(text + "#" * next(number) + "\n", encoding="utf-8")
        look_again()
        return code_digest("plant:run")

    return digest


WORDS = [
    pytest.param("run.py", '"""A tank."""', '"""A vessel, closed at the bottom."""', id="a docstring"),
    pytest.param("run.py", "# Comment.", "# Another comment.", id="a comment"),
    pytest.param("run.py", "total: float = 0.0", "total = 0.0", id="the annotation of a variable"),
    pytest.param("run.py", "n: int) -> float", "n: float) -> int", id="the annotations of a function"),
    pytest.param("run.py", "(inflow)\n", "(\n            inflow\n        )\n", id="the layout"),
    pytest.param("run.py", "    return 1\n", "    return 2\n", id="a function that nobody calls"),
    pytest.param("run.py", 'return "tank"', 'return "a tank"', id="a method that nobody calls"),
    pytest.param("gains.py", "    return x\n", "    return -x\n", id="a function of a module of which another is used"),
    pytest.param("valves.py", "return 1", "return 2", id="a module that is imported and not used"),
    pytest.param("other.py", "return 1", "return 2", id="what the package hands on beside it"),
    pytest.param("__init__.py", '"other"]', '"other", "Kind"]', id="__all__"),
]


@pytest.mark.parametrize(("file", "old", "new"), WORDS)
def test_words_are_no_change(plant: Callable[..., str], file: str, old: str, new: str) -> None:
    assert plant(file, old, new) == plant()


CODE = [
    pytest.param("run.py", "LIMIT = 3.0", "LIMIT = 3.5", id="a constant"),
    pytest.param("run.py", "level: float = 0.0", "level: float = 1.0", id="a default"),
    pytest.param("run.py", "level: float", "level: int", id="the type of a field"),
    pytest.param("run.py", "tank.step(LIMIT)", "tank.step(-LIMIT)", id="a line of it"),
    pytest.param("run.py", "return self.level", "return -self.level", id="a method that it calls"),
    pytest.param("gains.py", "2.0 * x", "2.5 * x", id="a function that a method calls"),
    pytest.param("late.py", "0.5", "0.6", id="what is imported in the function"),
    pytest.param("base.py", "pass", "size = 1", id="a base"),
    pytest.param("base.py", "pass", "def __post_init__(self): self.level = 1.0", id="what runs of itself"),
    pytest.param("kinds.py", "1.0", "2.0", id="what is passed in"),
    pytest.param("run.py", "from numpy.linalg", "from scipy.linalg", id="another library's function of the same name"),
    pytest.param("run.py", "import gains, valves", "import gains_2 as gains, valves", id="another of the same name"),
    pytest.param("run.py", "LIMIT = 3.0", "LIMIT = 3.0\nprint(1)", id="a statement that runs on import"),
    pytest.param("gains.py", "return 2.0 * x", "yield 2.0 * x", id="another statement with the same parts"),
]  # fmt: skip


@pytest.mark.parametrize(("file", "old", "new"), CODE)
def test_code_is_a_change(plant: Callable[..., str], file: str, old: str, new: str) -> None:
    other = {"gains_2": PLANT["gains.py"].replace("2.0", "3.0")}
    assert plant(file, old, new, **other) != plant(**other)


def test_a_moved_file_is_no_change(plant: Callable[..., str]) -> None:
    before = plant()
    moved = PLANT["run.py"].replace("import gains, valves", "import factors as gains")
    assert plant(run=moved, factors=PLANT["gains.py"], gains="") == before


def test_a_divided_module_is_no_change(plant: Callable[..., str]) -> None:
    before = plant()
    whole = PLANT["run.py"]
    head, rest = whole[: whole.index("LIMIT")], whole[whole.index("def run") :]
    tank = whole[whole.index("@data") : whole.index("def run")]
    assert plant(tanks=head + tank, run=head + "from plant.tanks import Tank\nLIMIT = 3.0\n" + rest) == before


def test_functions_of_the_same_words_are_told_apart_by_what_they_call(plant: Callable[..., str]) -> None:
    text = "from plant.{0} import value\ndef scale(x): return value() * x\n"
    values = {"one": "def value(): return 1\n", "two": "def value(): return 2\n"}
    both = "from plant.one import value as a\nfrom plant.two import value as b\ndef late(): return a() + b()\n"
    assert plant(gains=text.format("one"), late=both, **values) != plant(gains=text.format("two"), late=both, **values)


def test_what_is_left_out_is_not_followed(plant: Callable[..., str]) -> None:
    plant()
    everything = reached("plant:run")
    assert "plant.gains:scale" in everything
    assert reached("plant:run", without=("plant.gains",)) == everything - {"plant.gains:scale"}


def test_of_a_root_that_is_a_class_every_method_counts(plant: Callable[..., str]) -> None:
    plant()
    assert "plant.run:Tank.draw" in reached("plant.run:Tank")
    assert "plant.run:Tank.draw" not in reached("plant.run:Tank.step")


def test_of_this_package_it_is_kept_and_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def keep(home: Path, what: object, take: Callable[[], str]) -> str:
        asked.append((home, what))
        return take()

    look_again()
    taken = code_digest("sysid.units:convert")
    monkeypatch.setattr(module, "kept_or_taken", keep)
    look_again()
    assert code_digest("sysid.units:convert") == taken
    without = code_digest("sysid.units:convert", without=("sysid.errors",))
    files = code_digest("sysid.units:convert", files=("sysid/reporting/templates",))
    assert len({taken, without, files}) == 3
    assert {home for home, _ in asked} == {Path(sysid.__file__).parent}
    assert len({repr(what) for _, what in asked}) == 3


def test_of_another_package_none_is_kept(plant: Callable[..., str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "kept_or_taken", lambda *_: pytest.fail("kept"))  # it may be written by anybody
    assert plant()


def test_templates_count_where_they_are_named(plant: Callable[..., str], tmp_path: Path) -> None:
    plant()
    (tmp_path / "plant" / "templates").mkdir()
    page = tmp_path / "plant" / "templates" / "page.html"
    found = set()
    for text in ("a", "b"):
        page.write_text(text, encoding="utf-8")
        look_again()
        found |= {code_digest("plant:run", files=("plant/templates",)), code_digest("plant:run")}
    assert len(found) == 3


@pytest.mark.parametrize("address", ["plant.nothing:run", "plant:nothing", "plant.run:Tank.nothing", "nothing"])
def test_an_address_without_anything_there_is_an_error(plant: Callable[..., str], address: str) -> None:
    plant()
    with pytest.raises(LookupError, match="nothing"):
        code_digest(address)


def record(seed: int) -> Trace:
    """A tank that saturates."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(0.0, 2.0, 30), 10)
    y = np.zeros(len(u))
    for t in range(1, len(u)):
        y[t] = 0.9 * y[t - 1] + 0.1 * np.tanh(u[t - 1])
    return trace_of({"u": u, "y": y}, name=f"r{seed}", sample_time=0.1, units={"u": "V", "y": "m"})


TRACES = [record(1), record(2)]
MAPPING = Mapping.parse("u -> y")
OPTIONS = {"training": Training(max_iterations=3, workers=1), "selection": TRACES}
STRUCTURES: dict[str, tuple[AbstractStructure, dict[str, Any]]] = {
    "ARX": (ARX(na=1, nb=(1,), nk=(1,)), {}),
    "TransferFunction": (TransferFunction(poles=(1,), zeros=(0,), delays=(0,)), {}),
    "NARX": (NARX(input_delays=2, output_delays=2, neurons=2), OPTIONS),
    "NeuralStateSpace": (NeuralStateSpace(states=1, neurons=2), OPTIONS),
}


def functions_run(work: Callable[[], Any]) -> tuple[Any, set[str]]:
    """What some work returns, and the functions of the package that ran."""
    home, ran = str(Path(sysid.__file__).parent), set[str]()

    def watch(frame: FrameType, event: str, _: object) -> None:
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(home):
            name = Path(code.co_filename).relative_to(home.rpartition("/")[0]).with_suffix("").as_posix()
            ran.add(f"{name.replace('/', '.').removesuffix('.__init__')}:{code.co_qualname.partition('.<')[0]}")

    threading.setprofile(watch)
    sys.setprofile(watch)
    try:
        return work(), ran
    finally:
        sys.setprofile(None)
        threading.setprofile(None)  # type: ignore[arg-type]


def missed(ran: set[str], covered: set[str]) -> set[str]:
    """The functions that ran and are not covered; what runs of itself is part of its class."""
    of_class = {one for one in ran if one.endswith("_") and one.rpartition(".")[0] in covered}
    return {one for one in ran - covered - of_class if not one.endswith(">")}  # an import, a lambda in a constant


@pytest.mark.parametrize("kind", STRUCTURES)
def test_everything_that_a_fit_runs_is_covered(kind: str) -> None:
    structure, options = STRUCTURES[kind]
    roots = estimator_of(structure).runs
    fit, ran = functions_run(lambda: roots[0](TRACES, MAPPING, structure, **options))
    assert len(ran) > 20
    assert missed(ran, reached(*roots)) == set()
    assert fit.model.structure == structure


def test_a_kernel_concerns_the_fits_that_run_it() -> None:
    kernel = "sysid.kernels.cascade:go_on"
    concerned = {
        kind for kind, (structure, _) in STRUCTURES.items() if kernel in reached(*estimator_of(structure).runs)
    }
    assert "NARX" in concerned
    assert not {"ARX", "TransferFunction"} & concerned


@pytest.mark.parametrize("root", ["sysid.estimation:fit_narx", "sysid.export:export_bundle"])
def test_it_takes_little_more_than_to_parse_the_files(root: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "kept_or_taken", lambda _home, _asked, take: take())  # however often it is needed
    parsed, plain = list[float](), ast.parse

    def parse(*given: Any, **options: Any) -> Any:
        began = time.thread_time()
        tree = plain(*given, **options)
        parsed[-1] += time.thread_time() - began
        return tree

    monkeypatch.setattr(ast, "parse", parse)
    gc.collect()
    gc.freeze()  # what ten thousand tests have left in the process is not searched for garbage meanwhile
    ratios = [np.inf]
    try:
        while min(ratios) >= 4.0 and len(parsed) < 3:  # in the same breath on the same machine: a busy one slows both
            look_again()
            module.parsed.cache_clear()
            parsed.append(0.0)
            began = time.thread_time()  # nor counts what threads of other tests still do
            code_digest(root)
            ratios.append((time.thread_time() - began) / parsed[-1])
    finally:
        gc.unfreeze()
        monkeypatch.undo()
    assert min(ratios) < 4.0  # some 2.9
