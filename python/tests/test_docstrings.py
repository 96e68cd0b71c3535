"""Tests that public docstrings describe every parameter of a public function, and that their examples run."""

from __future__ import annotations

import ast
import dataclasses
import doctest
import importlib.util
import inspect
import pkgutil
import re
import textwrap
from collections.abc import Iterator
from pathlib import Path

import pytest
import stretch_gap
import stretch_gap.mujoco  # the package mujoco itself is imported only when it is used
from stretch_gap import _stretch

PACKAGE = Path(stretch_gap.__file__).parent
MODULES = sorted(
    f"stretch_gap.{module.name}" for module in pkgutil.iter_modules([str(PACKAGE)]) if module.name not in ("__main__", "_stretch")
)
NATIVE = [
    name for name in stretch_gap.__all__ if name != "__version__" and getattr(stretch_gap, name) is getattr(_stretch, name, None)
]
"""Names of the native module. Their docstrings for editors and for the reference are in `_stretch.pyi`."""
STUB = {
    node.name: node
    for node in ast.parse((PACKAGE / "_stretch.pyi").read_text(encoding="utf-8")).body
    if isinstance(node, ast.ClassDef) and node.name in NATIVE
}


def public() -> Iterator[tuple[str, object]]:
    """Yield public classes and functions that are written in Python, with their names."""
    for module in (stretch_gap, stretch_gap.mujoco):
        for name in module.__all__:
            if name not in NATIVE and name != "__version__":
                yield f"{module.__name__}.{name}", getattr(module, name)


def functions() -> Iterator[tuple[str, object]]:
    """Yield public functions, and public methods of public classes, with their names."""
    for name, item in public():
        if inspect.isfunction(item):
            yield name, item
        elif inspect.isclass(item):
            for member, value in vars(item).items():
                value = value.__func__ if isinstance(value, (staticmethod, classmethod)) else value
                if inspect.isfunction(value) and not member.startswith("_"):
                    yield f"{name}.{member}", value


def described(docstring: str, *sections: str) -> dict[str, str]:
    """Return the names in sections of a numpydoc docstring, with their descriptions."""
    lines, found, names, inside = inspect.cleandoc(docstring).splitlines(), {}, [], False
    for line, below in zip(lines, [*lines[1:], ""]):
        if re.fullmatch(r"-{3,}", below):
            names, inside = [], line in sections
        elif inside and re.fullmatch(r"\*{0,2}\w+(, \*{0,2}\w+)* : \S.*", line):
            names = [name.lstrip("*") for name in line.split(" : ")[0].split(", ")]
            found.update(dict.fromkeys(names, ""))
        elif line.startswith("    "):
            found.update((name, found[name] + line.strip()) for name in names)
    return found


def missing(docstring: str, signature: list[str], *sections: str) -> list[str]:
    """Return the errors in the descriptions of parameters."""
    found = described(docstring, *sections)
    errors = [f"{name} is not described" for name in signature if not found.get(name)]
    return errors + [f"{name} is described, but is not a parameter" for name in found if name not in signature]


FUNCTIONS, PUBLIC = dict(functions()), dict(public())


def test_the_walk_finds_what_is_public():
    assert {"stretch_gap.diagnose", "stretch_gap.Diagnosis.plot", "stretch_gap.mujoco.Problem.diagnose"} <= set(FUNCTIONS)
    assert {"stretch_gap.Calibration.load", "stretch_gap.Calibration.from_json"} <= set(FUNCTIONS)
    assert set(NATIVE) == {"Reading", "Receptor", "Refused", "StretchError"}
    docstring = "Do it.\n\nParameters\n----------\na : int\n    One.\nb : int\n\nReturns\n-------\nint\n    A number."
    assert missing(docstring, ["a", "b", "c"], "Parameters") == ["b is not described", "c is not described"]
    assert missing(docstring, [], "Parameters")[0] == "a is described, but is not a parameter"


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_parameter_of_a_public_function_is_described(name):
    function = FUNCTIONS[name]
    assert function.__doc__, f"{name} has no docstring"
    first = inspect.cleandoc(function.__doc__).splitlines()[0]
    assert first[0].isupper() and first.endswith("."), f"{name}: the summary is {first!r}"
    parameters = [parameter for parameter in inspect.signature(function).parameters if parameter != "self"]
    assert missing(function.__doc__, parameters, "Parameters") == []


@pytest.mark.parametrize("name", [name for name, item in PUBLIC.items() if inspect.isclass(item)])
def test_classes_properties_and_fields_are_described(name):
    item = PUBLIC[name]
    # Python sets the docstring of a data class without one to its signature
    assert item.__doc__ and not item.__doc__.startswith(f"{item.__name__}("), f"{name} has no docstring"
    for member, value in vars(item).items():
        if isinstance(value, property):
            assert value.__doc__, f"{name}.{member} has no docstring"
    assert "Examples" in sections(item.__doc__), name
    if dataclasses.is_dataclass(item):
        fields = [field.name for field in dataclasses.fields(item) if not field.name.startswith("_")]
        assert missing(item.__doc__, fields, "Parameters", "Attributes") == []


def test_the_parameters_of_a_warning_are_described():
    parameters = [name for name in inspect.signature(stretch_gap.DoubtWarning.__init__).parameters if name != "self"]
    assert missing(stretch_gap.DoubtWarning.__doc__, parameters, "Parameters") == []


@pytest.mark.parametrize("name", NATIVE)
def test_the_stub_describes_what_is_native(name):
    described_class = STUB[name]
    assert inspect.cleandoc(getattr(stretch_gap, name).__doc__) == ast.get_docstring(described_class)
    for node in described_class.body:
        if isinstance(node, ast.FunctionDef):
            docstring = ast.get_docstring(node)
            assert docstring, f"{name}.{node.name} has no docstring"
            parameters = [argument.arg for argument in node.args.args if argument.arg != "self"]
            assert missing(docstring, parameters, "Parameters") == []
            # the stub and the module define the same names, and `help` shows the text of the stub
            assert inspect.cleandoc(getattr(getattr(stretch_gap, name), node.name).__doc__) == docstring
            is_property = any(isinstance(one, ast.Name) and one.id == "property" for one in node.decorator_list)
            is_none = isinstance(node.returns, ast.Constant) and node.returns.value is None
            wanted = {"Examples"} | (set() if is_none else {"Returns"})
            assert is_property or wanted <= set(sections(docstring)), node.name


OPTIONAL = {".plot(": "matplotlib", ".to_rerun(": "rerun"}
"""Calls in examples that need further packages."""


MODULE_NAMES = {name.rpartition(".")[2] for name in MODULES} | {"entries"}


def called(tree: ast.AST) -> set[str]:
    """Return the names of the functions that a function calls, and `raise` if it raises an error. Methods begin with a dot."""
    found = {"raise" for node in ast.walk(tree) if isinstance(node, ast.Raise)}
    for function in [node.func for node in ast.walk(tree) if isinstance(node, ast.Call)]:
        if isinstance(function, ast.Name):
            found.add(function.id)
        elif isinstance(function, ast.Attribute):
            is_of_module = isinstance(function.value, ast.Name) and function.value.id in MODULE_NAMES
            found.add(function.attr if is_of_module else f".{function.attr}")
    return found


def reaching(target: str) -> set[str]:
    """Return the names of the functions of the package that call `target`, directly or through other functions."""
    trees = [ast.parse(path.read_text(encoding="utf-8")) for path in PACKAGE.glob("*.py")]
    classes = [node for tree in trees for node in tree.body if isinstance(node, ast.ClassDef)]
    defined = [("", node) for tree in trees for node in tree.body] + [(".", node) for one in classes for node in one.body]
    functions = [(dot + node.name, called(node)) for dot, node in defined if isinstance(node, ast.FunctionDef)]
    found: set[str] = {target}
    while more := {name for name, calls in functions if calls & found} - found:
        found |= more
    return found


def sections(docstring: str) -> list[str]:
    """Return the headings of the sections of a numpydoc docstring. An underline is as long as its heading."""
    lines = inspect.cleandoc(docstring).splitlines()
    return [line for line, below in zip(lines, lines[1:]) if line and below == "-" * len(line)]


REACHING = {"Raises": reaching("raise"), "Warns": reaching("doubt")}
ORDER = ["Parameters", "Attributes", "Returns", "Raises", "Warns", "Examples"]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_section_of_a_public_function_is_there(name):
    function = FUNCTIONS[name]
    calls = called(ast.parse(textwrap.dedent(inspect.getsource(function))))
    returns = inspect.signature(function).return_annotation not in ("None", None)
    wanted = (
        {"Examples"} | ({"Returns"} if returns else set()) | {heading for heading, names in REACHING.items() if calls & names}
    )
    found = sections(function.__doc__)
    assert wanted <= set(found) and found == sorted(found, key=ORDER.index), (name, wanted, found)
    assert re.search(r"^Examples\n-{8}\n(.+\n)*\n*>>> ", inspect.cleandoc(function.__doc__), re.MULTILINE), name


def run_examples(tests):
    """Run examples in the order of their names. Examples of methods can use the names that the example of their class defines."""
    runner, names = doctest.DocTestRunner(), {}
    for test in tests:
        test.globs = {**test.globs, **names.get(test.name.rpartition(".")[0], {})}
        for example in test.examples:
            needed = [package for call, package in OPTIONAL.items() if call in example.source]
            if not all(map(importlib.util.find_spec, needed)):
                example.options[doctest.SKIP] = True
        runner.run(test, clear_globs=False)
        names[test.name] = test.globs
    assert not runner.failures


@pytest.mark.parametrize("name", ["stretch_gap", *MODULES])
def test_the_examples_run(name):
    if name == "stretch_gap.mujoco":
        pytest.importorskip("mujoco")
    run_examples(doctest.DocTestFinder().find(importlib.import_module(name)))


def test_the_examples_of_the_stub_run():
    nodes = [(name, node) for name, node in STUB.items()]
    nodes += [(f"{name}.{one.name}", one) for name, node in STUB.items() for one in node.body if isinstance(one, ast.FunctionDef)]
    parser = doctest.DocTestParser()
    run_examples([parser.get_doctest(ast.get_docstring(node) or "", {}, name, "_stretch.pyi", 0) for name, node in nodes])
