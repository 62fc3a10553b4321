"""A study as its TOML file describes it, checked: all faults are told in one go.

    title = "Mesh of the strip"            # of the pictures
    about = "What is varied."              # a sentence for the manual
    kept_because = "runs with it repeat"   # why the default is kept if others beat it
    deck = "../channel_strip.key"          # relative to this file
    threads = 1                            # of each run
    budget = 5                             # processor time that may be spent [s]
    [set]                                  # parameters of all runs
    frames = 1
    [[runs]]                               # lists are crossed; several tables add up
    n_x = [70, 140]
    [default]                              # parameters by which the deck's own setting is known
    n_x = 140
    [reference]                            # data, run or values
    data = "reference/S1"                  # S1_profile.csv and S1_history.csv
    # run = { n_x = 560 }                  # a finer run, none of the runs above
    # values = { mean_plastic_strain = 0.0983 }     # a closed form
    middle = [150, 450]                    # places along the sheet of the mean plastic strain
    ends = 5                               # left out at each end for shape and thickness
    [limits]                               # errors that are allowed: what is drawn and judged by
    shape = 0.3
    [plot]
    colour = "n_x"                         # parameters that give colour, marker and labels
    [[peers]]                              # what other programs cost, drawn and listed beside
    name = "bricks"
    seconds = 16.5
    shape = 0.46
    [[choose]]                             # a line of the manual's table "choose this when"
    when = "a first look"
    shape = 1.0
"""
import itertools
import os
from dataclasses import dataclass, field

from post.toml_file import KINDS, NUMBER, TomlReader, hint, read_toml

# Name: what it is, whether its unit is that of a length (else it is per cent).
MEASURES = {
    "shape": ("rms distance of the mid-surface", True),
    "mean_plastic_strain": ("error of the mean plastic strain", False),
    "external_work": ("error of the external work", False),
    "penetration": ("deepest penetration over the thickness", False),
    "thickness": ("rms error of the thickness", True),
}
KEYS = {"title": str, "about": str, "deck": str, "threads": int, "set": dict, "runs": list,
        "default": dict, "kept_because": str, "reference": dict, "limits": dict, "plot": dict,
        "choose": list, "budget": (int, float), "peers": list}
REQUIRED = ("title", "deck", "runs", "reference", "limits")
REFERENCE_KEYS = {"data": str, "run": dict, "values": dict, "middle": list, "ends": (int, float),
                  "shift": bool}
SOURCES = ("data", "run", "values")
PLOT_KEYS = {"colour": str, "marker": str, "label": list}


@dataclass
class Reference:
    data: str = ""                               # path of the files, up to _profile.csv
    run: dict = field(default_factory=dict)      # parameters of a finer run
    values: dict = field(default_factory=dict)   # by measure
    middle: tuple = (float("-inf"), float("inf"))
    ends: float = 0.0
    shift: bool = True                           # take the rigid shift along the sheet out


@dataclass
class Study:
    path: str
    title: str
    deck: str
    runs: list            # (deck, parameters) of each run, all of them different
    reference: Reference
    limits: dict
    about: str = ""
    threads: int = 1
    set: dict = field(default_factory=dict)
    default: dict = field(default_factory=dict)
    kept_because: str = ""                            # a default that others beat
    plot: dict = field(default_factory=dict)
    choose: list = field(default_factory=list)
    budget: float = 0.0                               # processor time [s], 0: none
    peers: list = field(default_factory=list)         # (name, seconds, errors by measure)

    @property
    def name(self):
        return os.path.basename(self.path).removesuffix(".toml")

    @property
    def parameters(self):
        """Names of the parameters that differ between the runs, in the order of the file."""
        names = dict.fromkeys(name for _, run in self.runs for name in run)
        return [name for name in names if len({run.get(name) for _, run in self.runs}) > 1]


def read_study(path):
    """The study of a file; `ResultsError` with all its faults."""
    return read_toml(path, "study", Reader)


class Reader(TomlReader):
    """Takes the tables of a study apart and notes what is wrong."""

    def take(self, source):
        source = self.known(source, KEYS, "")
        for key in REQUIRED:
            if key not in source:
                self.fault(key, "nothing", f"{KINDS[KEYS[key]]}, which every study needs")
        if source.get("threads", 1) < 1:
            self.fault("threads", source["threads"], "at least 1")
        common = self.parameters(source.get("set", {}), "set")
        runs = self.runs(source.get("runs", []), source.get("deck"), common)
        study = Study(
            path=self.path, title=source.get("title", ""), about=source.get("about", ""),
            deck=self.file(source.get("deck"), "deck"), runs=runs, set=common,
            threads=source.get("threads", 1), reference=self.reference(source.get("reference")),
            limits=self.limits(source.get("limits", {}), "limits"),
            default=self.parameters(source.get("default", {}), "default"),
            kept_because=source.get("kept_because", ""),
            plot=self.known(source.get("plot", {}), PLOT_KEYS, "plot"),
            choose=[self.choice(one, f"choose {i}") for i, one in
                    enumerate(source.get("choose", []), 1)],
            budget=source.get("budget", 0.0),
            peers=[self.peer(one, f"peers {i}") for i, one in
                   enumerate(source.get("peers", []), 1)])
        if not self.faults:
            self.check_names(study)
        return study

    def file(self, name, key):
        if name is None:
            return ""
        path = os.path.normpath(os.path.join(os.path.dirname(self.path), name))
        if not os.path.isfile(path):
            self.fault(key, f"'{name}', and there is no file '{path}'", "an existing file")
        return path

    def parameters(self, table, where):
        """Parameters with one value each."""
        good = {}
        for name, value in table.items():
            if not isinstance(value, (str, int, float)):
                self.fault(f"{where}.{name}", repr(value), "a number or a text")
            else:
                good[name] = value
        return good

    def runs(self, tables, deck, common):
        """The runs of all tables, each with the common parameters, none of them twice."""
        found = {}
        for i, table in enumerate(tables, 1):
            if not isinstance(table, dict):
                self.fault(f"runs {i}", repr(table), "a table, written as [[runs]]")
                continue
            table = dict(table)
            own_deck = table.pop("deck", deck)
            path = self.file(own_deck, "deck" if own_deck == deck else f"runs {i}.deck")
            lists = []
            for name, value in table.items():
                values = value if isinstance(value, list) else [value]
                if not values:
                    self.fault(f"runs {i}.{name}", "an empty list", "at least one value")
                lists.append([list(self.parameters({name: one}, f"runs {i}").items())
                              for one in values])
            for choice in itertools.product(*lists):
                run = common | dict(pair for pairs in choice for pair in pairs)
                found[path, tuple(sorted(map(str, run.items())))] = (path, run)
        if tables == []:
            self.fault("runs", "no table", "at least one [[runs]]")
        return list(found.values())

    def reference(self, table):
        if table is None:
            return None
        table = self.known(table, REFERENCE_KEYS, "reference")
        given = [key for key in SOURCES if key in table]
        if len(given) != 1:
            self.fault("reference", " and ".join(given) or "none of data, run, values",
                       "exactly one of data, run, values")
        if "data" in table:
            table["data"] = os.path.normpath(os.path.join(os.path.dirname(self.path),
                                                          table["data"]))
            for kind in ("profile", "history"):
                if not os.path.isfile(f"{table['data']}_{kind}.csv"):
                    self.fault("reference.data", f"no file '{table['data']}_{kind}.csv'",
                               "the name of reference files before _profile.csv")
        if "middle" in table:
            middle = table["middle"]
            if len(middle) != 2 or not all(isinstance(x, NUMBER) for x in middle):
                self.fault("reference.middle", repr(middle), "two numbers")
        table["run"] = self.parameters(table.get("run", {}), "reference.run")
        table["values"] = self.limits(table.get("values", {}), "reference.values")
        return Reference(**table)

    def limits(self, table, where):
        """Measures with a positive number each."""
        good = self.known(table, dict.fromkeys(MEASURES, NUMBER), where)
        for name, value in good.items():
            if value <= 0:
                self.fault(f"{where}.{name}", repr(value), "a positive number")
        return good

    def choice(self, table, where):
        if not isinstance(table, dict):
            self.fault(where, repr(table), "a table, written as [[choose]]")
            return {}
        table = dict(table)
        when = table.pop("when", None)
        if not isinstance(when, str):
            self.fault(f"{where}.when", repr(when), "a text")
        return {"when": when, "limits": self.limits(table, where)}

    def peer(self, table, where):
        """Name, processor time and errors of another program."""
        if not isinstance(table, dict):
            self.fault(where, repr(table), "a table, written as [[peers]]")
            return None
        table = dict(table)
        name, seconds = table.pop("name", None), table.pop("seconds", None)
        if not isinstance(name, str):
            self.fault(f"{where}.name", repr(name), "a text")
        if not isinstance(seconds, NUMBER) or seconds <= 0:
            self.fault(f"{where}.seconds", repr(seconds), "a positive number")
        return name, seconds, self.limits(table, where)

    def check_names(self, study):
        """What is drawn must be parameters of runs; measures must have a reference."""
        names = list(dict.fromkeys(name for _, run in study.runs for name in run))
        drawn = [study.plot.get("colour"), study.plot.get("marker"), *study.plot.get("label", [])]
        for name in filter(None, [*drawn, *study.default]):
            if name not in names:
                self.fault("default" if name in study.default else "plot", f"'{name}'",
                           f"a parameter of the runs: {', '.join(names)}{hint(name, names)}")
        if not study.limits:
            self.fault("limits", "no measure", f"at least one of {', '.join(MEASURES)}")
        for name in study.limits:
            if study.reference.values and name not in (*study.reference.values, "penetration"):
                self.fault(f"limits.{name}", "a measure without a reference",
                           "one of reference.values, or penetration")
