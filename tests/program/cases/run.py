"""Runs one case on the program: run.py NAME VDVR FOLDER. The folder is made afresh."""
import importlib
import pathlib
import shutil
import sys

name, vdvr, folder = sys.argv[1:]
sys.path.insert(0, str(pathlib.Path(__file__).parent))
from support import Program  # noqa: E402

shutil.rmtree(folder, ignore_errors=True)
pathlib.Path(folder).mkdir(parents=True)
case = importlib.import_module(name)
case.make(pathlib.Path(folder))
program = Program(vdvr, folder)
case.check(program)
sys.exit(1 if program.failures else 0)
