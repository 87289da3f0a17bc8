"""Where things are kept by who has no home, and has not installed the package."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import numba
import pytest

from sysid.ingest.datasets.cache import default_cache_folder
from sysid.own_folders import keep_kernels_where_it_is_allowed, own_folder


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_the_folder_is_the_users_alone_and_the_same_again(temporary: Path) -> None:
    folder = own_folder("x")
    assert (folder.parent, own_folder("x")) == (temporary, folder)
    assert os.name == "nt" or folder.stat().st_mode & 0o077 == 0


@pytest.mark.skipif(os.name == "nt", reason="folders for temporary files are the user's own there")
def test_what_others_could_write_to_or_have_put_there_is_not_used(temporary: Path) -> None:
    folder = own_folder("x")
    folder.chmod(0o777)
    other = own_folder("x")
    assert other != folder
    (temporary / f"sysid-y-{os.getuid()}").symlink_to(folder)
    (temporary / f"sysid-z-{os.getuid()}").touch()
    others = {other, own_folder("y"), own_folder("z")}
    assert folder not in others
    assert all(one.is_dir() and not one.is_symlink() and one.stat().st_mode & 0o077 == 0 for one in others)
    assert len(others) == 3


def test_where_numba_finds_no_folder_it_is_given_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Importing what computes had ended with: cannot cache function, no locator available."""
    monkeypatch.setattr(numba.config, "CACHE_LOCATOR_CLASSES", "ZipCacheLocator,UserProvidedCacheLocator")
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    monkeypatch.setenv("NUMBA_CACHE_DIR", "")
    keep_kernels_where_it_is_allowed.__wrapped__()
    assert numba.config.CACHE_DIR == os.environ["NUMBA_CACHE_DIR"] == str(own_folder("kernels"))

    @numba.njit(cache=True)
    def twice(x: float) -> float:
        return 2.0 * x

    assert twice(1.5) == 3.0
    assert list(own_folder("kernels").rglob("*.nbi"))


def test_what_has_a_folder_keeps_it(monkeypatch: pytest.MonkeyPatch, temporary: Path) -> None:
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(temporary / "chosen"))
    keep_kernels_where_it_is_allowed.__wrapped__()
    assert str(temporary / "chosen") == numba.config.CACHE_DIR


def test_who_has_no_home_has_a_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_home() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("SYSID_CACHE", raising=False)
    monkeypatch.setattr(Path, "home", no_home)
    assert default_cache_folder() == own_folder("cache")
