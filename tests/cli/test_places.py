"""`run --for PLACE`: what was written really is what the place takes, whatever the film is like."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

import movimentum as mv
from movimentum.records import replace
from movimentum.workflow.places import PLACES
from tests.broad import broad
from tests.command import command, environment, movimentum

ARM = "Arm : .bar O=[0,0] P=[{r},0]; @0 Arm.O=[{x},{y}]; Arm.angle=90*.t; @{end}"
FILMS = {
    "usual": ".config(25, 400, 320);" + ARM.format(r=90, x=200, y=160, end=2),
    "fitted": ARM.format(r=90, x=0, y=0, end=1),
    "short": ".config(25, 200, 200);" + ARM.format(r=60, x=100, y=100, end="0.2"),
    "tiny": ".config(10, 16, 12);" + ARM.format(r=5, x=8, y=6, end=1),
    "wide": ".config(25, 1600, 40);" + ARM.format(r=90, x=200, y=20, end=1),
    "tall": ".config(25, 40, 1600);" + ARM.format(r=90, x=20, y=300, end=1),
    "fast": ".config(120, 300, 200);" + ARM.format(r=60, x=150, y=100, end=1),
    "slow": ".config(2, 300, 200);" + ARM.format(r=60, x=150, y=100, end=3),
}
QUICK = ("fitted", "short", "wide")
LARGE = {
    "huge": ".config(25, 9000, 9000);" + ARM.format(r=900, x=4500, y=4500, end=1),
    "long": ".config(25, 400, 320);" + ARM.format(r=90, x=200, y=160, end=70),
    "very long": ".config(20, 500, 500);" + ARM.format(r=90, x=200, y=160, end=400),
}


def run(folder: Path, script: str, *options: str):
    (folder / "arm.mov").write_text(script)
    done = movimentum("run", "arm.mov", *options, cwd=folder, timeout=600)  # 8,000 frames in high definition
    assert "Traceback" not in done.stderr
    return done


def probed(path: Path) -> dict[str, object]:
    if shutil.which("ffprobe") is None:
        pytest.skip("no ffprobe")
    told = subprocess.run(
        ["ffprobe", "-v", "error", "-count_frames", "-show_streams", "-of", "json", str(path)],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return json.loads(told.stdout)["streams"][0]


def keeps_limits(place: str, folder: Path, said: str) -> None:
    """What the files say, read by other programs."""
    (note,) = re.findall(r"^note\[place/chosen\]: for .*$", said, re.MULTILINE)
    file = re.findall(r"^(\S+): [\d,]+ frame", said, re.MULTILINE)[-1]
    width, height = map(int, re.search(r"(\d+) x (\d+) pixels", note).groups())
    path = folder / file
    if place == "wikipedia":
        if path.suffix == ".gif":
            with Image.open(path) as gif:
                assert gif.size == (width, height)
                assert gif.width * gif.height * gif.n_frames <= 100e6
        else:
            assert probed(path)["codec_name"] == "vp9"
    elif place == "slides":
        found = probed(path)
        assert (found["codec_name"], found["pix_fmt"]) == ("h264", "yuv420p")
        assert found["width"] <= 1920
        assert found["height"] <= 1080
        assert Fraction(found["avg_frame_rate"]) <= 60
    elif place == "social":
        found = probed(path)
        assert found["codec_name"] == "h264"
        assert (found["width"], found["height"]) in ((1080, 1080), (1080, 1350))
        assert 24 <= Fraction(found["avg_frame_rate"]) <= 60
        seconds = int(found["nb_read_frames"]) / Fraction(found["avg_frame_rate"])
        assert 3 <= seconds <= 60
        assert path.stat().st_size <= 30e6
    elif place == "latex":
        line = next(line for line in said.splitlines() if "animategraphics" in line)
        rate, head, first, last = re.search(r"\]\{(.*?)\}\{(.*?)\}\{(.*?)\}\{(.*?)\}", line).groups()
        assert 0 < float(Fraction(rate)) <= 25
        assert int(last) - int(first) < 250
        for number in range(int(first), int(last) + 1):
            with Image.open(folder / f"{head}{number}.png") as picture:
                assert max(picture.size) <= 1200
    elif path.suffix == ".svg":
        assert path.stat().st_size <= 500_000
    else:
        assert path.stat().st_size <= 2_000_000


def quick(place: str, film: str = "") -> Any:
    """Videos for social media are large: of them one is quick."""
    return pytest.param(*filter(None, (place, film)), marks=[pytest.mark.slow] * (place == "social" and film != "wide"))


@pytest.mark.parametrize(("place", "film"), [quick(place, film) for place in PLACES for film in QUICK])
def test_what_is_written_is_what_the_place_takes(place: str, film: str, tmp_path: Path):
    if place in ("slides", "social"):
        pytest.importorskip("av")
    done = run(tmp_path, FILMS[film], "--for", place)
    assert done.returncode == 0, done.stderr
    keeps_limits(place, tmp_path, done.stderr)


@pytest.mark.slow
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("film", [*FILMS, *LARGE])
def test_every_film_becomes_what_the_place_takes(place: str, film: str, tmp_path: Path):
    pytest.importorskip("av")
    done = run(tmp_path, {**FILMS, **LARGE}[film], "--for", place)
    assert done.returncode == 0, done.stderr
    keeps_limits(place, tmp_path, done.stderr)


@pytest.mark.parametrize(
    ("place", "options", "code", "advice"),
    [
        ("wikipedia", ("--scale", "10"), "place/limit", "--scale 6.4"),
        ("wikipedia", ("-o", "x.mp4"), "place/format", "-o x.gif"),
        ("wikipedia", ("-o", "x.svg"), "place/format", "-o x.gif"),
        ("wikipedia", ("-o", "x.pdf"), "place/format", "-o x.gif"),
        ("web", ("-o", "x.pdf"), "place/format", "-o x.svg"),
        ("latex", ("-o", "x.gif"), "place/format", "-o x"),
        ("web", ("--fps", "100"), "place/limit", "--fps 25"),
    ],
)
def test_what_is_asked_for_is_done_and_told_where_it_breaks_a_limit(
    place: str, options: tuple[str, ...], code: str, advice: str, tmp_path: Path
):
    if "mp4" in " ".join(options):
        pytest.importorskip("av")
    done = run(tmp_path, FILMS["short"], "--for", place, *options)
    assert done.returncode == 0
    assert f"warning[{code}]" in done.stderr
    assert advice in done.stderr
    left = set(tmp_path.iterdir())
    assert run(tmp_path, FILMS["short"], "--for", place, *options, "--strict").returncode == 1
    assert set(tmp_path.iterdir()) == left


def test_a_gif_over_the_limit_is_noted_once_and_its_help_brings_it_below(tmp_path: Path):
    large = ".config(50, 1500, 1500);" + ARM.format(r=700, x=750, y=750, end=1)
    done = run(tmp_path, large)
    assert done.stderr.count("note[render/gif-area]") == 1
    (scale,) = re.findall(r"help: --scale ([\d.]+)$", done.stderr, re.MULTILINE)[-1:]
    (rate,) = re.findall(r"help: --fps (\d+)$", done.stderr, re.MULTILINE)[-1:]
    for option in (("--scale", scale), ("--fps", rate)):
        again = run(tmp_path, large, *option)
        assert "render/gif-area" not in again.stderr
        with Image.open(tmp_path / "arm.gif") as gif:
            assert 60e6 < gif.width * gif.height * gif.n_frames <= 100e6


@pytest.mark.parametrize("place", [quick(place) for place in PLACES])
def test_a_still_and_a_range_and_a_clear_ground(place: str, tmp_path: Path):
    still = run(tmp_path, FILMS["usual"], "--for", place, "--at", "0.3")
    assert still.returncode == 0
    assert "1 frame" in still.stderr
    if place in ("slides", "social"):
        pytest.importorskip("av")
    some = run(tmp_path, FILMS["usual"], "--for", place, "--frames", "10:20", "--transparent")
    assert some.returncode == 0, some.stderr
    if place == "latex":
        assert "{10}{19}" in some.stderr
        assert sorted(each.name for each in (tmp_path / "arm-frames").iterdir())[0] == "arm-10.png"


def test_without_the_extra_slides_get_a_gif_and_are_told_how_to_get_more(tmp_path: Path):
    blocked = tmp_path / "blocked"
    blocked.mkdir()
    (blocked / "sitecustomize.py").write_text(
        "import importlib.util as u\nreal = u.find_spec\n"
        "u.find_spec = lambda name, *a: None if name == 'av' else real(name, *a)\n"
    )
    (tmp_path / "arm.mov").write_text(FILMS["short"])
    env = {**environment(), "PYTHONPATH": f"{blocked}:{environment().get('PYTHONPATH', '')}"}
    done = subprocess.run(
        command("run", "arm.mov", "--for", "slides"), cwd=tmp_path, env=env, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "pip install 'movimentum[video]'" in done.stderr
    with Image.open(tmp_path / "arm.gif") as gif:
        assert gif.width <= 960
        assert gif.height <= 540


def test_a_script_with_a_dot_in_its_name_and_a_stem_of_ones_own(tmp_path: Path):
    (tmp_path / "arm.v2.mov").write_text(FILMS["short"])
    assert movimentum("run", "arm.v2.mov", "--for", "web", cwd=tmp_path).returncode == 0
    assert (tmp_path / "arm.v2.svg").exists()
    assert movimentum("run", "arm.v2.mov", "--for", "web", "-o", "lever", cwd=tmp_path).returncode == 0
    assert (tmp_path / "lever.svg").exists()


@broad("share", [0.7, 0.25, 0.0], first=1)
def test_a_heavy_film_goes_to_the_next_format_and_is_drawn_smaller(
    share: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    web = PLACES["web"]
    motion = mv.loads(FILMS["usual"]).solve()
    monkeypatch.setitem(PLACES, "web", replace(web, takes=(replace(web.takes[0], weight=100), web.takes[1])))
    whole = motion.render(tmp_path / "whole", for_="web").path
    assert whole.suffix == ".webp"
    most = int(share * whole.stat().st_size) + 1
    lighter = replace(web, takes=(replace(web.takes[0], weight=100), replace(web.takes[1], weight=most)))
    monkeypatch.setitem(PLACES, "web", lighter)
    written = motion.render(tmp_path / "arm", for_="web")
    told = written.diagnostics[-1]
    assert any("as an SVG it would have more than 0.0001 MB" in each for each in told.notes)
    assert any("smaller, for at most" in each for each in told.notes)
    size = written.path.stat().st_size
    assert size < whole.stat().st_size
    warned = [each for each in written.diagnostics if each.code == "place/limit"]
    assert (size <= most) == (not warned)  # nothing is smaller than a file with a pixel: then a warning says so
    assert sorted(tmp_path.iterdir()) == [written.path, whole]
    assert share == 0.0 or size <= most


def test_from_python(tmp_path: Path):
    motion = mv.loads(FILMS["short"]).solve()
    written = motion.render(tmp_path / "arm", for_="web")
    assert written.path == tmp_path / "arm.svg"
    assert [item.code for item in written.diagnostics][-1] == "place/chosen"
    with pytest.raises(mv.UsageError, match="usage/place"):
        motion.render(tmp_path / "arm", for_="mars")  # pyright: ignore[reportArgumentType]
