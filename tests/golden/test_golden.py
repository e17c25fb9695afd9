"""Golden frames: the gallery's own, and that faults are found and other renderers are not."""

import json
import re
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageDraw

from movimentum.errors import ScriptError
from movimentum.golden.check import BLURRED, check, difference
from movimentum.golden.page import write_report
from movimentum.golden.record import golden_of, record
from tests.broad import broad
from tests.command import movimentum

HERE = Path(__file__).parent
SCRIPTS = sorted((HERE.parents[1] / "scripts").glob("*.mov"))
SECONDS = {"combination-lock", "geneva", "penrose-twenty", "vending-latch", "walking-toy"}
"""Films that take seconds."""
CRANK = """.config(12.5, 200, 160);
Crank : .bar O=[60,80] P=[100,80] .width(6);
Rod   : .bar A=[100,80] B=[180,80];
@0 Crank.O=[60,80]; Crank.angle=90*.t; Rod.A=Crank.P; Rod.B=[_,80]; Rod.B.x > 60;
@1 Crank.opacity = 1;
@2
"""


@broad(
    "script",
    [pytest.param(path, marks=[pytest.mark.slow] * (path.stem in SECONDS)) for path in SCRIPTS],
    every=3,
    ids=lambda path: path.stem,
)
def test_the_gallery_is_as_recorded(script):
    outcome = check(golden_of(script, HERE))
    assert outcome.good, outcome.diagnostics[0].message


@pytest.fixture
def golden(tmp_path):
    (tmp_path / "crank.mov").write_text(CRANK)
    place = golden_of(tmp_path / "crank.mov")
    record(place)
    return place


def changed(golden, old, new):
    text = golden.script.read_text()
    assert old in text
    golden.script.write_text(text.replace(old, new))
    return check(golden)


def test_every_step_has_a_picture(golden):
    about = json.loads((golden.folder / "golden.json").read_text())
    frames = [int(re.findall(r"\d+", file.name)[0]) for file in golden.folder.glob("*.png")]
    assert sorted(frames) == about["pictures"]
    for low, high in ((0, 12.5), (12.5, 25), (25, 26)):
        assert any(low <= frame < high for frame in frames)


def test_what_moves_is_told_with_where_and_when_first(golden):
    outcome = changed(golden, "B=[180,80]", "B=[180.5,80]")
    (told,) = outcome.diagnostics
    assert told.code == "golden/moved"
    assert told.message == (
        "`Rod.B` is 0.5 px from where it was, at t = 0 (frame 0), first seen there; 3 other anchors agree to 1e-09"
    )
    assert outcome.pictures


def test_what_moves_later_is_told_from_then_on(golden):
    (told,) = changed(golden, "@1 Crank.opacity = 1;", "@1 Crank.angle = 90 + 91*.t;").diagnostics
    match = re.fullmatch(
        r"`Crank.angle` is (\S+) degrees from where it was, at t = 1.04 \(frame 13\), .*", told.message
    )
    assert match
    assert abs(float(match[1]) - 0.04) < 1e-9
    assert any("`Rod.B`" in note for note in told.notes)


def test_what_only_looks_different_is_told(golden):
    (told,) = changed(golden, ".width(6)", ".width(9)").diagnostics
    assert told.code == "golden/looks-different"
    assert "255" in told.message


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("Rod.B=[_,80]", "Rod.B=[x,80]", "there is `x` that were not recorded"),
        ("@2\n", "@3\n", "the film has 38 frames, it had 26"),
        ("P=[100,80]", "Q=[100,80]", "no `Crank.P.x` and `Crank.P.y` any more"),
    ],
)
def test_another_scene_is_told(golden, old, new, words):
    text = golden.script.read_text().replace("Crank.P", "Crank.Q") if "Q=" in new else golden.script.read_text()
    golden.script.write_text(text)
    (told,) = changed(golden, old, new).diagnostics
    assert told.code == "golden/changed"
    assert words in told.message


def test_a_broken_claim_is_told(golden):
    with pytest.raises(ScriptError) as caught:
        changed(golden, "@2\n", ".claim Rod.B.x > 1000;\n@2\n")
    assert "claim/broken" in [d.code for d in caught.value.diagnostics]


def test_nothing_recorded_and_what_cannot_be_read(golden, tmp_path):
    (golden.folder / "poses.csv").write_text("frame,time\n0,zero\n")
    with pytest.raises(ScriptError) as caught:
        check(golden)
    assert caught.value.diagnostics[0].code == "golden/unreadable"
    with pytest.raises(ScriptError) as caught:
        check(golden_of(golden.script, tmp_path / "elsewhere"))
    assert caught.value.diagnostics[0].code == "golden/missing"


def test_the_page_shows_expected_actual_and_difference(golden):
    outcome = changed(golden, ".width(6)", ".width(9)")
    page = write_report(outcome).read_text()
    files = re.findall(r'src="([^"]+)"', page)
    assert len(files) == 3 * len(outcome.pictures) > 0
    for name in files:
        with Image.open(golden.folder.with_suffix(".golden-failed") / name) as image:
            assert image.size == (200, 160)
    with Image.open(golden.folder.with_suffix(".golden-failed") / files[2]) as image:
        shown = np.asarray(image)
    assert (shown[0, 0] == 255).all()
    assert (shown[:, :, 1] < 200).any()


# --- the measure -----------------------------------------------------------------------------------------


def drawn(shift=0.0, turn=0.0, bars=3, supersample=8, resample=Image.Resampling.BOX):
    """Bars drawn by Pillow's polygon filler and brought down: a renderer that shares nothing with ours."""
    image = Image.new("RGB", (240 * supersample, 160 * supersample), "white")
    pen = ImageDraw.Draw(image)
    for k in range(bars):
        angle = np.radians(20 + 50 * k + (turn if k == 0 else 0.0))
        along, across = np.array([np.cos(angle), np.sin(angle)]) * 60, np.array([-np.sin(angle), np.cos(angle)]) * 3.5
        at = np.array([70 + 40 * k + (shift if k == 0 else 0.0), 80.0])
        corners = [at + s * along + r * across for s, r in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        color = ["firebrick", "steelblue", "black"][k]
        pen.polygon([tuple(float(v) for v in corner * supersample) for corner in corners], fill=color)
    return image.resize((240, 160), resample)


@pytest.mark.parametrize(
    "other",
    [
        {"supersample": 4},
        {"supersample": 16},
        {"resample": Image.Resampling.BILINEAR},
        {"resample": Image.Resampling.HAMMING},
    ],
)
def test_another_renderers_honest_work_passes(other):
    found = difference(drawn(), drawn(**other))
    print(other, found)
    assert found.differing > 1e-3  # it is another picture
    assert found.acceptable(same_renderer=False)
    assert not found.acceptable(same_renderer=True)


@pytest.mark.parametrize("fault", [{"shift": 0.7}, {"turn": 1.5}, {"bars": 2}], ids=str)
def test_faults_are_caught_by_any_renderer(fault):
    found = difference(drawn(), drawn(supersample=16, **fault))
    print(fault, found)
    assert found.blurred > BLURRED


def test_half_a_pixel_is_caught():
    level = Image.new("RGB", (120, 60), "white")
    moved = level.copy()
    for image, top in ((level, 20.0), (moved, 20.5)):
        pixels = np.full((60, 120), 255.0)
        rows = np.arange(60)
        cover = np.clip(np.minimum(rows + 1, top + 7) - np.maximum(rows, top), 0, 1)
        pixels[:, 10:110] -= 255 * cover[:, None]
        image.paste(Image.fromarray(np.repeat(pixels.round().astype(np.uint8)[:, :, None], 3, axis=2)))
    found = difference(level, moved)
    print(found)
    assert found.blurred > BLURRED


def test_a_picture_is_itself():
    assert difference(drawn(), drawn()).acceptable(same_renderer=True)


# --- the command line and the plugin ---------------------------------------------------------------------


def run_pytest(*arguments, cwd):
    command = [sys.executable, "-m", "pytest", *arguments]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(HERE.parents[1]))
    (tmp_path / "crank.mov").write_text(CRANK)
    (tmp_path / "other.mov").write_text(CRANK)
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    return tmp_path


def test_the_command_line(folder):
    assert movimentum("golden", "check", "crank.mov", cwd=folder).returncode == 1
    done = movimentum("golden", "record", "crank.mov", cwd=folder)
    assert (done.returncode, done.stdout) == (0, "")
    assert movimentum("golden", "check", "crank.mov", cwd=folder).returncode == 0
    (folder / "crank.mov").write_text(CRANK.replace("90*.t", "80*.t"))
    done = movimentum("golden", "check", "crank.mov", cwd=folder)
    assert done.returncode == 1
    assert "golden/moved" in done.stderr
    assert (folder / "crank.golden-failed" / "index.html").is_file()
    assert movimentum("golden", "check", "crank.mov", "--update", cwd=folder).returncode == 0
    assert movimentum("golden", "check", "crank.mov", cwd=folder).returncode == 0


@pytest.mark.slow
def test_the_plugin(folder):
    installed = any(point.name == "movimentum" for point in entry_points(group="pytest11"))
    named = () if installed else ("-p", "movimentum.golden.plugin")
    plugin = ("-q", *named, "-p", "no:randomly", "-p", "no:cacheprovider")
    record(golden_of(folder / "crank.mov"))
    assert run_pytest(*plugin, cwd=folder).returncode == 5  # nothing without the option
    done = run_pytest(*plugin, "--movimentum-golden", "-n2", cwd=folder)
    assert "1 passed" in done.stdout  # the other script has no golden frames
    (folder / "crank.mov").write_text(CRANK.replace("B=[180,80]", "B=[180.5,80]"))
    done = run_pytest(*plugin, "--movimentum-golden", cwd=folder)
    assert "1 failed" in done.stdout
    assert "`Rod.B` is 0.5 px from where it was" in done.stdout
    assert "Traceback" not in done.stdout
