"""F given by an expression, as sphere maps and kernels need it, and its pieces.

The kernels of the sphere map are written for a spline; here they run on the expression: the same code, with the
expression in the place of the spline's value and gradient, and a grid of one cell, the box, in its parameters.

A piece is what is left of an expression once every max, min and where has chosen.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from creeping._typing import FloatArray, IntArray
from scatterers.expression import NUMERIC, Differentiated, choosing, derivatives, differentiate, parse
from scatterers.kernels.compiled import Compiled, Kind


class Switches:
    """The choices in an expression, and its pieces as they are met.

    Parameters
    ----------
    text : str

    Examples
    --------
    >>> cut = Switches("max(x**2 + y**2 + z**2 - 1, z - 0.5)")
    >>> cut.met(np.array([[0, 0, -1.0], [0, 0, 0.5], [0, 1, 0]]))
    >>> cut.numbers(np.array([[0, 0.1, 0.5], [1, 0, 0]])), len(cut.pieces)
    (array([1, 0]), 2)
    """

    def __init__(self, text: str) -> None:
        import sympy

        self._text, self._expression = text, parse(text)
        known = self._expression.atoms(choosing().Largest, choosing().Chosen)
        self._switches = sorted(known, key=sympy.default_sort_key)
        self.pieces: list[Any] = []
        # number of the piece by the choices made
        self._known: dict[tuple[int, ...], int] = {}

    @property
    def any(self) -> bool:
        """Whether the expression has choices."""
        return bool(self._switches)

    @cached_property
    def _choices(self) -> Callable[..., Any]:
        """Function of x, y, z to the number of the choice of each switch."""
        import sympy

        names = [sympy.Symbol(name, real=True) for name in "xyz"]
        numbers = [switch.which for switch in self._switches]
        function: Callable[..., Any] = sympy.lambdify(names, numbers, [NUMERIC, "numpy"])
        return function

    def choices(self, points: FloatArray) -> IntArray:
        """Choice of each switch: points (n, 3), L, to (n, k)."""
        with np.errstate(all="ignore"):
            found = [np.broadcast_to(part, len(points)) for part in self._choices(*points.T)]
        return np.stack(found, axis=-1).astype(np.int64) if found else np.zeros((len(points), 0), dtype=np.int64)

    def met(self, points: FloatArray) -> None:
        """Take up the pieces at points (n, 3), L.

        Raises
        ------
        ValueError
            If there are too many.
        """
        self._meet(np.unique(self.choices(points), axis=0).tolist())

    def _meet(self, rows: Iterable[Iterable[int]]) -> None:
        for row in rows:
            made = tuple(row)
            if made in self._known:
                continue
            left = self._resolved(self._expression, dict(zip(self._switches, made, strict=True)))
            # a choice within what is not chosen makes no piece
            if left not in self.pieces:
                self.pieces.append(left)
            self._known[made] = self.pieces.index(left)
            if len(self.pieces) > 64:
                raise ValueError("the body has more than 64 pieces; give one of fewer")

    def _resolved(self, expression: Any, made: dict[Any, int]) -> Any:
        if expression in made:
            return self._resolved(expression.values[made[expression]], made)
        if not any(expression.has(switch) for switch in made):
            return expression
        return expression.func(*(self._resolved(part, made) for part in expression.args))

    def functions(self, number: int) -> Differentiated:
        """Functions of a piece."""
        return derivatives(self.pieces[number], self._text)

    def compiled(self, number: int) -> Compiled:
        """The compiled block evaluator of a piece."""
        import sympy

        piece = self.pieces[number]
        slopes = [piece.diff(sympy.Symbol(name, real=True)) for name in "xyz"]
        if all(slope.is_number for slope in slopes):
            # the many planes of a polytope share their code
            constant = piece.xreplace(dict.fromkeys(piece.free_symbols, sympy.S.Zero))
            return Compiled(plane, "level", np.array([*slopes, constant], dtype=float))
        block = self.functions(number).block
        made = next(made for made, k in self._known.items() if k == number)
        block.again = compiled_piece, self._text, made  # type: ignore[attr-defined]
        return Compiled(block, "level", np.zeros(1))

    def __reduce__(self) -> tuple[Callable[..., "Switches"], tuple[str, list[tuple[int, ...]]]]:
        return met_before, (self._text, list(self._known))

    def numbers(self, points: FloatArray) -> IntArray:
        """Numbers of the pieces at points (n, 3), L; where the choices are new, of the piece with the least |F|."""
        rows, where = np.unique(self.choices(points), axis=0, return_inverse=True)
        numbers = np.array([self._known.get(tuple(row), -1) for row in rows.tolist()], dtype=np.int64)
        found = numbers[where.reshape(-1)]
        if np.any(new := found < 0):
            x = points[new].T
            with np.errstate(all="ignore"):
                values = [np.broadcast_to(self.functions(k).value(*x)[0], x.shape[1]) for k in range(len(self.pieces))]
            found[new] = np.argmin(np.abs(np.nan_to_num(np.stack(values), nan=np.inf)), axis=0)
        return found


def met_before(text: str, choices: Iterable[Iterable[int]]) -> Switches:
    """The choices in an expression, and the pieces of those that were met, in this order."""
    found = Switches(text)
    found._meet(choices)
    return found


def plane(points: FloatArray, values: FloatArray, gradients: FloatArray, hessians: FloatArray, p: FloatArray) -> None:
    """Level evaluator of a plane, p its three slopes and its value at the origin."""
    for i in range(points.shape[1]):
        values[i] = p[0] * points[0, i] + p[1] * points[1, i] + p[2] * points[2, i] + p[3]
        for k in range(3):
            gradients[k, i] = p[k]
        for k in range(6):
            hessians[k, i] = 0.0


def compiled_piece(text: str, made: tuple[int, ...], kind: Kind, parameters: FloatArray) -> Compiled:
    """The compiled block evaluator of what an expression is by the choices made."""
    return met_before(text, [made]).compiled(0)


@dataclass(frozen=True, eq=False)
class ExpressionSpace:
    """F of an expression in a box; satisfies `scatterers.charts.star.SpaceLevel`.

    Attributes
    ----------
    expression : str
    box : (2, 3), L
    """

    expression: str
    box: FloatArray

    @property
    def functions(self) -> Differentiated:
        """The expression and its derivatives."""
        return differentiate(self.expression)

    def flat(self, of_map: FloatArray) -> FloatArray:
        """Parameters of the compiled functions: a grid of one cell and those of a map."""
        from scatterers.kernels.charts import one_cell

        return one_cell(self.box, of_map)

    @property
    def sources(self) -> dict[str, Callable[..., None]]:
        """Plain Python of the compiled functions."""
        return _sources(self.expression)


@lru_cache(maxsize=64)
def _sources(expression: str) -> dict[str, Callable[..., None]]:
    """The level and the sphere map's function on the expression, the same objects at every call."""
    from scatterers.kernels.charts import forward_over

    forward = forward_over(differentiate(expression).first, "expression")
    forward.again = compiled_forward, expression  # type: ignore[attr-defined]
    return {"level": differentiate(expression).block, "forward": forward}


def compiled_forward(expression: str, kind: Kind, parameters: FloatArray) -> Compiled:
    """The compiled sphere map's function on an expression."""
    return Compiled(_sources(expression)["forward"], kind, parameters)
