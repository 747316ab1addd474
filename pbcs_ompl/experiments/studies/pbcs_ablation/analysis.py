"""What alpha, beta and the radius change."""

from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.experiments.claims import Claim, greater, higher, no_higher, rate
from pbcs_ompl.figures.by_group import draw_rates, draw_values
from pbcs_ompl.figures.canvas import legend_below, new_panels, publish

Records = list[dict[str, Any]]
SOURCE = "[Matheron2020] 7.5"
NAMES = {"alpha": "alpha", "beta": "beta", "radius": "epsilon (radius)"}


def analyse(records: Records, figures: Path) -> list[Claim]:
    """Draw rates, transitions and skills for each value of each parameter; check what the thesis expects of them."""
    if not records:
        return []
    _draw(records, figures)
    return [*_alpha(records), *_beta(records), *_radius(records)]


def _swept(records: Records, parameter: str) -> dict[float, Records]:
    """Return the runs for each value of a parameter whose other parameters have the usual values, in rising order."""
    chosen = [r for r in records if all(r["point"][name] == value for name, value in r["usual"].items()
                                        if name != parameter)]
    values = sorted({record["point"][parameter] for record in chosen})
    return {value: [record for record in chosen if record["point"][parameter] == value] for value in values}


def _usual(records: Records, parameter: str) -> float:
    return float(records[0]["usual"][parameter])


def _ends(records: Records, parameter: str) -> tuple[float, float, float]:
    """Return the lowest, the usual and the highest value."""
    usual = _usual(records, parameter)
    values = list(_swept(records, parameter)) or [usual]
    return values[0], usual, values[-1]


def _solved(runs: Records) -> dict[str, Any]:
    return rate(sum(record["solved"] for record in runs), len(runs))


def _more(claim: str, records: Records, key: str, parameter: str, values: tuple[float, float],
          source: str = SOURCE) -> Claim:
    """Claim that a number is larger with the first value than with the second, maze by maze and seed by seed.

    The number of skills is that of complete chains only.
    """
    swept = _swept(records, parameter)
    one, other = ({(r["size"], r["seed"]): float(r[key]) for r in swept.get(value, [])
                   if key != "skills" or r["complete"]} for value in values)
    return greater(claim, one, other, (f"{values[0]:g}", f"{values[1]:g}"), source)


def _no_worse(claim: str, records: Records, parameter: str, value: float, than: float) -> Claim:
    swept = _swept(records, parameter)
    one, other = _solved(swept.get(value, [])), _solved(swept.get(than, []))
    return no_higher(f"{claim}: the latter does not solve more", other, one, (f"{than:g}", f"{value:g}"), SOURCE)


def _alpha(records: Records) -> list[Claim]:
    low, usual, high = _ends(records, "alpha")
    return [_more(f"alpha = {high:g} costs more transitions than {usual:g}", records, "train_transitions", "alpha",
                  (high, usual)),
            _no_worse(f"alpha = {high:g} builds chains as well as {usual:g}", records, "alpha", high, usual),
            _more(f"alpha = {low:g} leads to more skills than {usual:g}", records, "skills", "alpha", (low, usual))]


def _beta(records: Records) -> list[Claim]:
    low, usual, high = _ends(records, "beta")
    swept = {value: _swept(records, "beta").get(value, []) for value in (low, usual)}
    few, many = _solved(swept[low]), _solved(swept[usual])
    return [_more(f"beta = {high:g} costs more transitions than {usual:g}", records, "train_transitions", "beta",
                  (high, usual)),
            _no_worse(f"beta = {high:g} builds chains as well as {usual:g}", records, "beta", high, usual),
            higher(f"beta = {low:g} leads to chains that fail more often than with {usual:g}", many, few,
                   (f"solved, {usual:g}", f"solved, {low:g}"), SOURCE)
            .with_numbers(**{f"success with random actions, median, {value:g}":
                             float(np.median([record["success_rate"] for record in runs]))
                             for value, runs in swept.items() if runs})]


def _radius(records: Records) -> list[Claim]:
    low, usual, high = _ends(records, "radius")
    ours = "ours; [Matheron2020] 7.5 only says what epsilon is"
    return [_more(f"epsilon = {low:g} costs more transitions than {usual:g}", records, "train_transitions", "radius",
                  (low, usual), ours),
            _more(f"epsilon = {low:g} leads to more skills than {high:g}", records, "skills", "radius", (low, high),
                  ours)]


def _draw(records: Records, figures: Path) -> None:
    """Draw a row of panels for each parameter: solved runs, transitions, skills."""
    figure, panels = new_panels(len(NAMES), 3, 12.6, 3.4 * len(NAMES))
    for row, parameter in enumerate(NAMES):
        rates, *values = panels[3 * row:3 * row + 3]
        groups = _by_size_and_value(records, parameter)
        draw_rates(rates, {size: {value: (sum(r["solved"] for r in runs), len(runs)) for value, runs in columns.items()}
                           for size, columns in groups.items()})
        for axes, (key, label) in zip(values, (("train_transitions", "training transitions"), ("skills", "skills")),
                                      strict=True):
            draw_values(axes, {size: {value: [r[key] for r in runs] for value, runs in columns.items()}
                               for size, columns in groups.items()}, ylabel=label, log=key != "skills")
        for axes in (rates, *values):
            axes.set_xlabel(f"{NAMES[parameter]}, usually {_usual(records, parameter):g}")
    legend_below(figure)
    figure.suptitle("PBCS without verification, one parameter changed (7.5)", fontsize=10)
    publish(figure, figures / "parameters.png")


def _by_size_and_value(records: Records, parameter: str) -> dict[str, dict[str, Records]]:
    swept = _swept(records, parameter)
    return {f"{size}x{size}": {f"{value:g}": [r for r in runs if r["size"] == size] for value, runs in swept.items()}
            for size in sorted({record["size"] for record in records})}
