"""napari's reader of .vdvr files (napari.yaml): two image layers, V and what |V - F| is at most."""

from __future__ import annotations

import os
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Union

from ._volume import open as open_volume

Paths = Union[str, Sequence[str]]
Layers = List[Tuple[Any, Dict[str, Any], str]]


def napari_get_reader(path: Paths) -> Optional[Callable[[Paths], Layers]]:
    """What reads these paths; None where one is no .vdvr file."""
    paths = [path] if isinstance(path, str) else list(path)
    if not paths or not all(os.path.isfile(p) and str(p).endswith(".vdvr") for p in paths):
        return None
    return read


def read(path: Paths) -> Layers:
    """Layers of each file: [z, y, x] on the grid, in its unit of length; the bound is not shown at first.

    Raises
    ------
    MismatchError : the file was altered since it was certified.
    """
    layers: Layers = []
    for name in [path] if isinstance(path, str) else path:
        volume = open_volume(name)
        grid, stem = volume.grid, os.path.splitext(os.path.basename(name))[0]
        place = {"scale": tuple(grid.spacing[::-1]), "translate": tuple(grid.origin[::-1]),
                 "metadata": {"certificate": volume.certificate, "unit": grid.unit}}
        layers.append((volume.to_numpy(), {"name": stem, **place}, "image"))
        bound = {"name": f"{stem} bound", "colormap": "inferno", "visible": False, "blending": "additive",
                 "contrast_limits": (0.0, volume.epsilon_abs), **place}
        layers.append((volume.bound_to_numpy(), bound, "image"))
    return layers
