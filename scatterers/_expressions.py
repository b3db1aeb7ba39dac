"""Safe expressions in x, y, z: parsed by a whitelist, differentiated by sympy, compiled by numba.

The text is walked as a syntax tree and each allowed node is rebuilt as a sympy object, so nothing of the
text is ever executed; only code that sympy prints from that tree is.
"""

import ast
import math
import operator
from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

FUNCTIONS = ("sqrt", "exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh")
MAX_LENGTH = 2000
MAX_POWER = 64
MAX_DEPTH = 60
_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}


class Differentiated(NamedTuple):
    """Functions made from one expression.

    Attributes
    ----------
    value, gradient, hessian : callable
        numpy functions of x, y, z that return 1, 3 and 6 (xx, yy, zz, yz, xz, xy) arrays.
    block : callable
        Plain Python of the block evaluator; see `scatterers._compile.Compiled`.
    """

    value: Callable[..., Any]
    gradient: Callable[..., Any]
    hessian: Callable[..., Any]
    block: Callable[..., None]


def parse(text: str) -> Any:
    """Turn the text into a sympy expression of x, y, z.

    Raises
    ------
    ValueError
        If the text is empty, too long, not an expression, or contains anything that is not on the whitelist.
    """
    import sympy

    if not isinstance(text, str) or not text.strip():
        raise ValueError("the expression is empty; write one in x, y, z such as '1 + x'")
    if len(text) > MAX_LENGTH:
        raise ValueError(f"the expression has {len(text)} characters, more than {MAX_LENGTH}")
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise ValueError(f"expression {text!r} is not valid: {error}") from None
    names = {name: sympy.Symbol(name, real=True) for name in "xyz"} | {"pi": sympy.pi}

    def refuse(what: str) -> ValueError:
        allowed = f"numbers, x, y, z, pi, + - * / ** and {', '.join(FUNCTIONS)}"
        return ValueError(f"expression {text!r} contains {what}; allowed are {allowed}")

    def build(node: ast.expr, depth: int) -> Any:
        if depth > MAX_DEPTH:
            raise refuse(f"more than {MAX_DEPTH} nested operations")
        match node:
            case ast.Constant(value=bool()):
                raise refuse(repr(node.value))
            case ast.Constant(value=int() | float() as number):
                if abs(number) > 1e12:
                    raise refuse(f"the number {number!r}, beyond 1e12")
                return sympy.Integer(number) if isinstance(number, int) else sympy.Float(number)
            case ast.Name(id=name) if name in names:
                return names[name]
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return -build(operand, depth + 1)
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return build(operand, depth + 1)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
                a, b = build(left, depth + 1), build(right, depth + 1)
                if isinstance(op, ast.Pow):
                    if not (b.is_number and abs(float(b)) <= MAX_POWER):
                        raise refuse(f"a power that is not a number within +-{MAX_POWER}")
                    # a tower of powers of integers would otherwise grow without bound before it is refused
                    if a.is_number and abs(float(b)) * abs(math.log(abs(float(a)) or 1.0)) > math.log(1e12):
                        raise refuse("a number beyond 1e12")
                result = _BINARY[type(op)](a, b)
                if result.has(sympy.zoo, sympy.nan, sympy.oo, -sympy.oo):
                    raise refuse("a division by zero")
                return result
            case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in FUNCTIONS:
                return getattr(sympy, name)(build(argument, depth + 1))
        raise refuse(f"{ast.unparse(node)[:40]!r}")

    expression = build(tree.body, 0)
    if expression.has(sympy.I, sympy.zoo, sympy.nan, sympy.oo):
        raise refuse("a value that is not real and finite")
    return expression


@lru_cache(maxsize=64)
def differentiate(text: str) -> Differentiated:
    """Parse the text and make numpy functions and a block evaluator of its value, gradient and Hessian."""
    import sympy
    from sympy.printing.pycode import PythonCodePrinter

    expression = parse(text)
    x, y, z = (sympy.Symbol(name, real=True) for name in "xyz")
    gradient = [expression.diff(v) for v in (x, y, z)]
    pairs = [(x, x), (y, y), (z, z), (y, z), (x, z), (x, y)]
    hessian = [expression.diff(a, b) for a, b in pairs]

    shared, reduced = sympy.cse([expression, *gradient, *hessian], sympy.numbered_symbols("t"))
    printer = PythonCodePrinter({"fully_qualified_modules": True, "standard": "python3"})
    targets = ["values[i]", *(f"gradients[{k}, i]" for k in range(3)), *(f"hessians[{k}, i]" for k in range(6))]
    lines = [
        "def block(points, values, gradients, hessians, parameters):",
        "    for i in range(points.shape[1]):",
        "        x, y, z = points[0, i], points[1, i], points[2, i]",
        *(f"        {symbol} = {printer.doprint(part)}" for symbol, part in shared),
        *(f"        {target} = {printer.doprint(part)}" for target, part in zip(targets, reduced, strict=True)),
    ]
    space: dict[str, Any] = {"math": math}
    exec(compile("\n".join(lines), "<expression>", "exec"), space)  # printed by sympy, see the module's head

    def numeric(parts: list[Any]) -> Callable[..., Any]:
        function: Callable[..., Any] = sympy.lambdify((x, y, z), parts, "numpy", cse=True)
        return function

    return Differentiated(numeric([expression]), numeric(gradient), numeric(hessian), space["block"])
