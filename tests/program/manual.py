"""Man pages and bash completion against --help-all, which the same tables print: nothing may be missing from either.
--help tells of ten options at most. Examples hold options that are there, and man pages have them.

manual.py VDVR VDVR_PAPER MANUALS. Where mandoc or lexgrog is installed, every page passes it; bash completes.
"""

import gzip
import pathlib
import re
import shutil
import subprocess
import sys

vdvr, paper, manuals = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
failures = []


def expect(truth, what):
    if not truth:
        failures.append(what)


def said(*words):
    ended = subprocess.run(words, capture_output=True, text=True)
    expect(ended.returncode == 0 and not ended.stderr, f"{words}: {ended.returncode} {ended.stderr}")
    return ended.stdout


def options_of(text):
    """Every option that --help declares: those at the beginning of its lines."""
    found = re.findall(r"^  (?:-\w \[ )?(--[a-z-]+)", text, re.M)
    return found + re.findall(r"^  (-\w) \[ --", text, re.M)


def completed(program, *words):
    """What bash would offer for the last of the words."""
    script = (said(program, "--completion", "bash")
              + f"COMP_WORDS=({' '.join(repr(w) for w in ('x',) + words)})\nCOMP_CWORD={len(words)}\n"
              + f"_{pathlib.Path(program).name.replace('-', '_')}\n"
              + 'printf "%s\\n" "${COMPREPLY[@]}"\n')
    return said("bash", "-c", script).split()


commands = re.findall(r"^  ([a-z-]+) ", said(vdvr, "--help").split("commands:\n")[1], re.M)
expect(len(commands) >= 13, f"--help lists {commands}")
pages = {"vdvr": said(vdvr, "--man"), "vdvr-paper": said(paper, "--man")}
cases = {"bench": re.findall(r"(?:Cases: |\| )([a-z]+)", said(vdvr, "bench", "--help-all"))}
helps = {"vdvr-paper": [said(paper, "--help-all")]}
for command in commands:
    page = f"vdvr-{command}"
    pages[page] = said(vdvr, "--man", command)
    expect(page.replace("-", r"\-") in pages["vdvr"], f"vdvr(1) does not name {page}")
    helps[page] = ([said(vdvr, command, case, "--help-all") for case in cases[command]] if command in cases
                   else [said(vdvr, command, "--help-all")])
    expect(command in completed(vdvr, command[:3]), f"{command} is not completed")
    for help_text, case in zip(helps[page], cases.get(command, [None])):
        words = (command, case) if case else (command,)
        expect(set(options_of(help_text)) == set(completed(vdvr, *words, "-")), f"options of {words}")
    expect(sorted(cases.get(command, [])) == sorted(completed(vdvr, command, "") if command in cases else []),
           f"cases of {command}")
for page, texts in helps.items():
    for text in texts:
        expect(len(options_of(text)) >= 5, f"--help of {page} was not understood")
        for option in options_of(text):
            expect(option.replace("-", r"\-") + r"\fR" in pages[page], f"{page}(1) lacks {option}")

# --help: ten options at most, each as --help-all has it, and examples that the command's options allow.
for command in commands:
    shown = said(vdvr, command, "--help")
    known = {option for text in helps[f"vdvr-{command}"] for option in options_of(text)}
    named = {option for option in options_of(shown) if option.startswith("--")}
    expect(0 < len(named) <= 10, f"--help of {command} tells of {len(named)} options")
    expect(named <= known, f"--help of {command} tells of {named - known}")
    examples = re.findall(rf"^  (vdvr {command} .*)$", shown, re.M)
    expect(len(examples) >= 1, f"{command} has no example")
    for example in examples:
        for option in re.findall(r" (--?[a-z-]+)", example):
            expect(option in known, f"example of {command}: {option}")
        expect(example.replace("-", r"\-") in pages[f"vdvr-{command}"], f"vdvr-{command}(1) lacks {example}")

expect(set(options_of(helps["vdvr-paper"][0])) == set(completed(paper, "-")), "options of vdvr-paper")

# Choices, files, folders; an option's value after '=', which bash makes a word of.
expect(completed(vdvr, "build", "a.h5", "--storage", "") == ["auto", "f32", "u16", "u8"], "choices of --storage")
expect(completed(vdvr, "build", "--storage", "=", "f") == ["f32"], "--storage=f")
for hidden in ("--closing", "--coefficients", "--levels", "--terms", "--epsilon-of"):
    expect(hidden not in options_of(helps["vdvr-build"][0]), f"--help of build tells of {hidden}")
expect(completed(vdvr, "export", "--oversampling", "") == ["1", "2", "4", "8"], "numbers to choose from")
expect(completed(vdvr, "build", "--epsilon", "") == [], "a number has no completion")
expect(str(manuals) in completed(vdvr, "info", str(manuals)[:-1]), "a file is completed")
expect(completed(vdvr, "run", "-o", str(manuals)[:-1]) == [str(manuals)], "a folder is completed")
expect(completed(vdvr, "run", "-o", str(manuals / "writ")) == [], "a file is no folder")

# What is wrong is refused.
for words in (["--man", "nothing"], ["--completion", "fish"], ["--completion"]):
    ended = subprocess.run([vdvr, *words], capture_output=True, text=True)
    expect(ended.returncode == 2 and ended.stderr.count("\n") == 1 and not ended.stdout, f"{words}")

# What the build wrote for installation is these pages, but for their day.
written = {f.name.split(".1")[0]: f for f in (manuals / "man1").iterdir()}
expect(set(written) == set(pages), f"installed: {sorted(written)}")
for page, path in written.items():
    text = (gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()).decode("ascii")
    expect(text.split("\n")[1:] == pages[page].split("\n")[1:], f"{path} is of another build")
    for tool in (["mandoc", "-Tlint", "-Wwarning"], ["lexgrog"]):
        if shutil.which(tool[0]):
            plain = manuals / "tested.1"
            plain.write_text(text)
            ended = subprocess.run([*tool, str(plain)], capture_output=True, text=True)
            plain.unlink()
            expect(ended.returncode == 0, f"{tool[0]} on {page}: {ended.stdout} {ended.stderr}")
    if not shutil.which("mandoc") and page == "vdvr":
        print("mandoc is not installed; pages are not checked by it")

print("\n".join(failures) or f"{len(pages)} pages, {len(commands)} commands")
sys.exit(1 if failures else 0)
