"""Words of users as values of the library."""

from __future__ import annotations

import inspect
import math
import os
from typing import Any, Callable, Iterable, Optional, Sequence, Tuple, TypeVar, Union

from . import _core

#: A path to a file.
Path = Union[str, "os.PathLike[str]"]

_F = TypeVar("_F", bound=Callable[..., Any])


def takes(owner: Callable[..., Any]) -> Callable[[_F], _F]:
    """Gives a function that hands **keywords on to `owner` the names, defaults and words of these: OPTIONS in its own
    words stands for the owner's."""
    def with_keywords(function: _F) -> _F:
        own = [p for p in inspect.signature(function).parameters.values() if p.kind is not p.VAR_KEYWORD]
        theirs = [p for p in inspect.signature(owner).parameters.values() if p.kind is p.KEYWORD_ONLY]
        function.__signature__ = inspect.signature(function).replace(  # type: ignore[attr-defined]
            parameters=[*own, *theirs])
        words = inspect.getdoc(function) or ""
        function.__doc__ = words.replace("OPTIONS", (inspect.getdoc(owner) or "").strip())
        return function

    return with_keywords


def choice(kind: Any, word: Any, name: str) -> Any:
    """The value of an enumeration, or InputError with the words that there are."""
    try:
        return kind[word]
    except KeyError:
        words = ", ".join(kind.__members__)
        raise _core.InputError(f"{name}: '{word}' is none of {words}") from None


def number(value: Any, name: str) -> float:
    """A finite float, or InputError."""
    try:
        result = float(value)
    except (TypeError, ValueError):
        raise _core.InputError(f"{name}: {value!r} is not a number") from None
    if not math.isfinite(result):
        raise _core.InputError(f"{name}: {result} is not finite")
    return result


def numbers(values: Any, count: int, name: str) -> Tuple[float, ...]:
    """So many finite floats, or InputError."""
    try:
        items: Iterable[Any] = list(values)
    except TypeError:
        raise _core.InputError(f"{name}: {values!r} is not a sequence of {count} numbers") from None
    result = tuple(number(v, name) for v in items)
    if len(result) != count:
        raise _core.InputError(f"{name}: {len(result)} numbers, {count} are wanted")
    return result


def tolerance(
    epsilon: Union[str, float, None],
    epsilon_abs: Optional[float],
    photons: Optional[float] = None,
    sigma_p: Optional[float] = None,
) -> "_core.Asked":
    """From "3%", 0.03, "1sigma" or a density."""
    result = _core.Asked()
    if (epsilon is None) == (epsilon_abs is None):
        raise _core.InputError("give a tolerance: either epsilon='3%' (or '1sigma') or epsilon_abs in density units")
    if epsilon_abs is not None:
        result.absolute = number(epsilon_abs, "epsilon_abs")
        return result
    result.photons = None if photons is None else number(photons, "photons")
    result.sigma_p = None if sigma_p is None else number(sigma_p, "sigma_p")
    text = str(epsilon).strip()
    if text.endswith("sigma"):
        result.sigmas = number(text[: -len("sigma")], "epsilon")
        return result
    percent = text.endswith("%")
    fraction = number(text[:-1] if percent else text, "epsilon") / (100 if percent else 1)
    if not 0 < fraction <= 1:
        raise _core.InputError(f"epsilon: {epsilon} is not above 0 and at most 1; write '3%' or 0.03")
    result.relative = fraction
    return result


def sizes(size: Any, name: str = "size") -> Tuple[int, int]:
    """Width and height of a picture, pixels."""
    width, height = numbers(size, 2, name)
    if width != int(width) or height != int(height) or not (1 <= width <= 16384 and 1 <= height <= 16384):
        raise _core.InputError(f"{name}: {size}; a picture has 1 to 16384 pixels a side, (width, height)")
    return int(width), int(height)


def axis(word: Any) -> int:
    """0, 1, 2 of "x", "y", "z"."""
    if word not in ("x", "y", "z"):
        raise _core.InputError(f"slice_axis: {word!r} is none of x, y, z")
    return "xyz".index(word)


def spacings(spacing: Any) -> Optional[Sequence[float]]:
    """One length for all axes, or x, y, z."""
    if spacing is None:
        return None
    if isinstance(spacing, (int, float)):
        return [number(spacing, "spacing")] * 3
    return numbers(spacing, 3, "spacing")
