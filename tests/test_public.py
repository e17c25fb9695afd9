"""The public names, and that they are all there is."""

import subprocess
import sys

import movimentum


def test_all_is_exact():
    assert sorted(movimentum.__all__) == [
        "Diagnostic", "Examination", "Motion", "MovimentumError", "NoSolutionError", "Poses", "Scene", "ScriptError",
        "Severity", "SourceText", "Timeline", "UsageError", "__version__", "arrange", "build", "examine", "image_size",
        "parse", "solve_timeline",
    ]  # fmt: skip
    for name in movimentum.__all__:
        assert getattr(movimentum, name) is not None


def test_the_stages_in_a_row():
    text = ".config(10); Bar : .bar A=[0,0] B=[50,0]; @0 Bar.A=[0,0]; Bar.angle=90*.t; @1"
    source = movimentum.SourceText("bar.mov", text)
    scene = movimentum.build(movimentum.parse(source), source, movimentum.image_size)
    motion = movimentum.solve_timeline(movimentum.arrange(scene))
    assert movimentum.examine(motion).fault == 0
    assert abs(motion.poses(10, 11).angle[0, 0] - 90) < 1e-12


def test_importing_the_package_imports_nothing_heavy():
    code = "import sys, movimentum; print([m for m in ('numpy', 'lark', 'PIL', 'click') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
