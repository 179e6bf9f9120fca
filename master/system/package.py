"""A package as a network of components, unpacked into a folder of its own."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from ...core.errors import CosimError, UnknownNameError, did_you_mean
from ...ssp.model import Component
from ...ssp.network import flatten
from ...ssp.parameters import read_set
from ...ssp.reader import read
from ...ssp.wires import Network, Setting
from ..slaves.fmu import also_forget, describe
from .addresses import splits


def read_package(
    package: Path, stack: ExitStack, variant: str | None = None, wrong: list[str] | None = None
) -> Network:  # fmt: skip
    """The network of an SSP file, unpacked into a folder that lives as long as `stack`.

    With a list `wrong`, what is wrong with some of its parts goes there instead of being raised.
    """
    scratch = stack.enter_context(tempfile.TemporaryDirectory(prefix="cosim_", ignore_cleanup_errors=True))
    stack.callback(also_forget(Path(scratch)))
    return flatten(read(package, Path(scratch) / "ssp", variant, wrong), causality, wrong)


def causality(component: Component, name: str) -> str | None:
    """What a component's FMU says of a variable; None where it has no such variable or cannot be read."""
    try:
        variable = describe(component.name, component.source, library=False).variables.get(name)
    except CosimError:  # told where all FMUs are read
        return None
    return variable.causality if variable is not None else None


def with_parameters(network: Network, files: Iterable[Path]) -> Network:
    """The network with parameter sets (.ssv) of the user's, named like --set, which win over the package's bindings."""
    settings, given, remarks = list(network.settings), list(network.given), list(network.remarks)
    for file in files:
        for p in read_set(file, remarks.append):
            if p.name in network.inputs:
                given.append(Setting("", p.name, p.value, p.type, (), p.where))
                continue
            if network.connectors.get(p.name):
                settings += [Setting(c, v, p.value, p.type, h, p.where) for c, v, h in network.connectors[p.name]]
                continue
            meant = splits(p.name, network.parts)
            if not meant:
                hint = did_you_mean(p.name.partition(".")[0], list(network.parts))
                raise UnknownNameError(f"{p.where}: '{p.name}' names no component of the package{hint}")
            settings += [Setting(c, v, p.value, p.type, (), p.where, p.name) for c, v in meant]
    return replace(network, settings=tuple(settings), given=tuple(given), remarks=tuple(remarks))
