"""A package whose names are imported when asked for has the names that type checkers are told of, and no others."""

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import sysid

ROOT = Path(sysid.__file__).parent
ROOMS = sorted(
    ".".join(file.parent.relative_to(ROOT.parent).parts)
    for file in ROOT.rglob("__init__.py")
    if "imported_when_asked" in file.read_text(encoding="utf-8")
)


def told(room: str) -> dict[str, str]:
    """Names by the modules that they are imported from under ``TYPE_CHECKING``."""
    tree = ast.parse(Path(str(importlib.import_module(room).__file__)).read_text(encoding="utf-8"))
    blocks = [node for node in tree.body if isinstance(node, ast.If)]
    lines = [line for block in blocks for line in block.body if isinstance(line, ast.ImportFrom)]
    return {name.name: str(line.module) for line in lines for name in line.names}


def test_there_are_such_rooms() -> None:
    assert {"sysid.estimation", "sysid.export", "sysid.reporting", "sysid.validation"} <= set(ROOMS)


@pytest.mark.parametrize("room", ROOMS)
def test_what_is_imported_when_asked_is_what_type_checkers_see(room: str) -> None:
    package = importlib.import_module(room)
    assert set(package.__all__) == set(told(room))
    for name, module in told(room).items():
        assert getattr(package, name) is getattr(importlib.import_module(module), name)


@pytest.mark.parametrize("room", ROOMS)
def test_another_name_is_refused_with_those_that_there_are(room: str) -> None:
    package = importlib.import_module(room)
    with pytest.raises(AttributeError, match=f"no public name 'nothing' here; there are .*{package.__all__[0]}"):
        package.__getattr__("nothing")


def test_every_room_is_there_once_the_package_is_imported() -> None:
    """The pages say sysid.validation.figures; whoever typed it was told that there is no such attribute."""
    asked = "import sysid; print(sysid.validation.figures.__name__, sysid.excitation.PRBS.__name__)"
    told = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert told.stdout.split() == ["figures", "PRBS"]
    with pytest.raises(AttributeError, match="no attribute 'valdation'"):
        _ = sysid.valdation
