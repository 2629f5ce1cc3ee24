"""Pictures on matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._fields import Series, unit_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ._result import Result, Table


def plot(result: Result, field: str | None, variant: str | None, step: int) -> Figure:
    """Plots the body and the history, if they exist."""
    import matplotlib.pyplot as plt

    series = result.fields.pick(variant) if result.fields else None
    histories = result.histories
    wanted = int(series is not None) + int(bool(histories))
    if wanted == 0:
        raise ValueError("plot: this run has neither fields nor a history")
    figure, axes = plt.subplots(1, wanted, figsize=(5.5 * wanted, 4.2), layout="constrained", squeeze=False)
    if series is not None:
        body(axes[0, 0], series, field, step)
    if histories:
        history(axes[0, -1], {variant: histories[variant]} if variant in histories else histories)
    return figure


def body(axes: Axes, series: Series, field: str | None, step: int) -> None:
    """Draws particles, or nodes of the upper side, coloured by a field."""
    names = {name: kind for kind, name in series.names() if kind != "position"}
    name = field or next((n for n in ("damage", "temperature_degC", "displacement") if n in names), next(iter(names)))
    if name not in names or names[name] == "cell":
        known = ", ".join(n for n, kind in names.items() if kind == "point")
        raise ValueError(f"field: found {name!r}; allowed: {known}")
    points = series.read("position", "position", [step])[0]
    values, label = scalar(series.read("point", name, [step])[0], name)
    draw(axes, points, values, label)


def scalar(values: NDArray[np.float64], name: str) -> tuple[NDArray[np.float64], str]:
    """Reduces values to one number per place: the length of a vector, the first component of a tensor."""
    unit = unit_of(name)
    label = f"{name} [{unit}]" if unit else name
    if values.ndim == 1:
        return values, label
    if values.shape[1] in (2, 3):
        return np.linalg.norm(values, axis=1), f"|{name}| [{unit}]" if unit else f"|{name}|"
    return values.reshape(len(values), -1)[:, 0], label.replace(name, f"{name} 11")


def draw(axes: Axes, points: NDArray[np.float64], values: NDArray[np.float64], label: str) -> Any:
    """Draws points of a plane, or of a solid seen along its shortest edge, nearest last."""
    points = np.asarray(points)
    if points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    seen = np.isfinite(values)
    extent = np.ptp(points, axis=0)
    depth = int(np.argmin(extent))
    across = [d for d in range(3) if d != depth]
    order = np.flatnonzero(seen)[np.argsort(points[seen, depth], kind="stable")]
    flat = points[order][:, across]
    area = max(float(np.prod(np.ptp(flat, axis=0))), 1e-300) if len(flat) else 1.0
    count = len(np.unique(np.round(flat / (np.sqrt(area) * 1e-3 + 1e-300)), axis=0)) if len(flat) else 1
    size = 5.5 * 72 * np.sqrt(area / max(count, 1)) / max(float(np.ptp(flat, axis=0).max()), 1e-300) * 0.8
    drawn = axes.scatter(1e3 * flat[:, 0], 1e3 * flat[:, 1], c=values[order], s=min(size**2 * 0.6, 120.0), marker="s", linewidths=0)
    axes.set_aspect("equal")
    axes.set_xlabel(f"{'xyz'[across[0]]} [mm]")
    axes.set_ylabel(f"{'xyz'[across[1]]} [mm]")
    axes.figure.colorbar(drawn, ax=axes, label=label, shrink=0.8)
    return drawn


def history(axes: Axes, histories: dict[str, Table]) -> None:
    """Plots load over displacement, or temperature over time."""
    for name, table in histories.items():
        x, y = ("displacement", "load") if "load" in table else ("time", next((n for n in table if n.startswith("temp")), list(table)[-1]))
        scale, unit = (1e3, "mm") if table.units.get(x) == "m" else (1.0, table.units.get(x, ""))
        first, second = table[x], table[y]
        if x == "displacement":
            first, second = np.append(0.0, first), np.append(0.0, second)
        axes.plot(scale * first, second, label=name, lw=1.2)
        axes.set_xlabel(f"{x} [{unit}]" if unit else x)
        axes.set_ylabel(f"{y} [{table.units[y]}]" if table.units.get(y) else y)
    if 1 < len(histories) <= 12:
        axes.legend(fontsize="small")
    axes.grid(alpha=0.3)
