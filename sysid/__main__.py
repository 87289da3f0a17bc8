"""The command ``sysid`` where its script is not on the path: ``python -m sysid``."""

from sysid.workbench.cli import main

if __name__ == "__main__":
    main()
