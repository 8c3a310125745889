"""Rules of the house that no other tool checks."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = sorted((ROOT / "gecar").rglob("*.py"))
TEXTS = [
    path
    for folder in ("gecar", "courses", "grammars", "benchmarks", "tests", "docs", ".github", ".ci")
    for path in sorted((ROOT / folder).rglob("*"))
    if path.is_file() and path.suffix in {".py", ".toml", ".bnf", ".md", ".yml", ".js", ""}
] + [
    ROOT / name
    for name in ("README.md", "CHANGELOG.md", "Makefile", "pyproject.toml")
    if (ROOT / name).exists()
]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())


def test_every_package_is_installed():
    found = {".".join(path.parent.relative_to(ROOT).parts) for path in SOURCES if path.name == "__init__.py"}
    assert set(PROJECT["tool"]["setuptools"]["packages"]) == found | {"gecar.courses", "gecar.grammars"}


def test_every_module_stands_in_a_room():
    contract = PROJECT["tool"]["importlinter"]["contracts"][0]
    rooms = {room.strip() for layer in contract["layers"] for room in layer.split("|")}
    tops = {f"gecar.{path.relative_to(ROOT / 'gecar').parts[0].removesuffix('.py')}" for path in SOURCES}
    assert tops - {"gecar.__init__"} == rooms


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_nothing_a_user_hands_over_is_executed(source):
    for node in ast.walk(ast.parse(source.read_text())):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id not in {"eval", "exec", "__import__"}, f"line {node.lineno}"
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        if source.name != "pickled.py":  # for worker processes of the same run, never for a file
            assert not {"pickle", "marshal", "shelve", "dill"} & set(names), f"line {node.lineno}"
        assert not any(k.arg == "shell" for k in getattr(node, "keywords", [])), f"line {node.lineno}"


def test_names_say_what_things_are():
    vague = {"params", "data", "utils", "util", "manager", "helper", "helpers", "misc", "model2"}
    named = [
        f"{path.relative_to(ROOT)}: {name}"
        for path in SOURCES
        for name in (
            path.stem,
            *(n.name for n in ast.walk(ast.parse(path.read_text())) if hasattr(n, "name") and n.name),
        )
        if vague & set(str(name).lower().split("_"))
    ]
    assert not named


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_texts_are_plain_and_name_no_machine(path):
    raw = path.read_bytes()
    assert b"\r" not in raw
    text = raw.decode()
    assert not re.search(r"(?<![\w.])/(?:work|root|home|Users)/(?!robot)\w", text)


def test_reads_of_the_readme_lead_somewhere():
    readme = (ROOT / "README.md").read_text()
    for link in re.findall(r"\]\((?!https?:|#)([^)#]+)", readme):
        assert (ROOT / link).exists(), link
    for place in re.findall(r"`((?:gecar|courses|grammars|benchmarks|docs|tests)/[\w./-]+)`", readme):
        assert (ROOT / place).exists(), place


def test_commands_in_the_documents_exist():
    from gecar.cli.application import COMMANDS

    known = {entry.name for entry in COMMANDS if entry.exists}
    targets = set(re.findall(r"(?m)^([a-z]+):", (ROOT / "Makefile").read_text()))
    for text in (
        (ROOT / "README.md").read_text(),
        *(path.read_text() for path in (ROOT / "docs").glob("*.md")),
    ):
        code = "\n".join(re.findall(r"(?s)```.*?```|`[^`]+`", text))
        assert set(re.findall(r"\bgecar ([a-z]+)", code)) <= known
        assert set(re.findall(r"\bmake ([a-z]+)\b", code)) <= targets
