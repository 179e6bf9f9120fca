"""The FMUs of a network's components: described before anything of them is loaded, then loaded."""

from __future__ import annotations

import filecmp
import re
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path

from ...core.errors import CosimError, PackageError, did_you_mean
from ...ssp.model import Component, Connector
from ...ssp.wires import Network
from ..slaves.base import Log, Slave
from ..slaves.fmu import describe, platform_folder
from ..slaves.function import FunctionSlave


def described(path: str, component: Component, library: bool = True) -> Slave:
    """The slave of a component, not loaded yet; see `describe`."""
    if component.function is not None:
        return FunctionSlave(path, component.function, component.source)
    return describe(path, component.source, library)


def of_component(path: str, component: Component) -> Slave:
    """The slave of a component; what is wrong with its FMU is told with the place that asks for it."""
    try:
        return described(path, component)
    except PackageError as error:
        text = str(error).replace(str(component.source), component.source.name)
        raise PackageError(f"{component.where}: component '{path}': {text}") from None


def read_alone(path: str, component: Component) -> Slave | None:
    """The slave of a component whose FMU may lack a library for this platform, to look at; None if it is unreadable."""
    try:
        return described(path, component, library=False)
    except CosimError:
        return None


def foreign_connectors(component: Component, slave: Slave) -> Iterator[tuple[Connector, str]]:
    """The connectors that a component has and its FMU has not, and what to say of each."""
    for connector in component.connectors:
        if connector.name not in slave.variables:
            yield (
                connector,
                f"{connector.where}: component '{slave.name}' has a connector '{connector.name}' that its FMU does not "
                f"have{did_you_mean(connector.name, sorted(slave.variables))}",
            )


def smallest_step(network: Network, slaves: Mapping[str, Slave]) -> float | None:
    """The smallest macro step [s] that suits what the package hints for components, or else their FMUs suggest."""
    made = []
    for path, slave in slaves.items():
        step = network.parts[path].component.step_hint or slave.suggested("stepSize") or 0.0
        if step > 0.0:
            made.append(slave.ratio * step)
    return min(made, default=None)


def check_single(slaves: Mapping[str, Slave]) -> None:
    """FMUs that can be instantiated only once per process are there only once."""
    single: dict[Path, str] = {}
    for path, slave in slaves.items():
        once = getattr(slave.description.coSimulation, "canBeInstantiatedOnlyOncePerProcess", False)
        if once and slave.folder in single:
            raise PackageError(
                f"components '{single[slave.folder]}' and '{path}' are the same FMU, which can be instantiated only "
                "once per process; --isolate gives each a process of its own"
            )
        single[slave.folder] = path


def mixed_libraries(slaves: Mapping[str, Slave]) -> Iterator[str]:
    """Libraries beside those of the FMUs that have one name and different contents: a process loads the first only."""
    first: dict[str, tuple[str, Path]] = {}
    folders: dict[Path, str] = {}
    for path, slave in slaves.items():
        folders.setdefault(slave.folder, path)
    for folder, path in folders.items():
        own = slaves[path].description.coSimulation.modelIdentifier
        for file in sorted((folder / "binaries" / platform_folder(slaves[path].version)).glob("*")):
            if file.stem == own or not file.is_file() or not re.search(r"\.(so|dll|dylib)(\.|$)", file.name):
                continue
            other, twin = first.setdefault(file.name, (path, file))
            if not filecmp.cmp(file, twin, shallow=False):
                yield (
                    f"components '{path}' and '{other}' bring different libraries '{file.name}', and one process uses "
                    "the same for both: --isolate keeps them apart"
                )


def load_slaves(slaves: Mapping[str, Slave], stack: ExitStack, log: Log) -> None:
    """Instantiate all slaves; `stack` frees them. A slave keeps its own messages, `log` gets those of all."""

    def on_log(component: str, status: str, text: str) -> None:
        if component in slaves:
            slaves[component].take(status, text)
        log(component, status, text)

    for slave in slaves.values():
        stack.callback(slave.free)
        slave.set_out()
    for slave in slaves.values():
        slave.load(on_log)
