"""Safe expressions in x, y, z: parsed by a whitelist, differentiated by sympy, compiled by numba.

The text is walked as a syntax tree and each allowed node is rebuilt as a sympy object, so nothing of the
text is ever executed; only code that sympy prints from that tree is. where(a < b, c, d) is c where a < b, else d;
max(a, b, ...) and min(a, b, ...) choose one, too. Derivatives are those of the piece that is chosen.

max(a, b) is Largest(a, b), min(a, b) is -Largest(-a, -b), and where(a < b, c, d) is Chosen(Which(a, b), d, c): Which is
the number of the largest, the first of equal ones, and Chosen(k, v_0, v_1, ...) is v_k. A derivative is that of what is
chosen. sympy's own Max and Min have derivatives with steps, and its Piecewise rewrites conditions that have other
pieces in them.
"""

import ast
import math
import operator
import re
from collections.abc import Callable
from functools import cache, lru_cache
from typing import Any, NamedTuple

import numpy as np

from creeping._typing import FloatArray
from scatterers.kernels.compiled import Compiled, Kind, helper

FUNCTIONS = ("sqrt", "exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh")
LARGEST, HUGEST = 1e12, 1e300
"""Of numbers, and of what several multiplied become."""


class Choosing(NamedTuple):
    """The sympy functions of this module."""

    Largest: Any
    Chosen: Any
    Which: Any


@cache
def choosing() -> Choosing:
    """Classes of the functions; sympy is imported at the first call."""
    import sympy

    class Which(sympy.Function):  # type: ignore[misc]
        """Number of the largest argument."""

        @classmethod
        def eval(cls, *keys: Any) -> Any:
            if all(key.is_number for key in keys):
                return sympy.Integer(largest([float(key) for key in keys]))
            return None

        def _pythoncode(self, printer: Any) -> str:
            return f"largest(({', '.join(f'float({printer.doprint(key)})' for key in self.args)}))"

    class Chosen(sympy.Function):  # type: ignore[misc]
        """The argument of this number."""

        @classmethod
        def eval(cls, which: Any, *values: Any) -> Any:
            if which.is_Integer:
                return values[int(which)]
            return values[0] if len(set(values)) == 1 else None

        @property
        def which(self) -> Any:
            return self.args[0]

        @property
        def values(self) -> tuple[Any, ...]:
            return tuple(self.args[1:])

        def _eval_derivative(self, symbol: Any) -> Any:
            return type(self)(self.which, *(value.diff(symbol) for value in self.values))

        def _pythoncode(self, printer: Any) -> str:
            which, *values = (f"({printer.doprint(part)})" for part in self.args)
            before = "".join(f"{value} if {which} == {k} else " for k, value in enumerate(values[:-1]))
            return f"({before}{values[-1]})"

    class Largest(sympy.Function):  # type: ignore[misc]
        """The largest argument."""

        @classmethod
        def eval(cls, *values: Any) -> Any:
            # as a tree, max in max would grow by a power of its depth
            flat = dict.fromkeys(part for one in values for part in (one.args if isinstance(one, cls) else (one,)))
            if all(value.is_number for value in flat):
                return sympy.Max(*flat)
            if len(flat) == 1:
                return next(iter(flat))
            return cls(*flat) if len(flat) < len(values) or any(isinstance(one, cls) for one in values) else None

        @property
        def which(self) -> Any:
            return Which(*self.args)

        @property
        def values(self) -> tuple[Any, ...]:
            return tuple(self.args)

        def _eval_derivative(self, symbol: Any) -> Any:
            return Chosen(self.which, *(value.diff(symbol) for value in self.values))

        def _pythoncode(self, printer: Any) -> str:
            return f"max({', '.join(printer.doprint(value) for value in self.args)})"

    return Choosing(Largest, Chosen, Which)


@helper
def largest(keys: Any) -> int:
    """Number of the largest, the first of equal ones."""
    found, most = 0, keys[0]
    for k in range(1, len(keys)):
        if keys[k] > most:
            found, most = k, keys[k]
    return found


def _stacked(*parts: Any) -> FloatArray:
    return np.stack(np.broadcast_arrays(*(np.asarray(part, dtype=float) for part in parts)))


def _chosen(*parts: Any) -> FloatArray:
    which, values = np.split(_stacked(*parts), [1])
    return np.asarray(np.take_along_axis(values, which.astype(np.int64), axis=0)[0])


NUMERIC: dict[str, Callable[..., Any]] = {
    "Which": lambda *parts: np.argmax(_stacked(*parts), axis=0),
    "Largest": lambda *parts: np.max(_stacked(*parts), axis=0),
    "Chosen": _chosen,
}
"""The functions of arrays that broadcast, by name."""


class Differentiated(NamedTuple):
    """Functions made from one expression.

    Attributes
    ----------
    value : callable
        numpy function of x, y, z that returns a list of one array.
    block : callable
        Plain Python of the block evaluator; see `scatterers.kernels.compiled.Compiled`.
    first : callable
        Plain Python of (x, y, z, parameters) to the value and the three slopes; parameters are not used.
    """

    value: Callable[..., Any]
    block: Callable[..., None]
    first: Callable[..., tuple[float, float, float, float]]


def parse(text: str) -> Any:
    """Turn the text into a sympy expression of x, y, z.

    Raises
    ------
    ValueError
        If the text is none, empty, too long, not an expression, or contains anything that is not on the whitelist.
    ModuleNotFoundError
        Without sympy.
    """
    if not isinstance(text, str):
        raise ValueError(f"expression {shown(text)} is not text; write one in x, y, z such as '1 + x'")
    if not text.strip():
        raise ValueError("the expression is empty; write one in x, y, z such as '1 + x'")
    if len(text) > 2000:
        raise ValueError(f"the expression has {len(text)} characters, more than 2000")
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise ValueError(f"expression {shown(text)} is not valid: {error}") from None
    try:
        import sympy
    except ModuleNotFoundError as error:
        words = f"an expression needs {error.name}: pip install 'creeping[expr]'"
        raise ModuleNotFoundError(words, name=error.name) from error
    names = {name: sympy.Symbol(name, real=True) for name in "xyz"} | {"pi": sympy.pi}

    def refuse(what: str) -> ValueError:
        allowed = f"numbers, x, y, z, pi, + - * / **, {', '.join(FUNCTIONS)}, max, min and where(x < 0, a, b)"
        return ValueError(f"expression {shown(text)} contains {what}; allowed are {allowed}")

    def require_moderate(value: Any) -> None:
        # functions of larger numbers, and towers of powers, would take sympy for ever
        if value.has(sympy.I, sympy.zoo, sympy.nan, sympy.oo, -sympy.oo):
            raise refuse("a value that is not real and finite")
        if value.is_number and not abs(value.evalf(15)) <= LARGEST:
            raise refuse(f"a number beyond {LARGEST:g}")

    def build(node: ast.expr, depth: int) -> Any:
        binary = {
            ast.Add: operator.add,
            ast.Sub: operator.sub,
            ast.Mult: operator.mul,
            ast.Div: operator.truediv,
            ast.Pow: operator.pow,
        }
        if depth > 120:
            raise refuse("more than 120 nested operations")
        match node:
            case ast.Constant(value=bool()):
                raise refuse(repr(node.value))
            case ast.Constant(value=int() | float() as number):
                if abs(number) > LARGEST:
                    raise refuse(f"the number {shown(number)}, beyond {LARGEST:g}")
                return sympy.Integer(number) if isinstance(number, int) else sympy.Float(number)
            case ast.Name(id=name) if name in names:
                return names[name]
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return -build(operand, depth + 1)
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return build(operand, depth + 1)
            case ast.BinOp(op=ast.BitXor()):
                raise ValueError(f"expression {shown(text)} contains ^, which is no power here; write x**2, not x^2")
            case ast.BinOp(left=left, op=op, right=right) if type(op) in binary:
                a, b = build(left, depth + 1), build(right, depth + 1)
                if isinstance(op, ast.Pow):
                    require_moderate(a)
                    require_moderate(b)
                    if not (b.is_number and abs(float(b)) <= 64):
                        raise refuse("a power that is not a number within +-64")
                    # before it is computed
                    most = LARGEST if a.is_number else HUGEST
                    factor = a if a.is_number else a.as_coeff_Mul()[0]
                    if abs(float(b)) * abs(math.log(abs(float(factor)) or 1.0)) > math.log(most):
                        raise refuse(f"a number beyond {most:g}")
                result = binary[type(op)](a, b)
                if result.has(sympy.zoo, sympy.nan, sympy.oo, -sympy.oo):
                    raise refuse("a division by zero")
                if abs(result.as_coeff_Mul()[0]) > HUGEST:
                    raise refuse(f"a number beyond {HUGEST:g}")
                return result
            case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in FUNCTIONS:
                given = build(argument, depth + 1)
                require_moderate(given)
                return getattr(sympy, name)(given)
            case ast.Call(func=ast.Name(id="max" | "min" as name), args=[_, _, *_] as given, keywords=[]):
                parts = [build(part, depth + 1) for part in given]
                for part in parts:
                    require_moderate(part)
                sign = 1 if name == "max" else -1
                return sign * choosing().Largest(*(sign * part for part in parts))
            case ast.Call(
                func=ast.Name(id="where"),
                args=[
                    ast.Compare(
                        left=left, ops=[ast.Lt() | ast.LtE() | ast.Gt() | ast.GtE() as op], comparators=[right]
                    ),
                    yes,
                    no,
                ],
                keywords=[],
            ):
                low, high = build(left, depth + 1), build(right, depth + 1)
                require_moderate(low)
                require_moderate(high)
                one, other = build(yes, depth + 1), build(no, depth + 1)
                if isinstance(op, ast.Gt | ast.LtE):
                    low, high = high, low
                if isinstance(op, ast.Lt | ast.Gt):
                    one, other = other, one
                return choosing().Chosen(choosing().Which(low, high), one, other)
        raise refuse(f"{ast.unparse(node)[:40]!r}")

    expression = build(tree.body, 0)
    if expression.has(sympy.I, sympy.zoo, sympy.nan, sympy.oo):
        raise refuse("a value that is not real and finite")
    return expression


def shown(what: Any) -> str:
    """Text as error messages quote it."""
    full = repr(what)
    return full if len(full) <= 80 else f"{full[:60]}... ({len(full)} characters)"


def differentiate(text: str) -> Differentiated:
    """Parse the text and make a numpy function of its value, and a block evaluator with gradient and Hessian.

    Raises
    ------
    ValueError
        As `parse`; if there is an absolute value in it, the root of a square, which has no second derivative; or if
        the derivatives are too large.
    """
    try:
        # what is no text may not be hashable either
        return _differentiated(text) if isinstance(text, str) else parse(text)
    except RecursionError:
        raise ValueError(f"expression {shown(text)} is nested too deeply; write it with fewer parentheses") from None


def _shared(parts: Any) -> Any:
    """Repeated subexpressions with their names, and the parts in terms of them.

    Not `sympy.cse`: it rewrites sums and products first, and in 1.14 it took a sum of exponents for a product.
    """
    import sympy
    from sympy.simplify.cse_main import tree_cse

    # twice, for they stand in every comparison of a choice
    numbers = 2 * sorted(set().union(*(part.atoms(choosing().Which) for part in parts)), key=sympy.default_sort_key)
    shared, reduced = tree_cse([*numbers, *parts], sympy.numbered_symbols("t"))
    return shared, reduced[len(numbers) :]


@lru_cache(maxsize=64)
def _differentiated(text: str) -> Differentiated:
    found = derivatives(parse(text), text)
    found.block.again = compiled_level, text  # type: ignore[attr-defined]
    return found


def compiled_level(text: str, kind: Kind, parameters: Any) -> Compiled:
    """The compiled block evaluator of an expression."""
    return Compiled(differentiate(text).block, kind, parameters)


@lru_cache(maxsize=256)
def derivatives(expression: Any, text: str) -> Differentiated:
    """Functions made from a sympy expression; errors name the text.

    Raises
    ------
    ValueError
        If there is an absolute value in it, or its derivatives are too large.
    """
    import sympy
    from sympy.printing.pycode import PythonCodePrinter

    # about twenty seconds of differentiating and compiling
    most = 20_000
    if (size := _size(expression)) > most:
        raise ValueError(
            f"the derivatives of expression {shown(text)} take about {size} operations, more than {most}; "
            "write it with fewer factors in a product and fewer functions of functions"
        )
    # whole numbers below stay such: those of their second derivatives still do for the compiler
    large = [one for one in expression.atoms(sympy.Rational) if max(abs(one.p), one.q) > 2**20]
    expression = expression.xreplace({one: sympy.Float(one) for one in large})
    x, y, z = (sympy.Symbol(name, real=True) for name in "xyz")
    gradient = [expression.diff(v) for v in (x, y, z)]
    pairs = [(x, x), (y, y), (z, z), (y, z), (x, z), (x, y)]
    hessian = [expression.diff(a, b) for a, b in pairs]
    if any(part.has(sympy.DiracDelta, sympy.Derivative) for part in hessian):
        corner = next((f"|{a.args[0]}|" for a in expression.atoms(sympy.Abs)), "a corner")
        raise ValueError(
            f"expression {shown(text)} contains {corner}, which is not smooth where it vanishes; write it without "
            "roots of squares, or with where(x < 0, a, b)"
        )

    shared, reduced = _shared([expression, *gradient, *hessian])
    printer = PythonCodePrinter({"fully_qualified_modules": True, "standard": "python3"})
    targets = ["values[i]", *(f"gradients[{k}, i]" for k in range(3)), *(f"hessians[{k}, i]" for k in range(6))]
    lines = [
        "def block(points, values, gradients, hessians, parameters):",
        "    for i in range(points.shape[1]):",
        "        x, y, z = points[0, i], points[1, i], points[2, i]",
        *(f"        {symbol} = {printer.doprint(part)}" for symbol, part in shared),
        *(f"        {target} = {printer.doprint(part)}" for target, part in zip(targets, reduced, strict=True)),
    ]
    # floating-point operations of printed code, about; see `scatterers.kernels.compiled.Compiled`
    text = "\n".join(lines)
    called = len(re.findall(rf"\b(?:{'|'.join(FUNCTIONS)})\(", text))
    # operations that a call of a function is worth
    operations = float(100 * called + len(re.findall(r" [+/-] |\*", text)))
    slopes, of_slopes = _shared([expression, *gradient])
    lines += [
        "def first(x, y, z, parameters):",
        *(f"    {symbol} = {printer.doprint(part)}" for symbol, part in slopes),
        f"    return {', '.join(f'1.0 * ({printer.doprint(part)})' for part in of_slopes)}",
    ]
    space: dict[str, Any] = {"math": math, "largest": largest}
    exec(compile("\n".join(lines), "<expression>", "exec"), space)  # printed by sympy, see the module's head
    space["block"].operations = operations

    value = sympy.lambdify((x, y, z), [expression], [NUMERIC, "numpy"], cse=_shared)
    return Differentiated(value, space["block"], space["first"])


def _size(expression: Any) -> int:
    """Operations of the slopes and the Hessian as sympy writes them, about."""

    def orders(part: Any) -> tuple[int, int]:
        """Those of a first and of a second derivative by one variable."""
        chooses = isinstance(part, (choosing().Largest, choosing().Chosen))
        below = [orders(one) for one in (part.values if chooses else part.args) if one.free_symbols]
        first, second, count = sum(one for one, _ in below), sum(two for _, two in below), len(below)
        if part.is_Add or chooses:
            return first, second
        # a function, or each factor and each two of them
        return first + count**2, second + 2 * count * first + count**3

    variables = len(expression.free_symbols)
    first, second = orders(expression)
    return variables * first + variables * (variables + 1) // 2 * second
