"""`python -m post study STUDY.toml`: carry the runs of a study out and draw what they cost."""
import os
import signal

from post.program import PROGRAM
from post.results import ResultsError
from post.study import figures, table
from post.study.choice import COST, errors_text, front, recommended, score, setting_text
from post.study.errors import Judge
from post.study.runs import Program, Run, carry_out, check_all, find_finished
from post.study.spec import read_study
from post.style import save


def add_arguments(command):
    command.add_argument("file", metavar="STUDY.toml", nargs="+",
                         help="the study, or several (see docs/studies.md)")
    command.add_argument("--jobs", type=int, default=max(1, os.cpu_count() or 1), metavar="N",
                         help="runs side by side (default: the cores of the machine)")
    command.add_argument("--igaform", default=PROGRAM, metavar="PROGRAM",
                         help="the program (default: build/native/bin/igaform, else that of PATH)")
    command.add_argument("--work", metavar="DIR",
                         help="folder of results, tables, picture (default: "
                              "STUDY without .toml, here)")
    command.set_defaults(out="")
    command.add_argument("--store", action="store_true",
                         help="put the table into results/ beside the study, for the manual")


def run(arguments):
    if arguments.jobs < 1:
        raise ResultsError(f"--jobs {arguments.jobs}: at least 1 is needed")
    studies = [read_study(path) for path in arguments.file]
    program = Program(arguments.igaform)
    codes = [run_study(study, program, len(studies) > 1, arguments) for study in studies]
    return max(codes)


def run_study(study, program, has_others, arguments):
    """One study: runs, tables, picture; 2 if a run failed."""
    folder = arguments.work or study.name
    if arguments.work and has_others:
        folder = os.path.join(folder, study.name)
    os.makedirs(folder, exist_ok=True)
    signal.signal(signal.SIGTERM, signal.default_int_handler)   # as Ctrl-C: no run goes on alone
    runs = [Run(deck, parameters, study.threads, program, folder)
            for deck, parameters in study.runs]
    reference = reference_run(study, program, folder, runs)
    everything = runs + ([reference] if reference else [])
    find_finished(everything, program, folder)
    due = [one for one in everything if not one.is_finished]
    print(f"{study.title}: {len(everything)} runs, {len(everything) - len(due)} of them finished "
          "before", flush=True)
    if due:
        check_all(due, arguments.jobs)
        carry_out(everything, due, program, folder, arguments.jobs)
    return report(study, runs, reference, program, folder, arguments)


def reference_run(study, program, folder, runs):
    """The finer run that errors are measured against; it may not be one of those judged."""
    if not study.reference.run:
        return None
    reference = Run(study.deck, study.set | study.reference.run, study.threads, program, folder)
    if reference.identity in [run.identity for run in runs]:
        raise ResultsError(f"{study.path}: reference.run: found a run that is one of those drawn "
                           f"({reference.name}); expected a finer one")
    return reference


def report(study, runs, reference, program, folder, arguments):
    """Table, pictures and a summary of all finished runs."""
    if reference and reference.status != "completed":
        raise ResultsError(f"the reference run {reference.name} did not come to its end, see "
                           f"{reference.base}.err")
    judge = Judge(study.reference, reference.result if reference else None)
    rows = [table.make_row(run, judge) for run in runs]
    if reference:
        check_finer(judge.errors(reference.result), rows, study, reference)
    base = os.path.join(folder, study.name)
    table.write_csv(rows, f"{base}.csv")
    table.write_hdf5(rows, study, program.version, f"{base}.h5")
    print(f"tables written: {base}.csv, {base}.h5")
    if arguments.store:
        store = os.path.join(os.path.dirname(study.path), "results")
        os.makedirs(store, exist_ok=True)
        table.write_csv(rows, os.path.join(store, f"{study.name}.csv"))
    save(figures.draw(study, rows), f"{base}.png")
    summarize(study, rows)
    return 0 if all(row["status"] == "completed" for row in rows) else 2


def check_finer(reference_row, rows, study, reference):
    """A reference must not be coarser than what it judges, in space or in time."""
    for row in rows:
        if row["status"] == "completed" and \
                all(row[key] > reference_row[key] for key in ("control_points", "steps")):
            raise ResultsError(
                f"{study.path}: reference.run: found a run ({reference.name}) with fewer control "
                f"points and fewer steps than {setting_text(row, study.parameters)}; expected a "
                "finer one")


def summarize(study, rows):
    """The Pareto front in words."""
    best = recommended(rows, study.limits)
    print(f"\nPareto front, allowed errors: "
          f"{', '.join(f'{name} {limit:g}' for name, limit in study.limits.items())}")
    for row in front(rows, study.limits):
        mark = " <- recommended" if row is best else ""
        print(f"  {row[COST]:8.2f} s  {score(row, study.limits):6.2f} of the allowance  "
              f"{setting_text(row, study.parameters)}: {errors_text(row, study.limits)}{mark}")
    for row in rows:
        if row["status"] != "completed":
            print(f"  {row['status']}: {setting_text(row, study.parameters)}")
