"""Batches of runs: table, resume, refusals, interruption, locks, a look at a running run.

Usage: run.py PROGRAM PROJECT
"""
import contextlib
import csv
import fcntl
import importlib.util
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

PROGRAM, PROJECT = sys.argv[1], pathlib.Path(sys.argv[2])
DECK = PROJECT / "input" / "tension_strip.key"
SHORT = "--set n_x=4 --set end_time=1e-4"
MIDDLE = "--set n_x=8 --set end_time=1e-3"
LONG = "--set n_x=40 --set end_time=0.1"


def igaform(folder, *words, code=0):
    done = subprocess.run([PROGRAM, *map(str, words)], cwd=folder, capture_output=True, text=True,
                          timeout=100)
    assert done.returncode == code, f"{words}: exit code {done.returncode}, not {code}\n" \
                                    f"{done.stdout}\n{done.stderr}"
    return done.stdout + done.stderr


def write_list(folder, *lines):
    (folder / "list.txt").write_text("# a sweep\n\n" + "\n".join(lines) + "\n")


def table(folder):
    with open(folder / "list_summary.csv", newline="") as file:
        return {row["result"]: row for row in csv.DictReader(file)}


def runs_once_and_not_again(folder):
    odd = "b c;'d\".h5"
    write_list(folder, f"{DECK} {SHORT} --out a.h5   # the first",
               f"{DECK} {SHORT} --set n_y=3 --out \"b c;'d\"'\"'.h5", "nowhere.key --out n.h5")
    said = igaform(folder, "batch", "list.txt", "--jobs", 2, code=1)
    assert "3 runs: 2 completed, 1 refused" in said, said
    rows = table(folder)
    assert set(rows) == {"a.h5", odd, "n.h5"}, rows
    assert rows[odd]["status"] == "completed" and int(rows[odd]["steps"]) > 100, rows
    assert "nowhere.key" in rows["n.h5"]["message"], rows
    left = sorted(path.name for path in folder.iterdir())
    assert left == sorted(["a.h5", "a.log", odd, odd[:-3] + ".log", "n.err", "list.txt",
                           "list_summary.csv", "a.err", odd[:-3] + ".err"]), left
    told = (folder / "a.err").read_text().splitlines()    # a warning that a quiet run tells too
    assert len(told) == 2 and told[0].startswith("igaform batch: ") and f" {DECK} " in told[0], told
    assert told[1].startswith("igaform: warning: ") and "kinetic energy" in told[1], told
    before = (folder / "a.h5").stat().st_mtime_ns
    said = igaform(folder, "batch", "list.txt", code=1)
    assert "[1/1] nowhere.key" in said, said
    assert (folder / "a.h5").stat().st_mtime_ns == before
    (folder / "list.txt").write_text(f"{DECK} {SHORT} --set n_y=4 --out a.h5\n")
    said = igaform(folder, "batch", "list.txt")
    assert "[1/1]" in said and (folder / "a.h5").stat().st_mtime_ns > before, said


def one_file_has_one_writer(folder):
    (folder / "sub").mkdir()
    (folder / "link").symlink_to("sub")
    for one, other in (("a.h5", "./sub/../a.h5"), ("sub/a.h5", "link/a.h5"), ("a.h5", "a"),
                       ("a.h5", str(folder / "a.h5")), ("a.h5", "a.ckpt")):
        write_list(folder, f"{DECK} --out {one}", f"{DECK} --out {other}")
        said = igaform(folder, "batch", "list.txt", code=1)
        assert "list.txt:4: " in said and "line 3" in said, said
    write_list(folder, f"{DECK} --colour red")
    said = igaform(folder, "batch", "list.txt", code=1)
    assert "list.txt:3: " in said and "--colour" in said, said
    write_list(folder, f"{DECK} 'a b")
    assert "list.txt:3: a quote" in igaform(folder, "batch", "list.txt", code=1)
    assert not list(folder.glob("**/*.h5"))
    (folder / "list_summary.csv").write_text("mine\n")
    write_list(folder, f"{DECK} {SHORT} --out a.h5")
    assert "left alone" in igaform(folder, "batch", "list.txt", code=1)
    assert (folder / "list_summary.csv").read_text() == "mine\n"


def a_name_keeps_its_points(folder):
    """The files of mu0.05 and mu0.10 have nothing in common."""
    for n in (20, 21):
        igaform(folder, DECK, "--set", f"n_x={n}", "--quiet", "--out", f"mu0.{n}", "--wall", 1e-4,
                code=3)
    left = sorted(path.name for path in folder.iterdir())
    assert left == sorted(f"mu0.{n}{ending}" for n in (20, 21)
                          for ending in (".h5", ".log", ".ckpt.h5")), left
    for n in (20, 21):
        igaform(folder, DECK, "--set", f"n_x={n}", "--quiet", "--out", f"mu0.{n}", "--wall", 1e-4,
                "--restart", f"mu0.{n}.ckpt.h5", code=3)
    assert left == sorted(path.name for path in folder.iterdir())


def files_of_others_are_left_alone(folder):
    """Also those beside the result, and while another run of other name writes them."""
    for content in ("mine\n", "mine\n" * 1000):
        (folder / "a.ckpt.h5").write_text(content)
        said = igaform(folder, DECK, *SHORT.split(), "--out", "a.h5", code=1)
        assert "a.ckpt.h5" in said, said
        assert (folder / "a.ckpt.h5").read_text() == content
    assert [path.name for path in folder.iterdir()] == ["a.ckpt.h5"]
    (folder / "a.ckpt.h5").unlink()
    igaform(folder, DECK, *SHORT.split(), "--out", "a.ckpt.h5", "--quiet")
    whole = (folder / "a.ckpt.h5").read_bytes()
    said = igaform(folder, DECK, *SHORT.split(), "--out", "a.h5", code=1)
    assert "a.ckpt.h5" in said and (folder / "a.ckpt.h5").read_bytes() == whole, said
    first = subprocess.Popen([PROGRAM, DECK, *LONG.split(), "--out", "b", "--quiet"], cwd=folder)
    try:
        wait_for(lambda: (folder / "b.h5").exists() and (folder / "b.log").read_text())
        log = (folder / "b.log").read_text()
        said = igaform(folder, DECK, "--out", "b.h5", code=1)
        assert "another program" in said, said
        assert (folder / "b.log").read_text().startswith(log)
    finally:
        first.kill()
        first.wait()
    igaform(folder, DECK, *SHORT.split(), "--out", "b.h5", "--quiet")


def pipes_keep_nobody_waiting(folder):
    os.mkfifo(folder / "pipe")
    os.mkfifo(folder / "c.log")
    os.mkfifo(folder / "d.ckpt.h5")
    os.mkfifo(folder / "e.h5")
    for words, told in ((("--restart", "pipe"), "checkpoint 'pipe'"),
                        (("--out", "e"), "a pipe"),
                        (("--out", "c.h5"), "a pipe"),
                        (("--out", "d.h5"), "a pipe"),
                        (("--user", "pipe"), "pipe 'pipe'"), (("--user", "."), "folder '.'"),
                        (("--restart", "."), "folder"),
                        (("--restart", "nix"), "checkpoint 'nix'")):
        said = igaform(folder, DECK, *words, code=1)
        assert told in said, said
    for line, told in (("*INCLUDE, INPUT=pipe", "pipe `pipe`"),
                       ("*INCLUDE, INPUT=/dev/tty", "device `/dev/tty`"),
                       ("*TOOL, NAME=die, TYPE=IGES, INPUT=pipe", "pipe `pipe`")):
        (folder / "a.key").write_text(f"{line}\n{DECK.read_text()}")
        said = igaform(folder, "a.key", code=1)
        assert told in said, said
    (folder / "a.key").write_text("pipe --out a.h5\n")
    said = igaform(folder, "batch", "a.key", code=1)
    assert "a.key:1: " in said and "'pipe' is a pipe" in said, said
    left = sorted(path.name for path in folder.iterdir())
    assert left == ["a.key", "c.log", "d.ckpt.h5", "e.h5", "pipe"], left


def a_deck_is_read_but_once(folder):
    """So it may come from a pipe, and its result is that of the file."""
    text = DECK.read_text()
    for name in ("named", "other"):
        os.mkfifo(folder / name)
        writer = threading.Thread(target=(folder / name).write_text, daemon=True,
                                  args=(text if name == "named" else text + "** another\n",))
        writer.start()
        igaform(folder, name, *SHORT.split(), "--quiet")
    subprocess.run([PROGRAM, "/dev/stdin", *SHORT.split(), "--quiet"], input=text, text=True,
                   cwd=folder, check=True, timeout=100)
    (folder / "a.key").write_text(text)
    igaform(folder, "a.key", *SHORT.split(), "--quiet")
    for name, status in (("a", "completed"), ("named", "completed"), ("stdin", "completed"),
                         ("other", "due")):
        write_list(folder, f"a.key {SHORT} --out {name}.h5")
        said = igaform(folder, "batch", "list.txt", "--summary",
                       code=0 if status == "completed" else 3)
        assert f"1 run: 1 {status}" in said, said


def names_of_decks_keep_their_points(folder):
    for name in ("mu0.05", "mu0.10", "run.1", "run.2", "plain"):
        (folder / name).write_text(DECK.read_text())
        igaform(folder, name, *SHORT.split(), "--quiet")
        assert (folder / f"{name}.h5").exists() and (folder / f"{name}.log").exists(), name
    write_list(folder, "mu0.05", "mu0.10", "run.1", "run.2", "plain")
    said = igaform(folder, "batch", "list.txt", "--summary", code=3)
    assert "5 runs: 5 due" in said, said


def a_line_may_be_long(folder):
    write_list(folder, f"{DECK} {SHORT} {' ' * 5000} --out a.h5")
    igaform(folder, "batch", "list.txt")
    rows = table(folder)
    assert rows["a.h5"]["status"] == "completed", rows
    said = igaform(folder, "batch", "nowhere.txt", code=1)
    assert "`nowhere.txt`" in said, said


def an_array_of_jobs_shares_a_list(folder):
    write_list(folder, *(f"{DECK} {SHORT} --set n_y={n} --out {n}.h5" for n in (2, 3)))
    igaform(folder, "batch", "list.txt", "--only", 2)
    assert not (folder / "2.h5").exists() and (folder / "3.h5").exists()
    assert not (folder / "list_summary.csv").exists()
    said = igaform(folder, "batch", "list.txt", "--summary", code=3)
    assert "2 runs: 1 completed, 1 due" in said, said
    igaform(folder, "batch", "list.txt", "--only", 3, code=1)


def a_batch_passes_its_limits_on(folder):
    """--wall to the runs whose lines have none; what would be of no effect is refused."""
    write_list(folder, f"{DECK} {LONG} --out a.h5", f"{DECK} {SHORT} --out b.h5 --wall 5")
    said = igaform(folder, "batch", "list.txt", "--wall", 1e-3, "--quiet", code=3)
    rows = table(folder)
    assert said == "" and rows["a.h5"]["status"] == "interrupted", (said, rows)
    assert "limit of 0.001" in (folder / "a.log").read_text()
    assert rows["b.h5"]["status"] == "completed", rows
    for words in (("--set", "n_x=2"), ("--out", "x.h5"), ("--check",), ("--restart", "a.ckpt.h5")):
        said = igaform(folder, "batch", "list.txt", *words, code=1)
        assert f"option {words[0]} " in said and "igaform batch" in said, said


def the_scripts_of_the_manual_work(folder):
    """The one for Slurm with a stand-in for srun, that for GNU parallel where there is one."""
    manual = (PROJECT / "docs/running.md").read_text()
    script = "#!/bin/bash" + manual.split("    #!/bin/bash")[1].split("\n\n")[0]
    (folder / "sweep.sh").write_text(script.replace("\n    ", "\n") + "\n")
    subprocess.run(["bash", "-n", "sweep.sh"], cwd=folder, check=True)
    tools = folder / "tools"
    tools.mkdir()
    (tools / "srun").write_text('#!/bin/sh\nexec "$@"\n')
    (tools / "srun").chmod(0o755)
    (tools / "igaform").symlink_to(PROGRAM)
    there = os.environ | {"PATH": f"{tools}:{os.environ['PATH']}", "SLURM_CPUS_PER_TASK": "1"}
    (folder / "sweep.txt").write_text("".join(f"{DECK} {SHORT} --set n_y={n} --out {n}.h5\n"
                                              for n in (2, 3, 4)))
    for number in (1, 2):
        subprocess.run(["bash", "sweep.sh"], cwd=folder, check=True, timeout=100,
                       env=there | {"SLURM_ARRAY_TASK_ID": str(number)}, capture_output=True)
    assert "2 completed, 1 due" in igaform(folder, "batch", "sweep.txt", "--summary", code=3)
    line = [line.strip() for line in manual.splitlines() if "| parallel" in line][0]
    subprocess.run(["bash", "-n", "-c", line], check=True)
    if shutil.which("parallel"):
        subprocess.run(line.replace("seq 40", "seq 3").replace("-j 8", "-j 1"), shell=True,
                       check=True, cwd=folder, env=there, timeout=100, capture_output=True)
        igaform(folder, "batch", "sweep.txt", "--summary")


def one_run_that_fails_spoils_no_other(folder):
    """Runs start in the order of the list; what failed is not tried again, what was refused is."""
    write_list(folder, f"{DECK} {SHORT} --out a.h5", f"{DECK} {SHORT} --set strain=-3 --out b.h5",
               "nowhere.key --out n.h5", f"{DECK} {SHORT} --set n_y=3 --out c.h5")
    said = igaform(folder, "batch", "list.txt", code=2)
    assert "4 runs: 2 completed, 1 failed, 1 refused" in said, said
    told = [line.rpartition(": ")[2] for line in said.splitlines() if line.startswith("[")]
    assert told == ["completed", "failed", "refused", "completed"], said
    rows = table(folder)
    assert [rows[f"{name}.h5"]["status"] for name in "abnc"] == told, rows
    assert "inverted element" in rows["b.h5"]["message"] and int(rows["b.h5"]["steps"]) > 10, rows
    assert (folder / "b.ckpt.h5").exists() and is_without_error(folder / "c.err")
    failed = (folder / "b.h5").stat().st_mtime_ns
    said = igaform(folder, "batch", "list.txt", "--jobs", 2, code=2)
    assert said.count("[1/1]") == 1 and "2 completed, 1 failed, 1 refused" in said, said
    assert (folder / "b.h5").stat().st_mtime_ns == failed and table(folder)["b.h5"] == rows["b.h5"]
    igaform(folder, "batch", "list.txt", "--only", 2, code=2)
    igaform(folder, "batch", "list.txt", "--only", 3, code=1)
    igaform(folder, "batch", "list.txt", "--only", 4)
    write_list(folder, f"{DECK} {SHORT} --out nowhere/d.h5",
               f"{DECK} {SHORT} --set n_y=4 --out e.h5")
    said = igaform(folder, "batch", "list.txt", code=1)
    told = [line.rpartition(": ")[2] for line in said.splitlines() if line.startswith("[")]
    assert told == ["refused", "completed"] and "no folder 'nowhere'" in said, said
    assert "no folder" in table(folder)["nowhere/d.h5"]["message"], table(folder)


USER_DECK = """*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*USER MATERIAL, CONSTANTS=5
210000, 0, 2, 60, {kind}
*BLANK, NAME=strip, MATERIAL=steel, TYPE=BOX
x, 0, 10, 2, 2
y, 0, 4, 2, 1
z, 0, 1, 2, 1
*AMPLITUDE, NAME=soft start
0, 0, 2e-5, 1
*BOUNDARY
X_MIN, ENCASTRE
*BOUNDARY, TYPE=VELOCITY, AMPLITUDE=soft start
X_MAX, 1, 1, 100
*DYNAMIC, EXPLICIT
4e-5
*OUTPUT, FRAMES=4, HISTORY=8
"""
START = """
      SUBROUTINE UEXTERNALDB(LOP,LRESTART,TIME,DTIME,KSTEP,KINC)
      INCLUDE 'ABA_PARAM.INC'
      OPEN(16,FILE='table.dat',STATUS='OLD')
      CLOSE(16)
      END
"""


def user_code_that_ends_a_run_has_failed(folder):
    """Be it by a crash, or before the result exists; the first batch tells, and the second."""
    law = (PROJECT / "tests/verification/user_material/files/misbehaves.F").read_text()
    (folder / "law.F").write_text(law)
    (folder / "reads.F").write_text(law + START)
    for kind in (0, 5, 22):
        (folder / f"{kind}.key").write_text(USER_DECK.format(kind=kind))
    write_list(folder, "5.key --user law.F", "22.key --user law.F", "0.key --user reads.F")
    for words in (("--jobs", 2), ("--summary",), ()):
        said = igaform(folder, "batch", "list.txt", *words, code=2)
        assert "3 runs: 3 failed" in said, said
        rows = table(folder)
        assert {row["status"] for row in rows.values()} == {"failed"}, rows
        assert all(word in rows["5.h5"]["message"]
                   for word in ("UMAT", "segmentation fault", "element 2")), rows
        assert "ABORT" in rows["22.h5"]["message"], rows
        assert "Cannot open file 'table.dat'" in rows["0.h5"]["message"], rows
    if importlib.util.find_spec("h5py"):
        watch = [sys.executable, "-m", "post", "watch", folder / "5.h5", "--once"]
        said = subprocess.run(watch, cwd=PROJECT, capture_output=True, text=True, check=True).stdout
        assert "5.h5: " in said and "error" in said and "UMAT" in said, said
    (folder / "table.dat").touch()
    said = igaform(folder, "batch", "list.txt", "--only", 3)
    assert "completed" in said, said
    assert "3 runs: 1 completed, 2 failed" in igaform(folder, "batch", "list.txt", "--summary",
                                                      code=2)


def a_second_signal_leaves_no_run_behind(folder):
    """One that hangs in a user's subroutine is ended, and the call named."""
    law = PROJECT / "tests/verification/user_material/files/misbehaves.F"
    (folder / "a.key").write_text(USER_DECK.format(kind=15))
    write_list(folder, f"a.key --user {law}", f"{DECK} {SHORT}")
    batch = subprocess.Popen([PROGRAM, "batch", "list.txt", "--quiet"], cwd=folder)
    try:
        wait_for(lambda: (folder / "a.msg").exists()
                 and "for ever" in (folder / "a.msg").read_text())     # written in the loop
        runs = runs_of(batch)
        batch.send_signal(signal.SIGTERM)
        wait_for(lambda: "element 2" in (folder / "a.err").read_text())
        time.sleep(1.5)
        batch.send_signal(signal.SIGTERM)
        assert batch.wait(20) == 3
        assert len(runs) == 1 and not pathlib.Path(f"/proc/{runs[0]}").exists()
    finally:
        for run in runs_of(batch) if batch.poll() is None else ():
            os.kill(run, signal.SIGKILL)
        batch.kill()
    rows = table(folder)
    assert rows["a.h5"]["status"] == "interrupted", rows
    assert "UMAT" in rows["a.h5"]["message"] and "element 2" in rows["a.h5"]["message"], rows
    assert rows["tension_strip.h5"]["status"] == "due", rows


def is_without_error(path):
    """Has the run had to warn at most?"""
    return not path.exists() or "error:" not in path.read_text()


def is_stepping(log):
    return log.exists() and log.read_text().count("  dt ") > 2


def what_is_killed_goes_on(folder):
    """First one run of a batch, then the batch with all its runs."""
    write_list(folder, *(f"{DECK} {MIDDLE} --set n_y={n} --out {n}.h5" for n in (3, 4)))
    start = {"cwd": folder, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True,
             "start_new_session": True}
    batch = subprocess.Popen([PROGRAM, "batch", "list.txt", "--jobs", "2"], **start)
    try:
        wait_for(lambda: is_stepping(folder / "3.log"))
        os.kill(next(run for run in runs_of(batch) if is_run_of(run, "3.h5")), signal.SIGKILL)
        said = batch.communicate(timeout=60)[0]
    finally:
        batch.kill()
    assert batch.returncode == 3 and "1 completed, 1 interrupted" in said, said
    assert "ended by signal 9" in said and table(folder)["4.h5"]["status"] == "completed", said
    (folder / "4.h5").rename(folder / "whole.h5")
    (folder / "4.log").unlink()
    batch = subprocess.Popen([PROGRAM, "batch", "list.txt", "--jobs", "2"], **start)
    try:
        wait_for(lambda: is_stepping(folder / "4.log"))
        batch.send_signal(signal.SIGUSR1)
        wait_for_files(folder, "4.ckpt.h5")
        runs = runs_of(batch)
    finally:
        os.killpg(batch.pid, signal.SIGKILL)
        batch.communicate()
    wait_for(lambda: all(has_ended(run) for run in runs))
    said = igaform(folder, "batch", "list.txt", "--jobs", 2)
    assert "2 runs: 2 completed" in said, said
    assert "restart    from 4.ckpt.h5" in (folder / "4.log").read_text()
    assert not list(folder.glob("*.ckpt.h5"))
    assert all(is_without_error(path) for path in folder.glob("*.err"))
    if importlib.util.find_spec("h5py"):
        import h5py
        with h5py.File(folder / "4.h5") as mended, h5py.File(folder / "whole.h5") as whole:
            for name in ("history/time", "history/internal_energy", "nurbs/blank/points"):
                assert (mended[name][:] == whole[name][:]).all(), name


def a_folder_is_a_batch(folder):
    (folder / "decks").mkdir()
    for n in (2, 3):
        text = DECK.read_text().replace("n_x = 16", "n_x = 4").replace("n_y = 4", f"n_y = {n}")
        (folder / "decks" / f"s[{n}].key").write_text(text.replace("1.0e-3", "1.0e-4"))
    igaform(folder, "batch", "decks/", "--jobs", 2)
    assert (folder / "s[2].h5").exists() and (folder / "decks_summary.csv").exists()


@contextlib.contextmanager
def interrupted_batch(folder, n_jobs, n_runs, **options):
    """A batch of long runs under way, which is told to stop by who looks at it."""
    write_list(folder, *(f"{DECK} {LONG} --out {n}.h5" for n in range(1, n_runs + 1)))
    with open(folder / "said", "w") as said:
        batch = subprocess.Popen([PROGRAM, "batch", "list.txt", "--jobs", str(n_jobs)], cwd=folder,
                                 stdout=said, stderr=said, **options)
        try:
            yield batch
            assert batch.wait(20) == 3, (folder / "said").read_text()
        finally:
            batch.kill()


def wait_for_files(folder, *names):
    wait_for(lambda: all((folder / name).exists() for name in names))


def runs_of(batch):
    """Numbers of the processes that a batch has started."""
    children = pathlib.Path(f"/proc/{batch.pid}/task/{batch.pid}/children").read_text()
    return [int(number) for number in children.split()]


def is_run_of(process, word):
    return word in pathlib.Path(f"/proc/{process}/cmdline").read_text().split("\0")


def has_ended(process):
    try:
        status = pathlib.Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return True
    return status.rpartition(")")[2].split()[0] in "ZX"


def open_files(batch):
    """Those of the runs that a batch has started."""
    try:
        return {os.readlink(file) for run in runs_of(batch)
                for file in pathlib.Path(f"/proc/{run}/fd").iterdir()}
    except OSError:      # closed meanwhile
        return set()


def interruption_stops_all(folder):
    with interrupted_batch(folder, 2, 3) as batch:
        wait_for_files(folder, "1.log", "2.log")
        batch.send_signal(signal.SIGINT)
    assert table(folder)["3.h5"]["status"] == "due", table(folder)
    assert table(folder)["1.h5"]["status"] == "interrupted", table(folder)
    with interrupted_batch(folder, 1, 3) as batch:
        wait_for(lambda: "restart    from 1.ckpt.h5" in (folder / "1.log").read_text())
        batch.send_signal(signal.SIGTERM)
    # A checkpoint that takes long to refuse: the stop comes first, and the run is not begun anew.
    size = 600_000_000
    with open(folder / "1.ckpt.h5", "wb") as file:
        file.seek(size)
        file.write(b"igaform checkpoint 1 %20d%20d%s\n" % (size, 0, b"0" * 16))
    with interrupted_batch(folder, 1, 3) as batch:
        wait_for(lambda: str(folder / "1.ckpt.h5") in open_files(batch))
        batch.send_signal(signal.SIGTERM)
    assert "checksum" in (folder / "1.err").read_text()
    assert table(folder)["1.h5"]["status"] == "interrupted", table(folder)


def a_list_that_is_still_read_stops_at_once(folder):
    """Nothing has begun: there is nothing to wait for, not even the list."""
    os.mkfifo(folder / "slow.txt")
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        batch = subprocess.Popen([PROGRAM, "batch", "slow.txt"], cwd=folder, text=True,
                                 stderr=subprocess.PIPE)
        try:
            with open(folder / "slow.txt", "w") as slow:     # which it has opened then
                slow.write(f"{DECK} {LONG} --out 1.h5\n")
                slow.flush()
                batch.send_signal(number)
                said = batch.communicate(timeout=10)[1]
            assert batch.returncode == 3 and said, said
        finally:
            batch.kill()
    assert [path.name for path in folder.iterdir()] == ["slow.txt"]


def a_wish_to_save_reaches_all(folder):
    """From the moment on at which a run exists, and without ending it."""
    with interrupted_batch(folder, 2, 2) as batch:
        wait_for_files(folder, "1.err")
        batch.send_signal(signal.SIGUSR1)
        wait_for_files(folder, "1.ckpt.h5", "1.log", "2.log")
        batch.send_signal(signal.SIGUSR1)
        wait_for_files(folder, "1.ckpt.h5", "2.ckpt.h5")
        assert batch.poll() is None
        batch.send_signal(signal.SIGTERM)


def a_signal_to_the_group_saves_all(folder):
    with interrupted_batch(folder, 2, 2, start_new_session=True) as batch:
        wait_for_files(folder, "1.log", "2.log")
        said = igaform(folder, "batch", "list.txt", code=3)
        assert "2 runs: 2 running" in said, said
        os.killpg(batch.pid, signal.SIGTERM)
    assert {row["status"] for row in table(folder).values()} == {"interrupted"}, table(folder)


def what_has_just_begun_is_under_way(folder):
    """A run holds its log before it has a result."""
    (folder / "list.txt").write_text(f"{DECK} {SHORT} --out a.h5\n")
    with open(folder / "a.log", "w") as log:
        fcntl.flock(log, fcntl.LOCK_SH)
        said = igaform(folder, "batch", "list.txt", code=3)
    assert "1 running" in said, said
    assert not (folder / "a.h5").exists()
    (folder / "a.log").unlink()
    igaform(folder, "batch", "list.txt")


def a_second_run_leaves_the_file_alone(folder):
    first = subprocess.Popen([PROGRAM, DECK, *LONG.split(), "--out", "a.h5", "--quiet"],
                             cwd=folder)
    try:
        wait_for(lambda: (folder / "a.log").exists() and (folder / "a.log").read_text())
        size = (folder / "a.h5").stat().st_size
        said = igaform(folder, DECK, "--out", "./a.h5", code=1)
        assert "another program" in said, said
        assert (folder / "a.h5").stat().st_size >= size
        if importlib.util.find_spec("h5py"):
            wait_for(lambda: "step" in (folder / "a.log").read_text())
            watch = [sys.executable, "-m", "post", "watch", folder / "a.h5"]
            said = subprocess.run([*watch, "--once"], cwd=PROJECT, capture_output=True, text=True,
                                  check=True).stdout
            assert "a.h5: running, 1 frame" in said and "dt " in said and "%" in said, said
            first.kill()
            first.wait()
            said = subprocess.run(watch, cwd=PROJECT, capture_output=True, text=True, timeout=20,
                                  check=True).stdout
            assert "ended" in said and "running" not in said, said
            (folder / "list.h5").write_text("a text")
            (folder / "empty.h5").touch()
            for name in ("a.log", "list.h5", "empty.h5"):
                looked = subprocess.run([*watch[:-1], folder / name], cwd=PROJECT, timeout=20,
                                        capture_output=True, text=True)
                assert looked.returncode == 1 and str(name) in looked.stderr, looked
    finally:
        first.kill()
        first.wait()


def wait_for(condition):
    end = time.monotonic() + 30
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


if __name__ == "__main__":
    for test in (runs_once_and_not_again, one_file_has_one_writer, a_name_keeps_its_points,
                 files_of_others_are_left_alone, pipes_keep_nobody_waiting,
                 a_deck_is_read_but_once, names_of_decks_keep_their_points, a_line_may_be_long,
                 an_array_of_jobs_shares_a_list, a_batch_passes_its_limits_on,
                 one_run_that_fails_spoils_no_other, user_code_that_ends_a_run_has_failed,
                 a_second_signal_leaves_no_run_behind,
                 what_is_killed_goes_on,
                 the_scripts_of_the_manual_work,
                 a_folder_is_a_batch, interruption_stops_all,
                 a_list_that_is_still_read_stops_at_once, a_wish_to_save_reaches_all,
                 a_signal_to_the_group_saves_all, what_has_just_begun_is_under_way,
                 a_second_run_leaves_the_file_alone):
        with tempfile.TemporaryDirectory() as place:
            test(pathlib.Path(os.path.realpath(place)))
        print("passed:", test.__name__.replace("_", " "))
