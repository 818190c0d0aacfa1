#!/usr/bin/env python3
"""The shared library exports all that the programs use of it: they are linked with the static one in this build, and with the
shared one in Debian's packages (scripts/debian-packages), where a missing VDVR_API would end the link.

  exports.py NM LIBRARY.so OBJECT_OR_ARCHIVE...
"""
import subprocess
import sys


def names(nm, files, *options):
    said = subprocess.run([nm, "--format=posix", *options, *files], check=True, stdout=subprocess.PIPE, text=True).stdout
    return {fields[0] for fields in map(str.split, said.splitlines()) if len(fields) > 1}


nm, library, objects = sys.argv[1], sys.argv[2], sys.argv[3:]
exported = names(nm, [library], "--dynamic", "--defined-only")
ours = names(nm, objects, "--defined-only")
used = {name for name in names(nm, objects, "--undefined-only") if "4vdvr" in name} - ours
assert len(used) > 200, f"the programs use only {len(used)} names of the library: the check looks in the wrong place"
missing = sorted(used - exported)
assert not missing, "VDVR_API is missing at:\n" + subprocess.run(["c++filt"], input="\n".join(missing), text=True,
                                                                check=True, stdout=subprocess.PIPE).stdout
print(f"exports: all {len(used)} names that the programs use")
