"""Inner functions that count no references call none of numba's array functions.

numba compiles such a function, ``values.max()`` say, with the options of who calls it first, and
refuses to without counted references. Whether that shows depends on which loops were compiled
before in the same process.
"""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "objstate"
MODULES = [path for path in sorted(PACKAGE.rglob("*.py")) if "inner(" in path.read_text("utf-8")]
# "mean" isn't one: it makes no array on the way
METHODS = {"max", "min", "sum", "argmax", "argmin", "argsort", "sort", "any", "all", "dot"}
FUNCTIONS = METHODS | {"median", "cumsum", "searchsorted", "diff", "unique", "where", "prod"}


def uncounted(module: ast.Module) -> set[str]:
    """Names of the module's decorators that count no references."""
    found = set()
    for node in module.body:
        match node:
            case ast.Assign(
                targets=[ast.Name(id=name)], value=ast.Call(func=ast.Name(id="inner")) as call
            ) if not any(each.arg == "makes_arrays" for each in call.keywords):
                found.add(name)
    return found


def array_calls(function: ast.FunctionDef) -> list[str]:
    """Calls of array methods, and of NumPy's functions of whole arrays."""
    found = []
    for node in ast.walk(function):
        match node:
            case ast.Call(func=ast.Attribute(value=ast.Name(id="np"), attr=attr)):
                found += [f"np.{attr}"] if attr in FUNCTIONS else []
            case ast.Call(func=ast.Attribute(attr=attr)) if attr in METHODS:
                found.append(f".{attr}()")
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_inner_functions_compile_whatever_was_compiled_before(path: Path) -> None:
    module = ast.parse(path.read_text("utf-8"))
    names = uncounted(module)
    for node in module.body:
        if isinstance(node, ast.FunctionDef) and any(
            isinstance(each, ast.Name) and each.id in names for each in node.decorator_list
        ):
            assert array_calls(node) == [], node.name
