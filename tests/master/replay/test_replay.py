"""Runs of packages as films: what is drawn agrees with the outputs, and files hold what was asked for."""

from __future__ import annotations

import json
import shutil
import zipfile

import numpy as np
import pytest
from deepsea_cosim.core.display_units import DisplayUnits
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.replay.offscreen import NoPictures
from deepsea_cosim.master.replay.recorded import recorded
from deepsea_cosim.master.replay.replay import drawn, replay, times_of
from deepsea_cosim.master.simulation.run import Options, run

from ...commands import code
from ...packages import component, package, system
from .made import site_distance

DISPLAY = DisplayUnits()


@pytest.fixture(scope="module")
def rig(built, tmp_path_factory):
    """The result folder of a few seconds at the surface, and of a longer beam."""
    folder = tmp_path_factory.mktemp("runs")
    for name, changes in (("plain", ()), ("long", (("arm.beam_length", 2.0),))):
        run(built / "deepsea_0km.ssp", folder / name, Options(stop_time=4.0, step=0.004, changes=changes))
    return folder


@pytest.fixture(scope="module")
def axes(built, tmp_path_factory):
    folder = tmp_path_factory.mktemp("axes")
    run(built / "two_axes.ssp", folder, Options(stop_time=5.0, step=0.004))
    return folder


@pytest.fixture(scope="module")
def shots(rig):
    """Pictures of the beginning and of the end, where this machine can draw."""
    found = replay(rig / "plain", DISPLAY)
    try:
        return [np.asarray(p).astype(int) for p in drawn(found, np.array([0.0, 4.0]), (320, 180), DISPLAY)]
    except NoPictures as error:
        pytest.skip(str(error))


def test_the_cylinder_is_as_long_as_the_outputs_say(rig):
    found = replay(rig / "plain", DISPLAY)
    assert found.remarks == ()
    times = np.linspace(0.0, 4.0, 9)
    x = np.interp(times, found.run.times, found.run.signals["arm.x_h"])
    assert x.max() > 0.05
    length = site_distance(found.film(times), "arm/base", "arm/rod_eye")
    assert length - length[0] == pytest.approx(x - x[0], abs=1e-6)


def test_each_axis_moves_as_its_own_outputs_say(axes):
    found = replay(axes, DISPLAY)
    times = np.linspace(0.0, 5.0, 6)
    film = found.film(times)
    for name in ("first_arm", "second_arm"):
        x = np.interp(times, found.run.times, found.run.signals[f"{name}.x_h"])
        assert np.ptp(x) > 0.02
        length = site_distance(film, f"{name}/base", f"{name}/rod_eye")
        assert length - length[0] == pytest.approx(x - x[0], abs=1e-6)


def test_a_ghost_has_the_parameters_of_its_own_run(rig):
    found = replay(rig / "plain", DISPLAY, rig / "long")
    half = [found.stage.model.geom(f"{front}arm/beam").size[1] for front in ("", "ghost ")]
    assert 2.0 * np.array(half) == pytest.approx([1.605, 2.0])
    assert len(found.legend) == 2


def test_the_machine_is_in_the_pictures_and_moves(shots):
    first, last = shots
    assert first.std() > 10.0
    assert (np.abs(first - last).max(axis=2) > 40).sum() > 200
    yellow = [
        np.argwhere((s[..., 0] > 100) & (s[..., 0] - s[..., 2] > 70) & (s[..., 1] - s[..., 2] > 40)) for s in shots
    ]
    assert yellow[1][:, 0].mean() < yellow[0][:, 0].mean()  # rows count downwards: the beam has risen


def test_files_hold_the_pictures_that_were_asked_for(rig, shots, tmp_path, capsys):
    from PIL import Image

    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    size = ["--size", "128x96", "--fps", "5", "--from", "1", "--to", "3", "--speed", "2"]
    video, gif = tmp_path / "new" / "run.mp4", tmp_path / "run.gif"
    assert main(["replay", str(rig / "plain"), "--video", str(video), "--gif", str(gif), *size]) == 0
    assert "6 pictures of 128 x 96" in capsys.readouterr().out
    assert imageio_ffmpeg.count_frames_and_secs(str(video))[0] == 6
    with Image.open(gif) as image:
        assert (image.n_frames, image.size, image.info["duration"]) == (6, (128, 96), 200)
    assert [p.name for p in video.parent.iterdir()] == ["run.mp4"]


def test_times_are_those_of_the_run_at_even_distances(rig):
    found = recorded(rig / "plain")
    assert times_of(found, None, None, 0.5) == pytest.approx(np.arange(9) * 0.5)
    assert times_of(found, 1.0, 1.0, 0.5).tolist() == [1.0]


def told(arguments, capsys):
    """The line with which a command refuses."""
    assert code(main, ["replay", *map(str, arguments)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    [line] = err.splitlines()
    return line


def test_mistakes_are_one_line(rig, tmp_path, capsys, monkeypatch):
    gif = ["--gif", tmp_path / "x.gif"]
    assert "no result folder" in told([tmp_path, *gif], capsys)
    assert "from 0 to 4 s" in told([rig / "plain", *gif, "--to", "5"], capsys)
    assert "no such file" in told([rig / "plain", *gif, "--package", tmp_path / "no.ssp"], capsys)
    assert "higher --speed" in told([rig / "plain", *gif, "--speed", "1e-5"], capsys)
    assert "end in .mp4" in told([rig / "plain", "--video", tmp_path / "x.avi"], capsys)
    assert "--size" in told([rig / "plain", *gif, "--size", "127x96"], capsys)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert "--video" in told([rig / "plain"], capsys)
    monkeypatch.setenv("MUJOCO_GL", "disable")
    assert "set MUJOCO_GL" in told([rig / "plain", *gif], capsys)


def test_a_package_that_is_gone_is_told_and_may_be_named(rig, built, tmp_path, capsys):
    shutil.copytree(rig / "plain", tmp_path / "moved")
    path = tmp_path / "moved" / "summary.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"package": "gone/away.ssp"}))
    gif = ["--gif", tmp_path / "x.gif", "--to", "9"]
    assert "away.ssp, is gone; --package" in told([tmp_path / "moved", *gif], capsys)
    assert "from 0 to 4 s" in told([tmp_path / "moved", *gif, "--package", built / "deepsea_0km.ssp"], capsys)


def test_what_was_not_recorded_is_named(built, tmp_path, capsys):
    options = Options(stop_time=0.1, step=0.01, record=("hydraulics.P1", "arm.x_h"))
    run(built / "deepsea_0km.ssp", tmp_path / "run", options)
    assert "lacks arm.theta" in told([tmp_path / "run", "--gif", tmp_path / "x.gif"], capsys)


def test_a_package_without_a_scene_is_told(toys, tmp_path, capsys):
    root = system("root", component("o", "resources/O.fmu"))
    path = package(tmp_path / "p.ssp", root, {"resources/O.fmu": toys / "Oscillator.fmu"})
    run(path, tmp_path / "run", Options(stop_time=0.2, step=0.1))
    assert "none of its FMUs carries a scene" in told([tmp_path / "run", "--gif", tmp_path / "x.gif"], capsys)


def test_the_scene_is_no_part_of_the_identity_of_an_fmu(built):
    """What computes is in code.zip and in the libraries; a hash of the code names it."""
    with zipfile.ZipFile(built / "DeepseaArm.fmu") as fmu:
        names = fmu.namelist()
        assert {"resources/replay/scene.xml", "resources/replay/replay.toml"} <= set(names)
        inside = zipfile.ZipFile(fmu.open("resources/code.zip")).namelist()
    assert not [name for name in inside if "replay" in name]


def test_an_annotation_of_a_replay_is_read_or_refused_with_its_line(toys, tmp_path, capsys):
    from deepsea_cosim.core.errors import PackageError
    from deepsea_cosim.ssp.reader import read

    from ...packages import description, pack

    def asked(inside):
        text = description(system("root", component("o", "resources/O.fmu")), answers="x")
        ours = f'org.deepsea-cosim.replay"><Replay>{inside}</Replay>'
        text = text.replace('org.deepsea-cosim.answers"><Answers>x</Answers>', ours)
        path = pack(tmp_path / "p.ssp", {"SystemStructure.ssd": text, "resources/O.fmu": toys / "Oscillator.fmu"})
        return read(path, tmp_path / "out").replay

    scale = '<Scale name="s" unit="Pa" from="0" to="1e5"/>'
    found = asked(f'{scale}<Colour component="o" geom="g" scale="s" is="o.x"/><Label component="o" at="g">here</Label>')
    assert ([s.greatest for s in found.scales], found.colours[0].geom, found.labels[0].text) == (["1e5"], "g", "here")
    for wrong, word in (("<Paint/>", "Paint"), ('<Colour component="o" geom="g" scale="t" is="o.x"/>', "'t'"),
                        ('<Scale unit="Pa"/>', "name")):  # fmt: skip
        shutil.rmtree(tmp_path / "out", ignore_errors=True)
        with pytest.raises(PackageError, match=word):
            asked(wrong)
