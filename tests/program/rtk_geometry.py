"""rtk_geometry.py VDVR: RTK's own matrices against those that vdvr reads from the file that RTK wrote; then RTK reads what
`vdvr convert-geometry` wrote. Needs itk-rtk and numpy."""
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import itk
import numpy as np
from itk import RTK as rtk

VIEWS, ROWS, COLUMNS = 9, 5, 7
ORIGIN, SPACING = np.array([-1.1, -0.9]), np.array([0.4, 0.3])
# Files of RTK have fifteen digits, and degrees where it computes with radians.
SAME = 1e-11


def geometry():
    """Every parameter away from its default in some view, in degrees and in radians."""
    g = rtk.ThreeDCircularProjectionGeometry.New()
    for k in range(VIEWS):
        angle = 360 * k / VIEWS
        if k % 3 == 0:
            g.AddProjectionInRadians(100, 150, math.radians(angle), 0.2, -0.1, math.radians(k), math.radians(-2), 0.3, -0.4)
        elif k % 3 == 1:
            g.AddProjection(100 + k, 150 - k, angle, 0.1 * k, 0.05, 1.5, -0.5 * k, 0.2, 0.1 * k)
        else:
            g.AddProjection(100, 150, angle)
    return g


def matrices(g):
    return np.array([itk.array_from_matrix(g.GetMatrix(k)) for k in range(VIEWS)])


def in_our_terms(rtk_matrices, origin, spacing):
    """World to pixel, x = x, y = -z, z = y, lambda = 1 at the isocentre."""
    m = rtk_matrices[:, :, [0, 2, 1, 3]] * [1, -1, 1, 1]
    for axis in range(2):
        m[:, axis] = (m[:, axis] - origin[axis] * m[:, 2]) / spacing[axis]
    return m / m[:, 2:, 3:]


def write_stack(path, origin, spacing):
    fields = {"ObjectType": "Image", "NDims": 3, "BinaryData": "True", "BinaryDataByteOrderMSB": "False",
              "Offset": f"{origin[0]:.17g} {origin[1]:.17g} 0", "ElementSpacing": f"{spacing[0]:.17g} {spacing[1]:.17g} 1",
              "DimSize": f"{COLUMNS} {ROWS} {VIEWS}", "ElementType": "MET_FLOAT", "ElementDataFile": "LOCAL"}
    header = "".join(f"{key} = {value}\n" for key, value in fields.items())
    path.write_bytes(header.encode() + np.zeros((VIEWS, ROWS, COLUMNS), "<f4").tobytes())


def run(*words):
    return json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)


def require_same(a, b, what):
    scale = np.abs(a).max(axis=2, keepdims=True)
    worst = (np.abs(a - b) / scale).max()
    print(f"{what}: largest difference {worst:.2g} of a row's largest entry")
    if not worst <= SAME:
        sys.exit(f"{what} differ")


def main():
    vdvr = sys.argv[1]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        g = geometry()
        writer = rtk.ThreeDCircularProjectionGeometryXMLFileWriter.New()
        writer.SetFilename(str(folder / "geometry.xml"))
        writer.SetObject(g)
        writer.WriteFile()
        write_stack(folder / "stack.mha", ORIGIN, SPACING)
        (folder / "scan.json").write_text(json.dumps({"projections": "stack.mha", "description": "line integrals",
                                                      "rtk_geometry": "geometry.xml", "redundancy": "full-turn"}))
        theirs = in_our_terms(matrices(g), ORIGIN, SPACING)
        ours = np.array(run(vdvr, "info", str(folder), "--json")["cone"]["matrices"])
        require_same(theirs, ours, "matrices that RTK wrote and that vdvr reads")

        made = run(vdvr, "convert-geometry", str(folder), "--pitch", f"{SPACING[0]},{SPACING[1]}", "-o",
                   str(folder / "back.xml"), "--json")
        reader = rtk.ThreeDCircularProjectionGeometryXMLFileReader.New()
        reader.SetFilename(str(folder / "back.xml"))
        reader.GenerateOutputInformation()
        back = in_our_terms(matrices(reader.GetOutputObject()), made["origin"], made["spacing"])
        require_same(ours, back, "matrices that vdvr wrote and that RTK reads")


main()
