"""``make bench``: which benchmarks there are; ``python -m tests.benchmarks training rail`` runs the named ones."""

from __future__ import annotations

import ast
import runpy
import sys
from pathlib import Path

HERE = Path(__file__).parent


def main(names: list[str]) -> int:
    """Run the named benchmarks, or list all."""
    known = {file.stem: file for file in sorted(HERE.glob("[a-z]*.py"))}
    strangers = sorted(set(names) - set(known))
    if strangers:
        print(f"no benchmark named {', '.join(strangers)}; there are {', '.join(known)}")
        return 2
    if not names:
        for name, file in known.items():
            print(
                f"{name:<20} {(ast.get_docstring(ast.parse(file.read_text(encoding='utf-8'))) or '').splitlines()[0]}"
            )
        print("\nrun one with: python -m tests.benchmarks NAME")
        return 0
    for name in names:
        sys.argv = [str(known[name]), *sys.argv[2:]] if len(names) == 1 else [str(known[name])]
        runpy.run_path(str(known[name]), run_name="__main__")
    return 0


if __name__ == "__main__":
    sys.exit(main([argument for argument in sys.argv[1:] if not argument.startswith("-")]))
