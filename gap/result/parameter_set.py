"""calibrated.ssv: the parameters that were found, for `cosim-master --parameters`."""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

from ..pipeline.diagnosis import Diagnosis
from ..problem.problem import matching


def parameter_set(d: Diagnosis) -> str:
    """The parameters of the chosen hypothesis as an SSV file; conditions that the runs state are not in it."""
    problem = d.state.problem
    point = d.state.reported.hypothesis.fit.point
    calibrated, varied = problem.model_values(0, point), problem.differing_values(point)
    values = problem.runs[0].values
    lines = []
    targets = {t: value for name, value in calibrated.items() if name not in varied for t in matching(name, values)}
    for target, value in sorted(targets.items()):
        if isinstance(value, bool) or isinstance(values[target], bool):
            body = f"<ssv:Boolean value={quoteattr(str(bool(value)).lower())}/>"
        elif isinstance(values[target], int):
            body = f"<ssv:Integer value={quoteattr(str(int(value)))}/>"
        elif isinstance(value, str):
            body = f"<ssv:String value={quoteattr(value)}/>"
        else:
            body = f"<ssv:Real value={quoteattr(repr(float(value)))}/>"
        lines.append(f"    <ssv:Parameter name={quoteattr(target)}>{body}</ssv:Parameter>")
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" '
        'name="calibrated">\n  <ssv:Parameters>\n' + "\n".join(lines) + "\n  </ssv:Parameters>\n</ssv:ParameterSet>\n"
    )
