"""The rules of the house: which room may know which, how large a file may be, what the wheel brings."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
import zipfile
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import grimp
import pytest

from sysid.lazy_names import imported_when_asked

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "sysid"
FILES = sorted(file for file in PACKAGE.rglob("*.py"))

FIELDS = {"airbrake", "rail"}
"""Rooms that know a field of application."""

ONLY_IN = {"mlflow": "workbench/tracking/mlflow_store.py", "optuna": "workbench/sweep/sampler.py"}
"""Packages that one file alone may import."""

HEAVY = ("scipy.signal", "scipy.stats", "scipy.optimize", "scipy.sparse", "pandas", "matplotlib", "mlflow", "torch")
"""What has tens of MB: rooms that a fit needs read it where it is used, and no earlier."""

FITTING = ("kernels", "equations", "models", "estimation", "composite", "validation")

BRAKE_WORDS = re.compile(r"brak|abdx|railway|wagon|locomotive|dissertation", re.IGNORECASE)

DIVIDED = re.compile(r"""["'\s]+""")
"""What may stand inside a word that is put together from several texts."""

NAMED_IN_HELP = {f"workbench/command_line/{room}.py": "service-brake" for room in ("models", "pipelines")}
"""A built-in pipeline is named in the examples of the help."""

MAX_LINES, MANY_LINES = 600, 400


@cache
def imports(file: Path) -> list[str]:
    """Full names of what a file imports, wherever in it."""
    found: list[str] = []
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file} imports relatively"
            found += [f"{node.module}.{alias.name}" for alias in node.names]
    return found


def name_of(file: Path) -> str:
    return file.relative_to(PACKAGE).as_posix()


def test_imports_point_one_way() -> None:
    """The contracts stand in pyproject.toml, under ``tool.importlinter``.

    In a process of its own: import-linter sets up logging anew, and would put every logger of this one to silence.
    """
    command = [Path(sys.executable).with_name("lint-imports"), "--no-cache"]
    told = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stdout + told.stderr


def test_no_module_imports_itself_by_a_detour() -> None:
    """Neither when it is imported nor when a function of it runs."""
    graph = grimp.build_graph("sysid", exclude_type_checking_imports=True, cache_dir=None)
    imported = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    TopologicalSorter(imported).prepare()  # says which modules, if any


@pytest.mark.parametrize("package", ONLY_IN)
def test_one_file_alone_imports(package: str) -> None:
    found = {name_of(file) for file in FILES if any(name.split(".")[0] == package for name in imports(file))}
    assert found <= {ONLY_IN[package]}


LAZY = [file for file in FILES if file.name == "__init__.py" and "imported_when_asked(" in file.read_text("utf-8")]
"""Packages whose public names are imported when they are asked for."""


@pytest.mark.parametrize("package", LAZY, ids=lambda file: file.parent.name)
def test_no_file_is_called_as_a_public_name_of_its_room(package: Path) -> None:
    """To import the file would put it in the place of the name, which is looked for only while it is not there."""
    _, names = imported_when_asked(str(package))
    assert {entry.stem for entry in package.parent.iterdir()} & set(names) == set()


def longer_than(limit: int) -> dict[str, int]:
    """Files with more lines than that, and their lines."""
    counted = {name_of(file): len(file.read_text(encoding="utf-8").splitlines()) for file in FILES}
    return {name: lines for name, lines in counted.items() if lines > limit}


def test_a_room_that_fits_loads_nothing_heavy() -> None:
    """What a fit then calls is held to it in ``tests/estimation/test_estimators.py``."""
    found = [
        f"{name_of(file)}: {name}"
        for file in FILES
        if name_of(file).split("/")[0] in FITTING
        for node in ast.parse(file.read_text(encoding="utf-8")).body
        for name in _read_by(node)
        if name.startswith(HEAVY)
    ]
    assert not found


def _read_by(node: ast.stmt) -> list[str]:
    if isinstance(node, ast.ImportFrom):
        return [f"{node.module}.{alias.name}" for alias in node.names]
    return [alias.name for alias in node.names] if isinstance(node, ast.Import) else []


def test_files_are_of_a_size_that_is_read() -> None:
    assert longer_than(MAX_LINES) == {}


def test_long_files_are_few() -> None:
    """More than a tenth of all files above 400 lines means that the rooms want dividing."""
    found = longer_than(MANY_LINES)
    print(f"files above {MANY_LINES} lines: {found}")  # noqa: T201 - shown by pytest -rP, and when this fails
    assert len(found) <= len(FILES) / 10


def code_of(file: Path) -> str:
    """A file without comments and docstrings: prose may take its examples from the first field."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [
                entry
                for entry in body
                if not (
                    isinstance(entry, ast.Expr)
                    and isinstance(entry.value, ast.Constant)
                    and isinstance(entry.value.value, str)
                )
            ] or [ast.Pass()]
    return ast.unparse(tree)


def brake_lines(file: Path) -> list[str]:
    """Lines of code that name a brake; to write code anew takes long, and few files have such a word even in prose."""
    if not BRAKE_WORDS.search(DIVIDED.sub("", file.read_text(encoding="utf-8"))):
        return []
    code = code_of(file).replace(NAMED_IN_HELP.get(name_of(file), "\0"), "")
    return [line.strip() for line in code.splitlines() if BRAKE_WORDS.search(line)]


def test_nobody_else_knows_what_a_brake_is() -> None:
    found = {name_of(file): brake_lines(file) for file in FILES if file.parts[len(PACKAGE.parts)] not in FIELDS}
    assert {name: lines for name, lines in found.items() if lines} == {}


def test_the_word_list_knows_a_brake_when_it_sees_one() -> None:
    assert brake_lines(PACKAGE / "airbrake" / "consist.py")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Names of the files in a wheel that was built just now."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    subprocess.run(command, check=True, capture_output=True)
    (file,) = folder.glob("*.whl")
    return zipfile.ZipFile(file).namelist()


def test_the_wheel_has_one_top_level_name(wheel: list[str]) -> None:
    tops = {name.split("/")[0] for name in wheel}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"sysid"}


def test_the_wheel_brings_the_content(wheel: list[str]) -> None:
    for folder in ("datasets", "pipelines"):
        for file in (ROOT / folder).rglob("*.yaml"):
            assert f"sysid/content/{file.relative_to(ROOT).as_posix()}" in wheel
    assert "sysid/workbench/template/pipelines/tank.yaml" in wheel
    assert "sysid/py.typed" in wheel


def test_entry_points_are_there() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    targets = [*project["scripts"].values(), *project["entry-points"]["sysid.generators"].values()]
    for target in targets:
        module, _, function = target.partition(":")
        file = ROOT / (module.replace(".", "/") + ".py")
        names = {node.name for node in ast.parse(file.read_text(encoding="utf-8")).body if hasattr(node, "name")}
        assert function in names
