"""Records that igaform_bench has written, and the share of the machine's bound that they reach."""
import json

from post.results import ResultsError, counted

# Numbers that are null where they are not known; each record has name, threads, ns and spread.
OTHERS = ("median", "repetitions", "ns_per_point", "flops", "bytes", "working_set", "memory_ratio")


def read(path):
    """The records of a file, each with all keys."""
    try:
        with open(path, encoding="utf-8") as file:
            records = json.load(file)
    except OSError as fault:
        raise ResultsError(f"cannot read '{path}': {fault.strerror}") from fault
    except (ValueError, RecursionError) as fault:
        raise ResultsError(f"'{path}' is not JSON: {fault}") from fault
    if not isinstance(records, list):
        raise ResultsError(f"'{path}' holds no list of records of igaform_bench")
    for number, record in enumerate(records, 1):
        if fault := fault_of(record):
            raise ResultsError(f"'{path}' holds no records of igaform_bench: number {number} "
                               f"{fault}")
    if not records:
        raise ResultsError(f"'{path}' holds no record")
    for threads in sorted({record["threads"] for record in records}):
        if not (find(records, "machine/multiply_add", threads)
                and len(triads_of(records, threads)) >= 2):
            raise ResultsError(f"'{path}' holds no measurement of the machine with "
                               f"{counted(threads, 'thread')}")
    return [{"per": "", **dict.fromkeys(OTHERS), **record} for record in records]


def fault_of(record):
    """What is wrong with a record; nothing if it is one."""
    if not isinstance(record, dict):
        return "is no object"
    if not all(isinstance(record.get(key, ""), str) for key in ("name", "per")):
        return "has a name or unit that is no text"
    if not record.get("name"):
        return "has no name"
    if type(record.get("threads")) is not int or record["threads"] < 1:
        return "has no number of threads"
    if not (is_number(record.get("ns")) and record["ns"] > 0):
        return "has no time 'ns' above 0"
    if not is_number(record.get("spread")):
        return "has no 'spread' of at least 0"
    for key in OTHERS:
        if record.get(key) is not None and not is_number(record[key]):
            return f"has '{key}' that is neither null nor a number of at least 0"
    return ""


def is_number(value):
    return (isinstance(value, (int, float)) and not isinstance(value, bool)
            and 0 <= value < 1e300)   # not for infinities and NaN, which Python reads


def chosen(records, stem, threads=None):
    """The records whose names begin with a text."""
    return [record for record in records if record["name"].startswith(stem)
            and threads in (None, record["threads"])]


def find(records, name, threads):
    """The record of this name and number of threads, None where there is none."""
    return next((record for record in records
                 if record["name"] == name and record["threads"] == threads), None)


def last_number(record):
    """The number at the end of a name: kilobytes, elements, points or faces."""
    return int(record["name"].rsplit("/", 1)[1])


def triads_of(records, threads):
    """The triads of the machine by their working sets."""
    return sorted(chosen(records, "machine/triad/", threads), key=last_number)


def share_of_bound(records, record):
    """Least possible time of a record over the time it took; None without a count of operations.
    The bandwidth is that of the least triad which holds the record's working set."""
    if not record["flops"]:
        return None
    triads = triads_of(records, record["threads"])
    triad = next((triad for triad in triads[:-1]
                  if 1e3 * last_number(triad) >= (record["working_set"] or 0)), triads[-1])
    peak = find(records, "machine/multiply_add", record["threads"])
    return max(record["flops"] * peak["ns"], (record["bytes"] or 0) * triad["ns"]) / record["ns"]
