"""A system as a tree for people."""

from __future__ import annotations

from collections.abc import Iterable

from ...core.errors import first_few
from ...ssp.flat_system import FlatConnection, FlatSystem, indices_text
from ...ssp.model import Binding, Component, Linear, Metadata, SignalDictionaryReference, Type
from ...ssp.model import System as Tree
from .system import System


def tree(network: FlatSystem, system: System | None = None) -> str:
    """The system as a tree for people, with its connections."""
    structure = network.structure
    times = f", {structure.start_time:g} s to {structure.stop_time:g} s" if structure.stop_time is not None else ""
    step = f", step {structure.step_size:g} s" if structure.step_size is not None else ""
    version = f"SSP {structure.version}, " if structure.version else ""
    lines = [f"{structure.name} ({version}{structure.file.name}{times}{step})"]
    if len(structure.variants) > 1:
        lines.append(f"variants: {', '.join(structure.variants)}")
    _branch(lines, structure.system, "", network, system)
    lines += ["", "connections"]
    for name, ways in network.connectors.items():
        if "." not in name and name not in network.inputs:  # parameters of the whole system
            for component, variable, hops in ways:
                way = _on_the_way(FlatConnection(("", name), ("", ""), hops[1:]))
                lines.append(f"  {name} -> {component}.{variable}{way}")
    for flat_connection in (*network.parameter_connections, *network.flat_connections):
        lines.append(_flat(flat_connection))
    lines += map(_flat, network.outputs)
    if structure.unused:
        lines += ["", "annotations that are not used", *(f"  {annotation}" for annotation in structure.unused)]
    if structure.metadata:
        lines += ["", "told beside it, and not carried out"]
    for metadata in structure.metadata:
        lines.append(f"  {metadata.place}: {metadata.kind}{_title(metadata)}")
        lines += [f"    {line}" for line in metadata.lines]
    return "\n".join(lines)


def _title(metadata: Metadata) -> str:
    return f" '{metadata.title}'" if metadata.title else ""


def _flat(flat_connection: FlatConnection) -> str:
    start, end = (".".join(filter(None, side)) for side in (flat_connection.start, flat_connection.end))
    source = f"{start}{indices_text(flat_connection.start_indices)}"
    return f"  {source} -> {end}{indices_text(flat_connection.end_indices)}{_on_the_way(flat_connection)}"


def _sets(bindings: Iterable[Binding], indent: str) -> list[str]:
    lines = []
    for binding in bindings:
        names = [f"{binding.prefix}{p.name} = {_brief(p.value)}{_unit(p.type)}" for p in binding.parameters]
        lines.append(f"{indent}sets: {first_few(names)}")
    return lines


def _unit(type: Type | None) -> str:
    return f" [{type.unit.name}]" if type is not None and type.unit is not None else ""


def _brief(value: object) -> str:
    """A value in a few characters."""
    values = value if isinstance(value, tuple) else (value,)
    shown = [f"{v:g}" if isinstance(v, float) else str(v) for v in values[:4]]
    return " ".join(shown)[:60] + (" ..." if len(values) > 4 else "")


def _on_the_way(flat_connection: FlatConnection) -> str:
    texts = []
    for hop in flat_connection.hops:
        t = hop.transformation
        if isinstance(t, Linear):
            texts.append(f"{t.factor:g} x {'+' if t.offset >= 0 else '-'} {abs(t.offset):g}")
        elif t is not None:
            texts.append(f"{t.kind.lower()}s " + first_few([f"{a!s} -> {b!s}" for a, b in t.entries.items()]))
        if hop.reached_name:
            texts.append(hop.reached_name + _unit(hop.type))
    return f"  ({'; '.join(texts)})" if texts else ""


def _sum(terms: Iterable[tuple[str, float]], offset: float) -> str:
    shown = [name if factor == 1.0 else f"{factor:g} {name}" for name, factor in terms]
    more = [f"{offset:g}"] if offset else []
    return " + ".join([*shown[:6], *([f"{len(shown) - 6} more"] if len(shown) > 6 else []), *more])


def _branch(
    lines: list[str], tree: Tree, indent: str, network: FlatSystem, system: System | None, path: str = ""
) -> None:
    for kind in dict.fromkeys(c.kind for c in tree.connectors):
        names = [c.name + _unit(c.type) for c in tree.connectors if c.kind == kind]
        lines.append(f"{indent}   {kind}{'' if kind in ('inout', 'unspecified', 'local') else 's'}: {', '.join(names)}")
    lines += _sets(tree.bindings, f"{indent}   ")
    for name, entries in tree.dictionaries.items():
        lines.append(f"{indent}   dictionary {name}: {', '.join(n + _unit(type) for n, type in entries.items())}")
    for i, part in enumerate(tree.elements):
        last = i == len(tree.elements) - 1
        stem, more = ("└─ ", "   ") if last else ("├─ ", "│  ")
        if isinstance(part, Component):
            lines.append(f"{indent}{stem}{part.name}: {_about(part, f'{path}{part.name}', system)}")
            lines += _sets(part.bindings, f"{indent}{more}   ")
        elif isinstance(part, SignalDictionaryReference):
            lines.append(f"{indent}{stem}{part.name}: signal dictionary {part.dictionary}")
        else:
            lines.append(f"{indent}{stem}{part.name}: system")
            _branch(lines, part, indent + more, network, system, f"{path}{part.name}.")


def _about(element: Component, path: str, system: System | None) -> str:
    if element.function is not None:
        sums = {name: _sum(terms, element.function.offset) for name, terms in element.function.outputs.items()}
        return "; ".join(f"{name} = {sum}" for name, sum in sums.items())
    if system is None:
        return element.source.name
    instance = system.instances[path]
    counts: dict[str, int] = {}
    for v in instance.variables.values():
        counts[v.causality or "local"] = counts.get(v.causality or "local", 0) + 1
    causalities = ("input", "output", "parameter", "calculatedParameter", "structuralParameter")
    kinds = [f"{counts[k]} {k}{'s' if counts[k] > 1 else ''}" for k in causalities if k in counts]
    return f"{element.source.name} (FMI {instance.version}; {', '.join(kinds)})"
