"""Section "calibration": how far the base parameters moved within their tolerances, and effects taken as known."""

from __future__ import annotations

from ..result.numbers import change, pretty, with_interval
from .budget import parameter
from .parts import Data
from .section import Context, Section
from .signals import Signals


def context(data: Data, signals: Signals) -> Context | None:
    """A row for each base parameter that moved, those that used most of their tolerance first."""
    moved, accepted = data["calibration"]["moved"], data["calibration"].get("accepted", {})
    if not moved and not accepted:
        return None
    accepted_effects = [
        {"effect": id, "text": e["text"],
         "parameters": [parameter(n, p, signals) for n, p in e["parameters"].items()]}
        for id, e in accepted.items()
    ]  # fmt: skip
    return {"known": accepted_effects, **(_strips(moved) if moved else {"rows": []})}


def _strips(moved: Data) -> Context:
    ordered = sorted(moved.items(), key=lambda x: -_used(x[1]))
    rows = [_row(name, p) for name, p in ordered]
    reach = 1.05 * max(max(abs(v) for v in (r["low"], r["high"], r["at"], 1.25 * r["tolerance"])) for r in rows)
    for r in rows:
        r["x"], r["x0"], r["x1"] = (_place(r[k], reach) for k in ("at", "low", "high"))
        r["t0"], r["t1"] = _place(-r["tolerance"], reach), _place(r["tolerance"], reach)
    return {"rows": rows, "ticks": _ticks(reach)}


def _used(p: Data) -> float:
    return float(abs(p["change"]) / (p["tolerance"] or 1e-300))


def _row(name: str, p: Data) -> Context:
    """Changes are relative to the value as delivered."""
    value, ends, power = with_interval(p["value"], p["ci95"])
    delivered = p["value"] / (1.0 + p["change"]) if p["change"] != -1.0 else 0.0
    low, high = sorted(x / delivered - 1.0 for x in p["ci95"]) if delivered else (p["change"], p["change"])
    return {
        "name": name, "value": value, "ends": ends, "power": power, "unit": pretty(p["unit"]),
        "change": change(p["change"]), "at": p["change"], "low": low, "high": high, "tolerance": p["tolerance"],
        "tolerance_text": _tolerance(p), "at_tolerance": p["at_tolerance"],
    }  # fmt: skip


def _tolerance(p: Data) -> str:
    """As it was stated: a share of the value, or a factor."""
    if factor := p.get("tolerance_factor"):
        return f"× or ÷\u00a0{factor:g}"
    return f"±{100.0 * p['tolerance']:.3g}\u00a0%"


def _place(x: float, reach: float) -> float:
    """Place on a strip of 100 units whose middle is the value as delivered."""
    return min(100.0, max(0.0, 50.0 + 50.0 * x / reach))


def _ticks(reach: float) -> list[Context]:
    steps = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
    step = next((s for s in steps if reach / s < 3.2), 2.0)
    ticks = [k * step for k in range(-3, 4) if abs(k * step) < 0.97 * reach]
    return [{"x": _place(t, reach), "text": f"{100.0 * t:+.3g} %".replace("-", "−") if t else "0"} for t in ticks]


SECTION = Section("calibration", "Calibration: base parameters that moved", context)
