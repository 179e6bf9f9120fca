"""What the site has beside the pages of docs/: README, changes and contributing as pages, the commands' help, the
reference of the public door; and what links to files of the repository that are no pages becomes their names."""

from __future__ import annotations

import argparse
import os
import posixpath
import re
import shutil
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

REPOSITORY = Path(__file__).parents[2]
PAGES = {"README.md": "index.md", "CHANGELOG.md": "changes.md", "CONTRIBUTING.md": "contributing.md",
         "SECURITY.md": "security.md"}  # fmt: skip
"""Files at the root, and the pages that they are."""

COMMANDS = {"cosim-master": "master", "cosim-fmus": "fmus", "cosim-gap": "gap", "cosim-study": "study"}
LINK = re.compile(r"(?<!!)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
REFERENCE = """# Python

What `import deepsea_cosim` gives; [From Python](python.md) shows it in use.

::: deepsea_cosim.functions
    options: {show_root_heading: false, show_root_toc_entry: false}

## Classes

::: deepsea_cosim.Session
    options: {heading_level: 3}

::: deepsea_cosim.master.simulation.stepped_run.SteppedRun
    options: {heading_level: 3}

::: deepsea_cosim.Result
    options: {heading_level: 3}

::: deepsea_cosim.Sweep
    options: {heading_level: 3}

::: deepsea_cosim.Diagnosed
    options: {heading_level: 3}

::: deepsea_cosim.Campaign
    options: {heading_level: 3}

::: deepsea_cosim.gym.CosimEnv
    options: {heading_level: 3}
"""


EXIT_CODES = """Every command ends with one of these:

| exit code | means |
| --- | --- |
| 0 | done; of `compare`: the same within the tolerance; of a sweep: failed cases are listed |
| 1 | a simulation had to stop (what was recorded is kept), every case of a sweep failed, a check found something \
wrong, `compare` found a difference |
| 2 | bad input: one line says what, where and what to do; nothing was computed, nothing earlier is lost |
| 130 | interrupted by Ctrl-C; what was done is kept |
| 143 | asked to end by SIGTERM; what was done is kept |
"""


def on_startup(**_: Any) -> None:
    """Copy the sources to where they are installed, for mkdocstrings does not know what pyproject.toml maps."""
    places = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["tool"]["setuptools"]["package-dir"]
    tree = REPOSITORY / "build" / "door"
    shutil.rmtree(tree, ignore_errors=True)
    for name, folder in places.items():
        target = tree / name.replace(".", "/")
        target.mkdir(parents=True, exist_ok=True)
        for path in (REPOSITORY / folder).glob("*.py"):
            shutil.copy(path, target)


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that are no files of docs/."""
    for source, page in PAGES.items():
        files.append(File.generated(config, page, content=_at_root((REPOSITORY / source).read_text("utf-8"))))
    files.append(File.generated(config, "commands.md", content="\n".join(_commands())))
    files.append(File.generated(config, "reference.md", content=REFERENCE))
    return files


def _at_root(text: str) -> str:
    """A file of the root with its links as from docs/."""

    def moved(link: re.Match[str]) -> str:
        target = link[2]
        if "://" in target or target.startswith("#"):
            return link[0]
        place, hash_, anchor = target.partition("#")
        place = PAGES.get(place, place.removeprefix("docs/") if place.startswith("docs/") else f"../{place}")
        return f"[{link[1]}]({place}{hash_}{anchor})"

    return LINK.sub(moved, text).replace("](docs/overview.svg)", "](overview.svg)")


def _commands() -> Iterator[str]:
    from importlib import import_module

    os.environ["COLUMNS"] = "100"
    yield f"# Commands\n\n{EXIT_CODES}"
    for name, package in COMMANDS.items():
        module = import_module(f"deepsea_cosim.{package}.cli")
        parser = module.parser()
        yield f"## {name}\n\n```text\n{parser.format_help()}```\n"
        for command, place in getattr(module, "COMMANDS", {}).items():  # words before which the parser is another
            inner = import_module(place, f"deepsea_cosim.{package}").parser()
            yield f"### {name} {command}\n\n```text\n{inner.format_help()}```\n"
        for action in parser._actions:
            if isinstance(action, argparse._SubParsersAction):
                for command, inner in action.choices.items():
                    yield f"### {name} {command}\n\n```text\n{inner.format_help()}```\n"


def on_page_markdown(markdown: str, page: Any, config: Any, files: Files) -> str:
    """Name files of the repository that are no pages; what is neither stays, and is told as broken."""
    here = posixpath.dirname(page.file.src_uri)

    def named(link: re.Match[str]) -> str:
        target = link[2].partition("#")[0]
        if not target or "://" in target:
            return link[0]
        place = posixpath.normpath(posixpath.join("docs", here, target))
        if place in PAGES:
            back = posixpath.relpath(PAGES[place], here or ".")
            return f"[{link[1]}]({back})"
        inside = place.removeprefix("docs/") if place.startswith("docs/") else None
        if (inside is not None and files.get_file_from_path(inside)) or not (REPOSITORY / place).exists():
            return link[0]
        return link[1] if f"`{place}`" == link[1] else f"{link[1]} (`{place}`)"

    return LINK.sub(named, markdown)
