#!/usr/bin/env python3
"""Runs the tutorials of docs/tutorials, each in a kernel of its own; a cell that fails fails the test.

  notebooks.py VDVR DOCUMENT    DOCUMENT lies in docs/, beside the tutorials
"""
import pathlib
import sys

import nbformat
from nbclient import NotebookClient

tutorials = pathlib.Path(sys.argv[2]).resolve().parent / "tutorials"
found = sorted(tutorials.glob("*.ipynb"))
assert len(found) >= 5, f"tutorials are missing: {found}"
for path in found:
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    assert not any(cell.get("outputs") for cell in notebook.cells), f"{path.name}: clear the outputs"
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tutorials)}}).execute()
    print(path.name, "runs")
