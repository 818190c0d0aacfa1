"""Numbers measured on certified volumes, each as an interval that holds for F."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import _core
from ._choices import number, numbers
from ._scans import Scan

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

Range = Tuple[Optional[float], Optional[float]]


class Measured:
    """What a volume can be asked for beside values at points (docs/measure.md)."""

    _held: "_core.HeldVolume"

    def measure(
        self,
        *,
        above: Optional[float] = None,
        below: Optional[float] = None,
        between: Optional[Sequence[float]] = None,
        mean: bool = False,
        scan: Optional["Scan"] = None,
        extremes: bool = False,
        histogram: Union[int, "ArrayLike", None] = None,
        along: Optional[Sequence[Sequence[float]]] = None,
        samples: int = 257,
        roi: Optional[Sequence[float]] = None,
        cylinder: Optional[Sequence[float]] = None,
        ball: Optional[Sequence[float]] = None,
        mask: Optional["ArrayLike"] = None,
    ) -> Dict[str, Any]:
        """Intervals (lo, hi) that hold for every field within the bound, F among them.

        Parameters
        ----------
        above, below, between : one of them: `volume` where F is at least, at most, or between, and its `fraction`
            of the region.
        mean : `mean` of F, and its integral `mass`.
        scan : with mean, the projections that the volume was built from: `field_mean`, F's own by these alone, and its
            standard deviation `sigma`, an estimate, None where the scan's noise is not known.
        extremes : `least` and `largest` F.
        histogram : edges, or a number of bins from the least to the largest that F can be: `edges`, volumes `at_least`
            of {F >= edge} float64 [n, 2], and `within` two edges.
        along : two points: a profile `at` distances from the first with `value` float64 [n, 2]; with above or below,
            which then is the value that is looked for, `crossings` float64 [n, 2] and `runs` between them, `width` None
            where it cannot be told. The result is under "along".
        samples : of that profile.
        roi, cylinder, ball : x0, y0, z0, x1, y1, z1; x, y, z0, z1, radius of an upright one; x, y, z, radius. What is
            measured lies in all that are given, and in the covered region: `region` is its volume.
        mask : an array on the volume's grid, as `to_numpy()` has it: where the nearest sample is not 0.

        Raises
        ------
        InputError : nothing to measure, a region without points, a volume that was built with a window.
        """
        wanted = _range(above, below, between)
        measures = self._measures(roi, cylinder, ball, mask)
        out: Dict[str, Any] = {}
        if wanted and along is None:
            out.update(measures.volume(*wanted))
        if mean:
            out.update(measures.mean())
        if scan is not None:
            if not mean or not isinstance(scan, Scan):
                raise _core.InputError("scan: goes with mean=True, and is a vdvr.Scan, or what read_scan returns")
            out.update(measures.mean_of_scan(scan._core, scan._source, scan._understood))
        if extremes:
            out.update(measures.extremes())
        if histogram is not None:
            out.update(measures.distribution(_edges(measures, histogram)))
        if along is not None:
            if between is not None:
                raise _core.InputError("between: has two values; a line takes above or below")
            first, last = (list(numbers(p, 3, "along")) for p in along)
            out["along"] = measures.along(first, last, int(samples), above if above is not None else below)
        if not out:
            raise _core.InputError("nothing to measure: give above, below, between, mean, extremes, histogram or along")
        return out

    def components(
        self,
        *,
        above: Optional[float] = None,
        below: Optional[float] = None,
        between: Optional[Sequence[float]] = None,
        points: Optional["ArrayLike"] = None,
        least_volume: float = 0.0,
        roi: Optional[Sequence[float]] = None,
        cylinder: Optional[Sequence[float]] = None,
        ball: Optional[Sequence[float]] = None,
        mask: Optional["ArrayLike"] = None,
    ) -> Dict[str, Any]:
        """The parts of space where F is at least, at most or between: which must exist, and which may.

        `certain`: F has at least so many components. `possible`: so many places can hold any, and nothing connects
        two of them. A row for each, the largest first: `volume` float64 [n, 2] of what lies in it, `box` [n, 6],
        `sure_parts` [n], each surely connected, 0 where it may hold nothing; `spans` uint8 [n, 3]: 2 where a component
        of F surely reaches from the region's lower to its upper side along x, y, z, 1 where it may, 0 where none does.
        `points`, float64 [n, 3]: `possible_of_point` and `sure_of_point` number the place and the sure part of each, -1
        for none. Two points surely connect where `sure_of_point` is the same, and surely not where `possible_of_point`
        differs or is -1.
        """
        wanted = _range(above, below, between)
        if wanted is None:
            raise _core.InputError("components: of what? Give above, below or between")
        given = None
        if points is not None:
            given = np.ascontiguousarray(points, dtype=np.float64)
            if given.ndim != 2 or given.shape[1] != 3:
                raise _core.InputError(f"points: an array of shape {given.shape}; give [n, 3], x, y, z")
        return self._measures(roi, cylinder, ball, mask).components(*wanted, number(least_volume, "least_volume"), given)

    def _measures(
        self,
        roi: Optional[Sequence[float]],
        cylinder: Optional[Sequence[float]],
        ball: Optional[Sequence[float]],
        mask: Optional["ArrayLike"],
    ) -> "_core.Measures":
        box = None if roi is None else list(numbers(roi, 6, "roi"))
        rounds: List[List[float]] = []
        if cylinder is not None:
            x, y, low, high, radius = numbers(cylinder, 5, "cylinder")
            if not low < high:
                raise _core.InputError(f"cylinder: {low} is not below {high} along z")
            far = 1e300
            box = box or [-far, -far, -far, far, far, far]
            box[2], box[5] = max(box[2], low), min(box[5], high)
            rounds.append([x, y, 0, radius, 1])
        if ball is not None:
            rounds.append([*numbers(ball, 4, "ball"), 0])
        within = None if mask is None else np.ascontiguousarray(np.asarray(mask) != 0, dtype=np.uint8)
        if within is not None and within.ndim != 3:
            raise _core.InputError(f"mask: an array of shape {within.shape}; give [z, y, x], as to_numpy() has it")
        return _core.Measures(self._held, box, rounds, within)


def _range(
    above: Optional[float], below: Optional[float], between: Optional[Sequence[float]]
) -> Optional[Range]:
    if sum(given is not None for given in (above, below, between)) > 1:
        raise _core.InputError("above, below, between: give one of them; between takes two values")
    if above is not None:
        return number(above, "above"), None
    if below is not None:
        return None, number(below, "below")
    if between is not None:
        least, largest = numbers(between, 2, "between")
        return least, largest
    return None


def _edges(measures: "_core.Measures", histogram: Union[int, "ArrayLike"]) -> List[float]:
    if not isinstance(histogram, (int, np.integer)):
        return [number(edge, "histogram") for edge in np.ravel(np.asarray(histogram))]
    if histogram < 1:
        raise _core.InputError(f"histogram: {histogram} bins; give 1 or more")
    ends = measures.extremes()
    return list(np.linspace(ends["least"][0], ends["largest"][1], int(histogram) + 1))
