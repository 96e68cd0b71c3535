"""Runs the code cells of notebooks from top to bottom, as Jupyter would, without Jupyter.

python run_notebook.py quickstart.ipynb
"""

import ast
import json
import os
import sys


def run(path):
    """Runs all cells in one namespace, and prints the value of the last expression of each cell, as a notebook does."""
    with open(path, encoding="utf-8") as file:
        cells = [c for c in json.load(file)["cells"] if c["cell_type"] == "code"]
    names = {"__name__": "__main__"}
    sys.path.insert(0, os.path.dirname(os.path.abspath(path)))
    for number, cell in enumerate(cells, 1):
        tree = ast.parse("".join(cell["source"]), called(path, number))
        last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, called(path, number), "exec"), names)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), called(path, number), "eval"), names)
            show = getattr(value, "_repr_html_", None)
            if show is not None:
                html = show()
                assert html.startswith("<"), html[:80]
                print(f"[{type(value).__name__}: {len(html)} characters of HTML]")
            elif value is not None:
                print(value)
    print(f"{path}: {len(cells)} cells ran")


def called(path, number):
    return f"{path}, code cell {number}"


if __name__ == "__main__":
    for notebook in sys.argv[1:]:
        run(notebook)
