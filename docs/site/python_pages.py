"""The Python package's reference: its docstrings as a page of Markdown, without importing it."""

import ast
import inspect
import os

import api_pages

PACKAGE = "bindings/python/pbm"
PAGE = PACKAGE + "/reference.md"


def tree_of(module):
    with open(os.path.join(PACKAGE, module + ".py"), encoding="utf-8") as file:
        return ast.parse(file.read())


def prose(node):
    text = ast.get_docstring(node, clean=False)
    return api_pages.prose(inspect.cleandoc(text).split("\n")) if text else ""


def signature(node):
    """The lines of a declaration, as code: a class with its members that are not private, a function with its types."""
    if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
        result = " -> " + ast.unparse(node.returns) if node.returns else ""
        marks = ["@" + ast.unparse(mark) for mark in node.decorator_list]
        return marks + ["def %s(%s)%s" % (node.name, ast.unparse(node.args), result)]
    bases = ", ".join(map(ast.unparse, node.bases))
    members = [member for member in node.body if isinstance(member, ast.AnnAssign)]
    return ["class %s%s" % (node.name, "(%s)" % bases if bases else "")] + ["    " + ast.unparse(m) for m in members]


def declaration(node, level, owner=""):
    out = ["%s `%s` {#%s}" % ("#" * level, owner + node.name, owner + node.name), "```python", *signature(node), "```", "",
           prose(node), ""]
    if isinstance(node, ast.ClassDef):
        for member in node.body:
            if isinstance(member, ast.FunctionDef) and not member.name.startswith("_"):
                out += declaration(member, level + 1, node.name + ".")
    return out


def page():
    """What `import pbm` offers, in the order of its imports."""
    package = tree_of("__init__")
    out = ["# pbm for Python", "", prose(package), ""]
    for entry in package.body:
        if isinstance(entry, ast.ImportFrom) and entry.level == 1:
            found = {node.name: node for node in tree_of(entry.module).body if hasattr(node, "name")}
            for name in entry.names:
                out += declaration(found[name.name], 2)
        elif isinstance(entry, ast.FunctionDef) and not entry.name.startswith("_"):
            out += declaration(entry, 2)
    return "\n".join(out)
