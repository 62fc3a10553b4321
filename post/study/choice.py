"""The Pareto front and the setting to recommend."""
from post.study.spec import MEASURES

COST = "cpu_seconds"


def score(row, limits):
    """The largest error of a run as a share of what is allowed; infinite if it has none."""
    if row.get("status") != "completed":
        return float("inf")
    return max(row.get(f"{name}_error", float("inf")) / limit for name, limit in limits.items())


def front(rows, limits):
    """Runs that no other beats both in cost and in score, the cheapest first."""
    best, chosen = float("inf"), []
    for row in sorted(rows, key=lambda row: (row.get(COST, float("inf")), score(row, limits))):
        if score(row, limits) < best:
            best = score(row, limits)
            chosen.append(row)
    return chosen


def recommended(rows, limits):
    """The cheapest run whose errors are all allowed; if there is none, the one that comes nearest.
    None if no run has errors."""
    best = front(rows, limits)
    allowed = [row for row in best if score(row, limits) <= 1]
    return allowed[0] if allowed else (best[-1] if best else None)


def has_settings(row, settings):
    return all(str(row.get(f"set_{name}")) == str(value) for name, value in settings.items())


def setting_text(row, names):
    """The parameters of a run that tell it from the others."""
    return ", ".join(f"{name}={row[f'set_{name}']}" for name in names if f"set_{name}" in row)


def errors_text(row, limits):
    """The errors of a run in words."""
    units = {name: "mm" if MEASURES[name][1] else "%" for name in limits}
    return ", ".join(f"{name.replace('_', ' ')} {row[f'{name}_error']:.2g} {units[name]}"
                     for name in limits if f"{name}_error" in row)
