"""A run before anything is loaded: the package put together, and all that can be wrong with the options looked at."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path

from ...core.errors import UsageError, did_you_mean, first_few
from ...ssp.flat_system import FlatSystem
from ...ssp.model import AnswersAsked
from ..algorithms import check_method, choose_method, method_named
from ..algorithms.method import Method
from ..coupling.initialisation import parameter_order
from ..coupling.power_bonds import Bond, find_bonds
from ..engine import step_threads
from ..isolation.isolated import IsolatedInstance, supported
from ..isolation.sandbox import landlock_version
from ..options import Options
from ..results import check_writable
from ..results.columns import RecordLayout
from ..results.constants import chosen_parameters
from ..slaves.base import FmuInstance
from ..slaves.message_log import LEVELS
from ..system.addresses import targets
from ..system.assemble import Assembly, assemble
from ..system.findings import Findings
from ..system.instances import mixed_libraries, smallest_step
from ..system.parameters import parameters_in_force
from ..system.start_values import StartValue, idle
from ..system.system import System
from . import stimuli
from .answers import sound
from .interrupts import Interrupts
from .run_folder import LOG_SUFFIXES, check_name
from .saved_state import SavedState, read_state
from .time_grid import TimeGrid, time_grid


@dataclass
class Plan:
    """A run that could begin."""

    options: Options
    """As they were given, with the method that is used."""
    method: Method
    network: FlatSystem
    instances: dict[str, FmuInstance]
    system: System
    values: list[StartValue]
    """Start values and parameters in the order in which they are set: of the package, then of the options."""
    structural_values: list[StartValue]
    """Values of structural parameters, likewise; the instances have them already."""
    drives: list[stimuli.InputSeries]
    layout: RecordLayout
    recorded_columns: list[int]
    """Columns of the layout that are recorded."""
    times: TimeGrid
    """Start, stop and macro step [s], and the number of steps."""
    bonds: list[Bond]
    """Power bonds."""
    remarks: list[str]
    resumed: SavedState | None = None
    """What the run begins with, instead of the start."""
    answers: AnswersAsked = field(default_factory=AnswersAsked)
    """What the package wants said after it."""

    @property
    def steps_before(self) -> int:
        """Macro steps that an earlier run has taken already."""
        return self.resumed.done if self.resumed is not None else 0

    @property
    def first_time(self) -> float:
        """Time of the first communication point [s]."""
        return self.resumed.time if self.resumed is not None else self.times.start


def make_plan(package: Path, options: Options, stack: ExitStack, interrupt: Interrupts) -> Plan:
    """Read the package; what it was unpacked into goes with the stack. Raises `CosimError` for all that is wrong."""
    check_options(options)
    findings = Findings()
    resumed = read_state(options.resume) if options.resume is not None else None

    def as_run(network: FlatSystem, instances: dict[str, FmuInstance]) -> dict[str, FmuInstance]:
        method = method_named(choose_method(options.method, network.structure.method))
        prepared = _isolated(options, method, instances, interrupt)
        set_substeps(options, prepared)
        return prepared

    assembly = assemble(package, options, stack, findings, prepare=as_run)
    assert assembly is not None
    network, instances, system, remarks = assembly.network, assembly.instances, assembly.system, findings.warnings
    check_categories(options, instances)
    check_saving(options, instances)
    for instance in instances.values() if options.saves else ():  # whatever a run that goes on records
        instance.texts.update(s.name for s in instance.outputs)
    name = choose_method(options.method, network.structure.method)
    options, method = replace(options, method=name), method_named(name)
    step = options.step
    if resumed is not None and step is None and network.structure.step_size is None:
        step = resumed.step  # which would hang on the stop time
    times = time_grid(network.structure, options.stop_time, step)
    if not options.isolate:
        remarks += mixed_libraries(instances)
    elif method.interpolating(instances.values()):
        remarks.append("--isolate: no slopes of inputs are handed over; without it the results differ a little")
    remarks += [*idle(network, assembly.values), *step_remarks(network, instances, times)]
    remarks += _overruled([c for c in options.changes if c[0] not in network.inputs], system)
    layout = RecordLayout(system)
    recorded_columns = layout.chosen(options.record)
    layout.chosen(options.plot, "--plot")
    layout.keep_texts(recorded_columns if options.results else ())
    if options.record_parameters:
        chosen_parameters(
            parameters_in_force(system, [*assembly.structural_values, *assembly.values]), options.record_parameters
        )
    asked, unsound = answers_of(assembly, layout)
    remarks += unsound
    drives = stimuli.read(options.stimuli, system) if options.stimuli is not None else []
    if options.stimuli is not None:
        remarks += stimuli.remarks(options.stimuli, drives, system, times.start, times.stop)
    for drive in drives:
        if drive.texts and drive.signal.component:
            instances[drive.signal.component].texts.add(drive.signal.name)
    system.writer.forks = options.parallel and step_threads.supported()
    bonds = check_coupling(system, name, options.isolate)
    return Plan(
        options, method, network, instances, system, assembly.values, assembly.structural_values, drives, layout,
        recorded_columns, times, bonds, remarks, resumed, asked,
    )  # fmt: skip


def answers_of(assembly: Assembly, layout: RecordLayout) -> tuple[AnswersAsked, list[str]]:
    """What the package wants said after a run and can be; remarks on what cannot."""
    asked = assembly.network.structure.answers
    if not asked.values and not asked.sentences:
        return asked, []
    in_force = parameters_in_force(assembly.system, [*assembly.structural_values, *assembly.values])
    return sound(asked, [*(c.name for c in layout.columns), *(p.address for p in in_force)])


def check_options(options: Options) -> None:
    """Raise `UsageError` for what no package can do."""
    choose_method(options.method, None)  # is there one of that name
    if options.record_every < 1:
        raise UsageError(f"--record-every {options.record_every}: it has to be at least 1")
    for option, name in (("--results", options.results), ("--log", options.log)):
        if Path(name).is_absolute() or ".." in Path(name).parts:
            raise UsageError(f"{option} {name}: is the name of a file in the result folder; --out names another folder")
        if name:
            check_name(option, name)
    if options.results:
        check_writable(Path(options.results))
    check_log(options)
    if options.resume is not None and options.check_step:
        raise UsageError("--check-step runs the whole time again and cannot be had with --resume")
    if options.isolate and not supported():
        raise UsageError("--isolate cannot be had on this system: FMUs run in the master's process (docs/platforms.md)")
    if options.sandbox and not landlock_version():
        raise UsageError("--sandbox needs Landlock (Linux 5.13 or later); --isolate alone keeps crashes apart")
    if options.step_timeout is not None and not options.isolate:
        raise UsageError("--step-timeout needs --isolate: only a process of its own can be stopped")


def check_log(options: Options) -> None:
    """Raise `UsageError` for a message log that cannot be."""
    if not options.log:
        if options.log_level is not None or options.log_categories:
            raise UsageError("--log-level and --log-category need --log, the file that gets the messages")
        return
    if options.log_level not in (None, *LEVELS):
        known = ", ".join(LEVELS)
        raise UsageError(f"--log-level {options.log_level}: it has to be one of {known}")
    if Path(options.log).suffix.lower() not in LOG_SUFFIXES:
        raise UsageError(f"--log {options.log}: its name has to end in {', '.join(LOG_SUFFIXES)}")


def check_categories(options: Options, instances: Mapping[str, FmuInstance]) -> None:
    """Raise `UsageError` for a category that no FMU has; those of FMI 1.0 do not say what they have."""
    if any(instance.version == "1.0" for instance in instances.values()):
        return
    known = sorted({c.name for instance in instances.values() for c in instance.description.logCategories})
    for category in options.log_categories:
        if category not in known:
            has = f"they have {', '.join(known)}" if known else "they declare none"
            message = f"--log-category {category}: no FMU has that category; {has}{did_you_mean(category, known)}"
            raise UsageError(message)


def check_saving(options: Options, instances: Mapping[str, FmuInstance]) -> None:
    """Raise `UsageError` where the state is to be saved and an FMU cannot give its own."""
    lacking = [f"component '{n}': {why}" for n, i in instances.items() if (why := i.lacks_serialising)]
    if options.saves and lacking:
        raise UsageError(f"--save-state: {'; '.join(lacking)}")


def check_coupling(system: System, method: str, isolated: bool) -> list[Bond]:
    """The power bonds; raises `CosimError` for what the coupling needs and the FMUs do not have."""
    parameter_order(system)
    check_method(method, system, isolated)
    return find_bonds(system)


def _isolated(
    options: Options, method: Method, instances: dict[str, FmuInstance], interrupt: Interrupts
) -> dict[str, FmuInstance]:
    """The instances, all of them in processes of their own or those that keep others from stepping beside them."""
    able = options.parallel and method.needs_state is None and supported()

    def apart(instance: FmuInstance) -> bool:
        return instance.is_foreign and (options.isolate or (able and instance.runs_in_python))

    arguments = options.step_timeout, interrupt, options.saves, options.sandbox
    return {n: IsolatedInstance(s, *arguments) if apart(s) else s for n, s in instances.items()}


def set_substeps(options: Options, instances: dict[str, FmuInstance]) -> None:
    """Give the instances their steps of their own in a macro step; `UsageError` for what cannot be."""
    for component, ratio in options.substeps:
        if component not in instances:
            raise UsageError(f"--substeps {component}={ratio}: there is no component '{component}'")
        if not 1 <= ratio <= 1_000_000:
            raise UsageError(f"--substeps {component}={ratio}: it has to be from 1 to a million")
        instances[component].substeps = ratio


def step_remarks(network: FlatSystem, instances: dict[str, FmuInstance], times: TimeGrid) -> list[str]:
    """Where the steps are others than are suggested, or than suit the FMUs."""
    start, stop, step, n = times
    return [
        *_other_steps(network, instances, step), *_uneven(instances, start, stop, step, n), *_inner(instances, step),
        *_clocked(instances),
    ]  # fmt: skip


def _other_steps(network: FlatSystem, instances: dict[str, FmuInstance], step: float) -> list[str]:
    """Macro steps that the package or its FMUs suggest, and that are not taken."""
    smallest = smallest_step(network, instances)
    if smallest and smallest > step and any(c.component.step_hint for c in network.components.values()):
        smallest = None  # who hints at steps of components means multiples of the macro step
    suggested = dict.fromkeys(s for s in (network.structure.step_size, smallest) if s and abs(s - step) > 1e-6 * step)
    return [f"the step is {step:g} s; the package or its FMUs suggest {s:g} s" for s in suggested]


def _uneven(instances: dict[str, FmuInstance], start: float, stop: float, step: float, n: int) -> list[str]:
    """FMUs that are not made for the shorter step at the end."""
    if abs(start + n * step - stop) <= 1e-9 * max(abs(stop), step):
        return []
    able = "canHandleVariableCommunicationStepSize"
    return [
        f"component '{name}' does not say that it can handle steps of different length ({able}); the last one is "
        "shorter: choose a step that divides the time"
        for name, instance in instances.items()
        if not getattr(instance.description.coSimulation, able, False)
    ]


def _inner(instances: dict[str, FmuInstance], step: float) -> list[str]:
    """FMUs whose own step does not fit into the macro step."""
    remarks = []
    for name, instance in instances.items():
        own = getattr(instance.description.coSimulation, "fixedInternalStepSize", None)
        count = step / instance.substeps / float(own) if own else 1.0
        if own and (abs(count - round(count)) > 1e-6 * count or round(count) < 1):
            remarks.append(
                f"component '{name}' has an inner step of {float(own):g} s; its step of {step / instance.substeps:g} s "
                "is no multiple of that"
            )
    return remarks


def _clocked(instances: dict[str, FmuInstance]) -> list[str]:
    """FMUs with clocks, none of which is ticked from here."""
    remarks = []
    for name, instance in instances.items():
        if not instance.clocks:
            continue
        hanging = [v.name for v in instance.variables.values() if v.type != "Clock" and v.clocks]
        on = f"what hangs on them ({first_few(map(repr, hanging), 3)})" if hanging else "what hangs on them"
        named = f"component '{name}' has clocks ({first_few((repr(v.name) for v in instance.clocks), 3)})"
        if instance.needs_event_mode:
            remarks.append(
                f"{named} and needs event mode for them, which is not supported: it may refuse its first step, or {on} "
                "does not run"
            )
        else:
            remarks.append(f"{named}; none is ticked here, so {on} runs only if the FMU sees to it")
    return remarks


def _overruled(changes: Iterable[tuple[str, str]], system: System) -> list[str]:
    """Changes of inputs that connections give their values."""
    remarks = []
    for address, value in changes:
        for end in targets(address, system.instances):
            if (link := system.connections.driver(end)) is not None:
                shown = f"'{'.'.join(end)}' is connected to '{link.source.address}', which counts"
                remarks.append(f"--set {address}={value}: {shown}")
    return remarks
