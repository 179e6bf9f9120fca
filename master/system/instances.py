"""The FMUs of a network's components: described before anything of them is loaded, then loaded."""

from __future__ import annotations

import filecmp
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path

from ...core.errors import CosimError, PackageError, did_you_mean
from ...ssp.flat_system import FlatSystem
from ...ssp.model import Component, Connector
from ..slaves.base import FmuInstance, Log
from ..slaves.fmu import describe, platform_folder
from ..slaves.function import FunctionInstance


def described(path: str, component: Component, library: bool = True) -> FmuInstance:
    """The instance of a component, not loaded yet; see `describe`."""
    if component.function is not None:
        return FunctionInstance(path, component.function, component.source)
    return describe(path, component.source, library)


def of_component(path: str, component: Component) -> FmuInstance:
    """The instance of a component; what is wrong with its FMU is told with the place that asks for it."""
    try:
        return described(path, component)
    except PackageError as error:
        text = str(error).replace(str(component.source), component.source.name)
        raise PackageError(f"{component.where}: component '{path}': {text}") from None


def read_alone(path: str, component: Component) -> FmuInstance | None:
    """The instance of a component whose FMU may lack a library for this platform, to look at; None if unreadable."""
    try:
        return described(path, component, library=False)
    except CosimError:
        return None


def foreign_connectors(component: Component, instance: FmuInstance) -> Iterator[tuple[Connector, str]]:
    """The connectors that a component has and its FMU has not, and what to say of each."""
    for connector in component.connectors:
        if connector.name not in instance.variables:
            yield (
                connector,
                f"{connector.where}: component '{instance.name}' has a connector '{connector.name}' that its FMU does "
                f"not have{did_you_mean(connector.name, sorted(instance.variables))}",
            )


def smallest_step(network: FlatSystem, instances: Mapping[str, FmuInstance]) -> float | None:
    """The smallest macro step [s] that suits what the package hints for components, or else their FMUs suggest."""
    steps = []
    for path, instance in instances.items():
        step = network.components[path].component.step_hint or instance.suggested("stepSize") or 0.0
        if step > 0.0:
            steps.append(instance.substeps * step)
    return min(steps, default=None)


def check_single(instances: Mapping[str, FmuInstance]) -> None:
    """FMUs that can be instantiated only once per process are there only once."""
    single: dict[Path, str] = {}
    for path, instance in instances.items():
        once = getattr(instance.description.coSimulation, "canBeInstantiatedOnlyOncePerProcess", False)
        if once and instance.folder in single:
            raise PackageError(
                f"components '{single[instance.folder]}' and '{path}' are the same FMU, which can be instantiated only "
                "once per process; --isolate gives each a process of its own"
            )
        single[instance.folder] = path


def mixed_libraries(instances: Mapping[str, FmuInstance]) -> Iterator[str]:
    """Libraries beside those of the FMUs that have one name and different contents: a process loads the first only."""
    first: dict[str, tuple[str, Path]] = {}
    folders: dict[Path, str] = {}
    for path, instance in instances.items():
        folders.setdefault(instance.folder, path)
    for folder, path in folders.items():
        identifier = instances[path].description.coSimulation.modelIdentifier
        for file in sorted((folder / "binaries" / platform_folder(instances[path].version)).glob("*")):
            if file.stem == identifier or not file.is_file() or not re.search(r"\.(so|dll|dylib)(\.|$)", file.name):
                continue
            other, twin = first.setdefault(file.name, (path, file))
            if not filecmp.cmp(file, twin, shallow=False):
                yield (
                    f"components '{path}' and '{other}' bring different libraries '{file.name}', and one process uses "
                    "the same for both: --isolate keeps them apart"
                )


def load_instances(
    instances: Mapping[str, FmuInstance], stack: ExitStack, log: Log,
    loaded: Callable[[int, int], None] = lambda *_: None,
) -> None:  # fmt: skip
    """Instantiate all FMUs; `stack` frees them. Each keeps its own messages, `log` gets those of all.

    `loaded` gets how many are there and how many there will be.
    """

    def on_log(component: str, status: str, text: str) -> None:
        if component in instances:
            instances[component].keep_message(status, text)
        log(component, status, text)

    for instance in instances.values():
        stack.callback(instance.free)
        instance.start_process()
    for done, instance in enumerate(instances.values()):
        loaded(done, len(instances))
        instance.load(on_log)
