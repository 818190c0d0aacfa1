#!/usr/bin/env python3
"""Holds the order of rooms (docs/architecture.md): which file lies where, and who may include whom.

A file of host/ROOM is of that room; ROOM is WING/NAME, or the wing itself where both have one name. So is a public header,
include/vdvr/STEM.hpp, whose source is host/ROOM/STEM.cpp; of one without a source HOMES says the room. Kernels lie in the rooms
that launch them. A room includes its own files and those of rooms above it in ROOMS: this counts what
files of host/ include, and what public headers include. So no circle of headers runs through several rooms, and none may lie
within one. `verify` and `witness` include nothing of the rooms that make what they check, nor does any header that they
include.

Of kernels it holds what no compiler on a CPU does: masks are asked by device/masks.h alone, no constant is in double precision,
and local memory is an argument.

  rooms.py ROOT               one line per fault; exit 1 if there is any
  rooms.py ROOT --self-test   plants one fault of each kind in a copy and checks that it is found
"""
import pathlib
import re
import shutil
import sys
import tempfile

# A room includes those above it; a wing is the first part of a room's name, and its rooms stand together.
ROOMS = ["base/system", "base/opencl",
         "files/hdf5", "files/io",
         "scan/geometry", "scan/center", "scan/prepare", "scan/raw", "scan/open", "scan", "scan/simulate",
         "field/fbp", "field/fdk", "field/noise",
         "volume", "volume/sampler",
         "certify/bounds", "certify/kept", "certify/gold", "certify/crew", "certify/closing", "certify",
         "verify/claims", "verify/witness", "verify", "verify/residual", "verify/audit",
         "picture/render", "picture/rays", "picture/refine", "picture", "picture/pixel", "picture/live",
         "measure", "measure/picture", "export"]
MOST_ROOMS = 7
MOST_FILES = 25
# Of public headers without a source: the room that they are declared for.
HOMES = {
    "error": "base/system", "vdvr": "export", "api": "base/system", "progress": "base/system",
    "grid": "files/io",
    "preparation_steps": "scan/geometry",
    "understood": "scan/raw",
    "line_noise": "scan",
    "field_options": "field/fbp", "rates": "field/fbp",
    "common_memory": "certify/kept",
    "comparison": "certify/closing",
}
# They measure what the makers made, by means of their own.
CHECKERS = ["verify/witness", "verify"]
MAKERS = ["certify/bounds", "certify/kept", "certify/gold", "certify/crew", "certify/closing", "certify"]
# What kernels include: `shared` is compiled by the host too, `device` is not.
KERNEL_HEADERS = {"shared", "device"}
# Headers of declarations whose definitions are several files, or generated; of a public one those that lie in rooms below its
# own.
SEVERAL_SOURCES = {
    "include/vdvr/expert/reconstruct.hpp": ["host/field/fdk/reconstruct_scan.cpp"],  # of scans of either beam
    "host/base/opencl/state.hpp": ["device.cpp", "program.cpp", "pace.cpp"],
    "host/base/opencl/embedded.hpp": [],                          # embedded_kernels.cpp, made by CMake
    "host/picture/embedded_font.hpp": [],                    # embedded_font.cpp, made by CMake
    "host/base/opencl/device_end.hpp": ["device.cpp"],
}
# any() and all() are never true of one lane; devices without double precision warn of its constants.
MASK_HEADER = "masks.h"
BARE_QUESTION = re.compile(r"\b(any|all)\s*\(")
DOUBLE_CONSTANT = re.compile(r"(?<![\w.])(?:(?:\d+\.\d*|\.\d+)(?:[eE][+-]?\d+)?|\d+[eE][+-]?\d+|0x[\da-fA-F.]+p[+-]?\d+)(?![\w.])")
# PoCL 3.1 shares such an array among all groups (device/shared_column.h).
LOCAL_ARRAY = re.compile(r"\b__local\b[^;(){}*]*[;=\[]")
# Long launches are cut (host/base/opencl/pace.hpp), which work-items do not see as long as they ask for global places.
SCOPE_OR_TYPE = re.compile(r"^namespace ([\w:]*) ?\{|^\}  // namespace ?([\w:]*)|"
                           r"^(?:struct|class|enum class|enum) (?:VDVR_API )?(\w+)(?: final)?(?: :[^;{]*)?\s*\{", re.M)
# NVIDIA's compiler refuses them, as the standard does.
VARIADIC = re.compile(r"#\s*define\s+\w+\([^)\n]*\.\.\.\s*\)")
OF_THE_LAUNCH = re.compile(r"\bget_(?:group_id|num_groups|global_size|global_offset)\b")
INCLUDE = re.compile(r'^\s*#\s*include\s*(?:"([^"]+)"|<((?:vdvr|host|shared|device|apps|tests)/[^>]+)>)', re.M)


def includes(path):
    return [quoted or ours for quoted, ours in INCLUDE.findall(path.read_text(encoding="utf-8"))]


def files(folder, *suffixes):
    return sorted(p for p in folder.rglob("*") if p.suffix in suffixes) if folder.is_dir() else []


def room_files(root, room):
    folder = root / "host" / room
    return sorted(p for p in folder.iterdir() if p.suffix in (".hpp", ".cpp")) if folder.is_dir() else []


def sources_of(root, stem):
    """Where in the rooms a source of a public header's stem lies."""
    return sorted(s.relative_to(root).as_posix() for s in (root / "host").rglob(f"{stem}.cpp"))


def room_of(path):
    """Of a file, relative to the root: host/base/system/x.cpp is of base/system."""
    return path.rsplit("/", 1)[0].split("/", 1)[1]


def code_of(text):
    """Without comments, literals and preprocessor lines."""
    text = re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.S)
    text = re.sub(r'"(?:\\.|[^"\\\n])*"', '""', text)
    return re.sub(r"^\s*#(?:[^\n]*\\\n)*[^\n]*", "", text, flags=re.M)


def declares(text):
    """Whether a header declares a function that it does not define."""
    depth_of_body, statement = 0, ""
    open_scopes = []  # True: namespace, class or struct, whose declarations count; False: a body
    for c in code_of(text):
        if c == "{":
            scope = re.search(r"\b(namespace|class|struct|union|extern)\b[^;()]*$", statement) is not None
            open_scopes.append(scope)
            depth_of_body += not scope
            statement = ""
        elif c == "}":
            depth_of_body -= not open_scopes.pop()
            statement = ""
        elif c == ";" and depth_of_body == 0:
            is_function = re.search(r"\w\s*\([^()]*(?:\([^()]*\)[^()]*)*\)\s*(const|noexcept|override|\s)*$", statement)
            if is_function and not re.search(r"\b(using|friend|typedef|static_assert|return|inline constexpr)\b|[=]\s*\w*\s*\(",
                                             statement):
                return True
            statement = ""
        elif depth_of_body == 0:
            statement += c
    return False


class Headers:
    """Which room a header is of, and what it includes."""

    def __init__(self, root):
        self.root, self.room, self.sources, self.included = root, {}, {}, {}
        for path in files(root / "host", ".hpp"):
            name = path.relative_to(root).as_posix()
            self.add(path, name, room_of(name) if "/" in name[5:] else None)
        for path in files(root / "include", ".hpp"):
            found = sources_of(root, path.stem)
            self.sources[path] = found
            self.add(path, path.relative_to(root / "include").as_posix(),
                     room_of(found[0]) if found else HOMES.get(path.stem))

    def add(self, path, name, room):
        self.room[name] = room
        self.included[name] = includes(path)

    def is_below(self, name, room):
        """Whether a header is of a room below, or of none."""
        own = self.room.get(name)
        return own not in ROOMS or ROOMS.index(own) > ROOMS.index(room)

    def reached(self, names):
        """Each header that these are or include, with the headers that lead to it."""
        way = {name: [] for name in names if name in self.included}
        rest = list(way)
        while rest:
            name = rest.pop(0)
            for next_one in self.included[name]:
                if next_one in self.included and next_one not in way:
                    way[next_one] = way[name] + [name]
                    rest.append(next_one)
        return way


def faults_of_public_headers(headers):
    for path, sources in headers.sources.items():
        name, stem = path.relative_to(headers.root).as_posix(), path.stem
        public = path.relative_to(headers.root / "include").as_posix()
        room = headers.room[public]
        if len(sources) > 1:
            yield f"{name}: has sources in several rooms, {', '.join(sources)}"
        for source in SEVERAL_SOURCES.get(name, []):
            if not (headers.root / source).is_file():
                yield f"{name}: has no source, {source}"
        if sources and stem in HOMES:
            yield f"{name}: has a home in HOMES and a source, {sources[0]}"
        if room not in ROOMS:
            yield f"{name}: has no source, and HOMES names no room"
            continue
        for included in headers.included[public]:
            if included.startswith("vdvr/") and headers.is_below(included, room):
                yield f"{name}: is of {room} and includes {included}, which is below it"
    for stem in HOMES:
        if not any(path.stem == stem for path in headers.sources):
            yield f"include/vdvr/{stem}.hpp: is in HOMES and not there"


def faults_of_circles(headers):
    for name, included in headers.included.items():
        way = headers.reached(included).get(name)
        if way is not None:
            yield f"{name}: includes itself, by way of {', '.join(way) or name}"


def faults_of_checkers(root, headers):
    for room in CHECKERS:
        for path in room_files(root, room):
            for name, way in headers.reached(includes(path)).items():
                if headers.room[name] in MAKERS:
                    by_way = f", by way of {', '.join(way)}" if way else ""
                    yield f"{path.relative_to(root)}: includes {name}, which makes what {room} checks{by_way}"


def faults(root):
    host = root / "host"
    headers = Headers(root)
    for path in sorted(host.iterdir()):
        if path.is_file():
            yield f"{path.relative_to(root)}: lies loose in host/"
    for folder in sorted({p.parent for p in files(host, ".hpp", ".cpp")} - {host}):
        if folder.relative_to(host).as_posix() not in ROOMS:
            yield f"{folder.relative_to(root)}: is no room"
    wings = [room.split("/")[0] for room in ROOMS]
    for wing in dict.fromkeys(wings):
        if wings.count(wing) > MOST_ROOMS:
            yield f"host/{wing}: {wings.count(wing)} rooms, more than {MOST_ROOMS}"
    for room in ROOMS:
        found = room_files(root, room)
        if len(found) > MOST_FILES:
            yield f"host/{room}: {len(found)} files, more than {MOST_FILES}"
        for path in found:
            yield from faults_of_host_file(root, room, path, headers)
    yield from faults_of_public_headers(headers)
    yield from faults_of_circles(headers)
    yield from faults_of_checkers(root, headers)
    yield from faults_of_kernels(root)
    for path in files(root / "include", ".hpp"):
        for name in includes(path):
            if not name.startswith("vdvr/"):
                yield f"{path.relative_to(root)}: a public header includes {name}"
        if declares(path.read_text(encoding="utf-8")) and not sources_of(root, path.stem):
            yield f"{path.relative_to(root)}: no room has a source of its stem"
    for folder in ("apps", "examples"):
        for path in files(root / folder, ".hpp", ".cpp"):
            for name in includes(path):
                if name.split("/")[0] in ("host", "shared", "device", "tests"):
                    yield f"{path.relative_to(root)}: includes {name}, but only include/vdvr is public"
    yield from faults_of_names(root)
    for path in sorted((root / "tests").glob("*.[ch]pp")):
        yield f"{path.relative_to(root)}: lies loose in tests/"


def faults_of_names(root):
    """Types of one name in one namespace, in two headers: nothing tells where both are linked."""
    seen = {}
    for path in [p for folder in ("include", "host", "apps") for p in files(root / folder, ".hpp")]:
        scopes = []
        for found in SCOPE_OR_TYPE.finditer(path.read_text(encoding="utf-8")):
            opened, closed, name = found.groups()
            if opened is not None:
                scopes.append(opened)
            elif closed is not None:
                scopes = scopes[:-1]
            else:
                full = "::".join(scopes + [name])
                if seen.setdefault(full, path) != path:
                    yield f"{path.relative_to(root)}: {full} is another in {seen[full].relative_to(root)}"


def faults_of_host_file(root, room, path, headers):
    name = path.relative_to(root)
    for included in includes(path):
        parts = included.split("/")
        if parts[0] in ("host", "vdvr"):
            if headers.is_below(included, room):
                yield f"{name}: includes {included}, which is below it"
        elif parts[0] != "shared":
            yield f"{name}: includes {included}"
    if path.suffix == ".hpp" and declares(path.read_text(encoding="utf-8")):
        sources = SEVERAL_SOURCES.get(str(name), [path.with_suffix(".cpp").name])
        for source in sources:
            if not (path.parent / source).is_file():
                yield f"{name}: has no source of its stem, {source}"


def faults_of_kernels(root):
    kernels = root / "kernels"
    launches = {}
    for source in files(root / "host", ".cpp", ".hpp"):
        for program in re.findall(r'"(\w+(?:/\w+)+)"', source.read_text(encoding="utf-8")):
            launches.setdefault(program, []).append(source)
    for path in files(kernels, ".cl", ".h"):
        name, room = path.relative_to(root), path.parent.relative_to(kernels).as_posix()
        if room not in set(ROOMS) | KERNEL_HEADERS:
            yield f"{name}: lies in no room"
            continue
        if path.suffix == ".cl" and f"{room}/{path.stem}" not in launches:
            yield f"{name}: nobody builds the program {room}/{path.stem}"
        for source in launches.get(f"{room}/{path.stem}", []):
            if path.suffix == ".cl" and source.parent != root / "host" / room:
                yield f"{name}: is launched from another room, {source.relative_to(root)}"
        for included in includes(path):
            if included.split("/")[0] not in KERNEL_HEADERS:
                yield f"{name}: includes {included}"
            elif room == "shared" and not included.startswith("shared/"):
                yield f"{name}: the host would have to compile {included}"
        text = re.sub(r"//[^\n]*|/\*.*?\*/", "", path.read_text(encoding="utf-8"), flags=re.S)
        if path.name != MASK_HEADER and (found := BARE_QUESTION.search(text)):
            yield f"{name}: asks a mask by {found[1]}(), which is never true of one lane"
        if found := DOUBLE_CONSTANT.search(text):
            yield f"{name}: {found[0]} is in double precision"
        if found := LOCAL_ARRAY.search(text):
            yield f"{name}: {found[0]} is no argument"
        if found := OF_THE_LAUNCH.search(text):
            yield f"{name}: {found[0]} is of a launch, which may be a piece"
        if found := VARIADIC.search(text):
            yield f"{name}: `{found[0]}` takes any number of arguments, which no macro of OpenCL C may"


def plant(root, path, text):
    """And what takes it out again."""
    target = root / path
    before = target.read_text() if target.exists() else None
    new_folder = None if target.parent.exists() else target.parent
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text((before or "") + text)

    def take_out():
        if before is not None:
            target.write_text(before)
            return
        target.unlink()
        if new_folder:
            new_folder.rmdir()

    return take_out


FAULTS = [
    ("host/loose.hpp", "#pragma once\n", "lies loose in host/"),
    ("host/attic/x.hpp", "#pragma once\n", "is no room"),
    ("host/field/fbp/back_project.hpp", '#include "host/certify/gold/gold_settings.hpp"\n', "which is below it"),
    ("host/field/fbp/coverage.cpp", '#include "apps/vdvr/options.hpp"\n', "host/field/fbp/coverage.cpp: includes"),
    ("host/field/fbp/coverage.cpp", '#include "vdvr/expert/plan.hpp"\n', "includes vdvr/expert/plan.hpp, which is below it"),
    ("host/field/fbp/coverage.cpp", "#include <vdvr/expert/plan.hpp>\n", "includes vdvr/expert/plan.hpp, which is below it"),
    ("host/files/io/tiff.cpp", '#include "vdvr/expert/rates.hpp"\n', "includes vdvr/expert/rates.hpp, which is below it"),
    ("host/files/io/tiff.cpp", '#include "vdvr/nowhere.hpp"\n', "includes vdvr/nowhere.hpp, which is below it"),
    ("include/vdvr/expert/projections.hpp", '#include "vdvr/expert/certificate.hpp"\n', "includes vdvr/expert/certificate.hpp, which is below it"),
    ("include/vdvr/expert/grid.hpp", '#include "vdvr/expert/rates.hpp"\n', "includes vdvr/expert/rates.hpp, which is below it"),
    ("include/vdvr/homeless.hpp", "#pragma once\n", "HOMES names no room"),
    ("include/vdvr/api.hpp", '#include "vdvr/error.hpp"\n', "includes itself, by way of vdvr/error.hpp"),
    ("host/certify/gold/reconstruct.cpp", "\n", "has sources in several rooms"),
    ("host/field/fbp/rates.cpp", "\n", "has a home in HOMES and a source"),
    ("host/verify/verify.cpp", '#include "vdvr/expert/plan.hpp"\n', "verify.cpp: includes vdvr/expert/plan.hpp, which makes"),
    ("host/verify/verify.cpp", '#include "host/certify/forecaster.hpp"\n', "includes host/certify/forecaster.hpp, which makes"),
    ("host/verify/witness/field_bounds.hpp", '#include "host/certify/bounds/column_taps.hpp"\n', "field_bounds.hpp: includes host/certify/bounds/column_taps.hpp, which makes"),
    ("host/verify/claims/verify_terms.hpp", '#include "host/certify/crew/gold_rates.hpp"\n', "verify.cpp: includes host/certify/crew/gold_rates.hpp, which makes what verify checks, by way of host/verify/claims/verify_terms.hpp"),
    ("host/field/fbp/orphan.hpp", "#pragma once\nnamespace vdvr {\nint orphan(int x);\n}\n", "has no source of its stem"),
    ("include/vdvr/expert/grid.hpp", '#include "host/base/system/parallel.hpp"\n', "a public header includes"),
    ("include/vdvr/orphan.hpp", "#pragma once\nnamespace vdvr {\nint orphan(int x);\n}\n", "no room has a source of its stem"),
    ("apps/vdvr/x.cpp", '#include "host/base/system/parallel.hpp"\n', "only include/vdvr is public"),
    ("examples/x.cpp", '#include "shared/mixed_sampler.h"\n', "only include/vdvr is public"),
    ("tests/loose_test.cpp", "\n", "lies loose in tests/"),
    ("kernels/field/fbp/lonely.cl", "\n", "nobody builds the program"),
    ("kernels/loose.cl", "\n", "lies in no room"),
    ("kernels/shared/untested.h", '#include "device/lanes.h"\n', "the host would have to compile"),
    ("kernels/certify/gold/cell_test.cl", "int f(int4 m) { return any(m); }\n", "never true of one lane"),
    ("kernels/certify/kept/cone_nodes.cl", "float g(float x) { return x - (REAL)0.5; }\n", "is in double precision"),
    ("kernels/certify/kept/fourth_differences.cl", "__kernel void h() { __local float room[32]; }\n", "is no argument"),
    ("kernels/certify/kept/fourth_differences.cl", "__kernel void h() { int i = get_group_id(0); }\n", "may be a piece"),
    ("host/field/fbp/twice.hpp", "namespace vdvr {\nstruct Grid {\n};\n}  // namespace vdvr\n", "vdvr::Grid is another in"),
    ("kernels/certify/kept/cone_nodes.cl", "#define CALL(f, ...) f(__VA_ARGS__)\n", "which no macro of OpenCL C may"),
]


def self_test(root):
    missed = 0
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder) / "tree"
        for name in ("host", "include", "kernels", "apps", "examples", "tests"):
            if (root / name).is_dir():
                shutil.copytree(root / name, copy / name, ignore=shutil.ignore_patterns("*.png", "*.h5"))
        for path, text, expected in FAULTS:
            take_out = plant(copy, path, text)
            if not any(path.split("/")[-1] in f and expected in f or expected in f and "attic" in f for f in faults(copy)):
                print(f"planted in {path}, not found: {expected}")
                missed += 1
            take_out()
        for fault in set(faults(copy)) - set(faults(root)):
            print(f"left over of what was planted: {fault}")
            missed += 1
        for i in range(MOST_FILES + 1):
            plant(copy, f"host/field/fbp/many_{i}.hpp", "#pragma once\n")
        if not any("more than" in f for f in faults(copy)):
            print("a room of too many files, not found")
            missed += 1
    return missed


def main():
    root = pathlib.Path(sys.argv[1]).resolve()
    found = list(faults(root))
    for fault in found:
        print(fault)
    missed = self_test(root) if "--self-test" in sys.argv else 0
    return 1 if found or missed else 0


if __name__ == "__main__":
    sys.exit(main())
