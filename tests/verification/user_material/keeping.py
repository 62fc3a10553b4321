"""Where compiled subroutines are kept, which of them are loaded, and when they are called."""
import hashlib
import os
import shutil

from common import FILES, STEEL, deck, same, user


def libraries_are_kept_and_renewed(bench):
    """Compiled once; again when the source or an included file changes; names of any kind."""
    folder = bench.folder / "it's; a \"folder\", $HOME"
    folder.mkdir()
    source = folder / "my umat.for"
    shutil.copy(FILES / "linear_fixed.for", source)
    bench.run(deck(user(STEEL)), source, result="kept/a.h5", code=1)
    (bench.folder / "kept").mkdir()
    bench.cache = bench.folder / "own" / "cache"
    cache = bench.cache / "igaform"

    def libraries():
        bench.run(deck(user(STEEL)), source, result="kept/a.h5")
        assert (cache.stat().st_mode & 0o777) == 0o700
        assert {path.suffix for path in cache.iterdir()} == {".so", ".txt"}, "something is left"
        return {path.name: path.stat().st_mtime_ns for path in cache.glob("*.so")}

    first = libraries()
    assert len(first) == 1 and libraries() == first, "compiled again without need"
    text = source.read_text().replace("C     Linear", "      INCLUDE 'part.inc'\nC     Linear", 1)
    (folder / "part.inc").write_text("C     nothing\n")
    text = text.replace("      INCLUDE 'part.inc'\n", "").replace(
        "      EMOD=PROPS(1)", "      INCLUDE 'part.inc'\n      EMOD=PROPS(1)")
    source.write_text(text)
    second = libraries()
    assert len(second) == 2, "a changed source is not compiled"
    (folder / "part.inc").write_text("C     something\n")
    assert len(libraries()) == 3, "a changed include file is not seen"

    ready = bench.folder / "ready.so"
    shutil.copy(cache / next(iter(first)), ready)
    expected = bench.values(deck(user(STEEL)), source)
    bench.cache = source          # no folder: a ready library needs no cache and no other program
    nowhere = {"PATH": str(folder)}
    same(bench.values(deck(user(STEEL)), "ready.so", env=nowhere), expected)
    elastic = deck(f"*ELASTIC\n{STEEL}\n" + user(STEEL))
    bench.run(elastic, "ready.so", env=nowhere, options=["--check"])
    bench.says("loaded, not called by this check", "nm (binutils)")


def planted_libraries_are_not_loaded(bench):
    """Nobody else's library is loaded, nor one that was changed: the source is compiled again."""
    law = (FILES / "linear_fixed.for").read_text()
    good, evil = bench.folder / "good.for", bench.folder / "evil.for"
    good.write_text(law)
    evil.write_text(law.replace("      EMOD=PROPS(1)", "      OPEN(88,FILE='owned')\n"
                                "      EMOD=PROPS(1)", 1))
    owned = bench.folder / "owned"
    text = deck(f"*ELASTIC\n{STEEL}\n" + user(STEEL), speed=0.0).replace("4e-5", "1e-6")

    def library_of(source, cache):
        bench.cache = bench.folder / cache
        bench.run(text, source)
        library, = (bench.cache / "igaform").glob("*.so")
        return library

    planted = library_of(evil, "other")
    assert owned.exists(), "the planted law does not work"
    owned.unlink()
    folder = library_of(good, "own").parent
    record, = folder.glob("*.txt")

    def library():
        return folder / f"user_{record.read_text()[:64].lower()}.so"

    def is_made_again(what):
        bench.run(text, good)
        assert not owned.exists(), f"loaded: {what}"
        content = library().read_bytes()
        assert not library().is_symlink() and content != planted.read_bytes(), what
        assert hashlib.sha256(content).hexdigest() == record.read_text().lower(), what

    is_made_again("nothing is wrong")
    library().write_bytes(planted.read_bytes())
    is_made_again("a library in place of another")
    now = library()
    now.unlink()
    now.symlink_to(planted)
    is_made_again("a link")
    now = library()
    now.unlink()
    os.mkfifo(now)
    is_made_again("a pipe")
    shutil.copy(planted, folder)
    record.write_text(planted.name[5:-3])
    record.chmod(0o666)
    is_made_again("a record that others may write")
    assert not (bench.folder / "igaform_cache").exists()
    if os.geteuid() == 0:
        record.write_text(planted.name[5:-3])
        record.chmod(0o600)
        os.chown(record, 12345, -1)
        is_made_again("a record of another user")
    folders_of_others_are_refused(bench, text, good, folder)


def folders_of_others_are_refused(bench, text, source, folder):
    for mode in (0o777, 0o770, 0o1777):
        folder.chmod(mode)
        for options in ([], ["--check"]):
            bench.run(text, source, code=1, options=options)
            bench.says(str(folder), "chmod 700", "XDG_CACHE_HOME")
    folder.chmod(0o700)
    if os.geteuid() == 0:
        os.chown(folder, 12345, -1)
        bench.run(text, source, code=1)
        bench.says(str(folder), "another user")
        os.chown(folder, 0, -1)
    folder.rename(folder.parent / "aside")
    folder.symlink_to("aside")
    bench.run(text, source, code=1)
    bench.says(str(folder), " link")


def checks_call_nothing(bench):
    """--check leaves the user's code alone where the deck gives the stiffness."""
    law = (FILES / "linear_fixed.for").read_text().replace(
        "      EMOD=PROPS(1)",
        "      OPEN(88,FILE='called')\n      CLOSE(88)\n      EMOD=PROPS(1)", 1)
    source = bench.folder / "law.for"
    source.write_text(law + "      SUBROUTINE UEXTERNALDB(LOP,LRESTART,TIME,DTIME,KSTEP,KINC)\n"
                      "      REAL*8 TIME(2),DTIME\n      OPEN(89,FILE='called')\n"
                      "      CLOSE(89)\n      END\n")
    called = bench.folder / "called"
    bench.cache = bench.folder / "own"
    elastic = f"*ELASTIC\n{STEEL}\n" + user(STEEL)
    test = "*MATERIAL TEST, NAME=pull, MATERIAL=steel, TYPE=UNIAXIAL, INCREMENTS=4\n0.001\n"
    bench.run(deck(elastic), source, options=["--check"])
    bench.says("compiled, not called by this check")
    bench.run(deck(elastic, body="") + test, source, options=["--check"], command=["material"])
    bench.says("compiled, not called by this check")
    shutil.copy(next((bench.cache / "igaform").glob("*.so")), bench.folder / "a.so")
    bench.run(deck(elastic), "a.so", options=["--check"])
    assert not called.exists(), "the check calls the user's code"
    bench.run(deck(user(STEEL)), source, options=["--check"])
    bench.says("called by this check: ", "steel", "*ELASTIC")
    assert called.exists()
