"""Tables of the benchmark's records: share of the bound, comparison with an earlier run."""
import math

from post.bench_records import find, share_of_bound
from post.results import counted


def record_table(records):
    """Least time, how far the median lies above it, time a point, share of the bound."""
    lines = [f"{'record':44}threads          ns  +median %   ns/point  of bound %  per"]
    for record in records:
        share = share_of_bound(records, record)
        lines.append(f"{record['name']:44.44}{record['threads']:7}{short(record['ns']):>12}"
                     f"{100 * record['spread']:11.1f}{short(record['ns_per_point']):>11}"
                     f"{short(share and 100 * share):>12}  {record['per']}")
    return "\n".join(lines)


def short(value):
    """A number of about four digits; a dash if it is not known."""
    if value is None:
        return "-"
    if value < 1:
        return f"{value:.4f}"
    return f"{value:.1f}" if value < 1e4 else f"{value:.2E}"


def comparison_table(now, before):
    """Ratios now over before with their spread, record by record."""
    lines = [f"{'record':44}threads  new/old   spread"]
    n_alone = 0
    for record in now:
        old = find(before, record["name"], record["threads"])
        if old is None:
            n_alone += 1
            continue
        ratio = record["ns"] / old["ns"]
        spread = ratio * math.hypot(record["spread"], old["spread"])
        lines.append(f"{record['name']:44.44}{record['threads']:7}{ratio:9.3f} +-{spread:6.3f}  "
                     f"{judgement(ratio, spread)}".rstrip())
    if n_alone > 0:
        lines.append(counted(n_alone, "record is new", "records are new"))
    return "\n".join(lines)


def judgement(ratio, spread):
    """Slower or faster only beyond the spread of both runs."""
    if ratio > 1 + spread:
        return "slower"
    return "faster" if ratio < 1 - spread else ""
