"""RabbitCT's back-projection modules, from a folder that the caller names: nothing of them is kept here.

RabbitCT (Rohkohl et al., Medical Physics 36, 2009, 3940) gives a module one filtered projection I_n and one 3x4 matrix A_n at a
time; the module adds bilinear(I_n, A_n (x, y, z, 1)) / w_n^2 to every sample of a cube. Both published forms of the interface are
loaded through ctypes: the original (rabbitct.h: RCTLoadAlgorithm, RCTAlgorithmBackprojection once a view, RCTFinishAlgorithm,
RCTUnloadAlgorithm) and that of NHR@FAU (rabbitCt.h, MIT: lolaBunnyPrepare, -Backprojection once for all views, -Finish). Used by fdk."""
import ctypes
import os
import pathlib
import shutil
import subprocess
import time


class OriginalData(ctypes.Structure):
    """RabbitCtGlobalData of rabbitct.h."""
    _fields_ = [("L", ctypes.c_uint), ("S_x", ctypes.c_uint), ("S_y", ctypes.c_uint), ("A_n", ctypes.c_void_p),
                ("I_n", ctypes.c_void_p), ("R_L", ctypes.c_float), ("O_L", ctypes.c_float), ("f_L", ctypes.c_void_p),
                ("adv_numProjBuffers", ctypes.c_uint), ("adv_pProjBuffers", ctypes.c_void_p), ("adv_N", ctypes.c_uint),
                ("adv_projNumber", ctypes.c_uint), ("adv_ppProjMatrixBuffers", ctypes.c_void_p),
                ("adv_numAvailProjs", ctypes.c_uint), ("adv_firstProjOfSubset", ctypes.c_uint)]


class LaterProjection(ctypes.Structure):
    _fields_ = [("id", ctypes.c_int), ("matrix", ctypes.c_void_p), ("image", ctypes.c_void_p)]


class LaterData(ctypes.Structure):
    """RabbitCtGlobalData of rabbitCt.h."""
    _fields_ = [("problemSize", ctypes.c_uint32), ("imageWidth", ctypes.c_uint32), ("imageHeight", ctypes.c_uint32),
                ("voxelSize", ctypes.c_float), ("O_Index", ctypes.c_float), ("volumeData", ctypes.c_void_p),
                ("numberOfProjections", ctypes.c_uint32), ("globalGeometry", ctypes.c_void_p),
                ("projectionBuffer", ctypes.c_void_p), ("clipFilename", ctypes.c_char_p)]


def matrices(theta_rad, distance, size):
    """double [view][4][3], as A_n is stored: column by column. The detector stands at the axis, in pixels; w is 1 there."""
    import numpy
    c, s, middle = numpy.cos(theta_rad), numpy.sin(theta_rad), (size - 1) / 2
    zero, one = numpy.zeros_like(c), numpy.ones_like(c)
    w = numpy.stack([-s / distance, c / distance, zero, one], 1)
    u = numpy.stack([c, s, zero, zero], 1) + middle * w
    v = numpy.stack([zero, zero, one, zero], 1) + middle * w
    return numpy.ascontiguousarray(numpy.stack([u, v, w], 2), "f8")


def filtered(projections, distance):
    """float [view][v][u]: cosine, band-limited ramp along rows, pi / views. A full turn of equal steps (docs/geometry.md)."""
    import numpy
    views, rows, columns = projections.shape
    u, v = numpy.arange(columns) - (columns - 1) / 2, numpy.arange(rows) - (rows - 1) / 2
    cosine = distance / numpy.sqrt(distance ** 2 + u[None, :] ** 2 + v[:, None] ** 2)
    n = numpy.arange(-columns + 1, columns)
    ramp = numpy.where(n % 2 != 0, -1 / (numpy.pi * numpy.where(n == 0, 1, n)) ** 2, 0.0)
    ramp[columns - 1] = 0.25
    length = 4 * columns  # of a linear convolution, 3 columns - 2
    spectrum = numpy.fft.rfft(ramp, length)
    out = numpy.empty(projections.shape, "f4")
    for k in range(views):
        row = numpy.fft.irfft(numpy.fft.rfft(projections[k] * cosine, length, axis=1) * spectrum, length, axis=1)
        out[k] = row[:, columns - 1:2 * columns - 1] * (numpy.pi / views)
    return out


def find_one(folder, name):
    found = sorted(pathlib.Path(folder).rglob(name))
    if not found:
        raise FileNotFoundError(f"{folder}: holds no {name}")
    return found[0]


class Module:
    """A module NAME, compiled from the folder's NAME.cpp or NAME.c into `build`."""

    def __init__(self, folder, name, build):
        if not pathlib.Path(folder).is_dir():
            raise FileNotFoundError(f"{folder}: is no folder")
        self.name, self.original = name, bool(list(pathlib.Path(folder).rglob("rabbitct.h")))
        header = find_one(folder, "rabbitct.h" if self.original else "rabbitCt.h")
        source = find_one(folder, name + (".cpp" if self.original else ".c"))
        compiler = shutil.which("c++" if self.original else "cc")
        if compiler is None:
            raise FileNotFoundError("no compiler")
        library = os.path.join(build, name + ".so")
        made = subprocess.run([compiler, "-O3", "-march=native", "-fopenmp", "-shared", "-fPIC", f"-I{header.parent}", str(source),
                               "-o", library], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        if made.returncode != 0:
            raise RuntimeError(f"{source}: does not compile: {(made.stdout.strip().splitlines() or ['no message'])[-1]}")
        self.library = ctypes.CDLL(library)

    def _call(self, name, data):
        function = getattr(self.library, name)
        function.restype = ctypes.c_bool if self.original else ctypes.c_int
        function.argtypes = [ctypes.c_void_p]
        if not function(ctypes.addressof(data)):
            raise RuntimeError(f"{self.name}: {name} failed")

    def run(self, images, matrix):
        """(volume float [z][y][x], seconds of the back-projection alone) of float images[view][v][u], double matrix[view][4][3]."""
        return self._run_original(images, matrix) if self.original else self._run_later(images, matrix)

    def _run_original(self, images, matrix):
        import numpy
        views, rows, size = images.shape
        own = numpy.zeros((size, size, size), "f4")
        data = OriginalData(L=size, S_x=size, S_y=rows, R_L=1, O_L=-(size - 1) / 2, f_L=own.ctypes.data, adv_N=views,
                            adv_numProjBuffers=views, adv_numAvailProjs=views)
        table = (ctypes.c_void_p * views)(*[matrix[k].ctypes.data for k in range(views)])
        stack = (ctypes.c_void_p * views)(*[images[k].ctypes.data for k in range(views)])
        data.adv_ppProjMatrixBuffers = ctypes.addressof(table)
        data.adv_pProjBuffers = ctypes.addressof(stack)
        self._call("RCTLoadAlgorithm", data)  # may put its own volume into f_L
        seconds = 0.0
        for k in range(views):
            data.A_n, data.I_n, data.adv_projNumber, data.adv_firstProjOfSubset = table[k], stack[k], k, k == 0
            start = time.perf_counter()
            self._call("RCTAlgorithmBackprojection", data)
            seconds += time.perf_counter() - start
        start = time.perf_counter()
        self._call("RCTFinishAlgorithm", data)
        seconds += time.perf_counter() - start
        shape = ctypes.c_float * size ** 3
        out = numpy.array(numpy.ctypeslib.as_array(shape.from_address(data.f_L)).reshape(size, size, size))
        self._call("RCTUnloadAlgorithm", data)
        return out, seconds

    def _run_later(self, images, matrix):
        import numpy
        views, rows, size = images.shape
        out = numpy.zeros((size, size, size), "f4")
        stack = (LaterProjection * views)(*[LaterProjection(k, matrix[k].ctypes.data, images[k].ctypes.data) for k in range(views)])
        data = LaterData(problemSize=size, imageWidth=size, imageHeight=rows, voxelSize=1, O_Index=-(size - 1) / 2,
                         volumeData=out.ctypes.data, numberOfProjections=views, globalGeometry=matrix.ctypes.data,
                         projectionBuffer=ctypes.addressof(stack))
        stem = self.name[0].lower() + self.name[1:]
        self._call(stem + "Prepare", data)
        start = time.perf_counter()
        self._call(stem + "Backprojection", data)
        seconds = time.perf_counter() - start
        self._call(stem + "Finish", data)
        return out, seconds
