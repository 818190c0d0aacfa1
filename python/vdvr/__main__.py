"""The command `vdvr`, as `python -m vdvr`: the same program as without Python, on the drivers that Python finds."""

from __future__ import annotations

import sys

from . import _core
from ._devices import use_runtime_of_environment


def main() -> None:
    use_runtime_of_environment()
    sys.exit(_core.run_program(sys.argv[1:]))


if __name__ == "__main__":
    main()
