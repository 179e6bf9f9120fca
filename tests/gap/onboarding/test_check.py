"""What looks wrong in a campaign is told with its place, and of a sound one nothing."""

from types import SimpleNamespace

import numpy as np
import pytest
from deepsea_cosim.gap.campaign.campaign import NOTHING_TO_FIT, CampaignError
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.checks.run_mistakes import check_runs
from deepsea_cosim.gap.cli import main
from deepsea_cosim.gap.onboarding.check import check

HEAD = 'name = "toy"\nsystem = "{system}"\n'
INPUT = '[[channel]]\ncolumn = "u"\nconnector = "o.u"\nunit = "N"\nrole = "input"\n'
OUTPUT = '[[channel]]\ncolumn = "x"\nconnector = "o.x"\nunit = "mm"\n'


@pytest.fixture
def campaign(rig, tmp_path):
    """Writes a campaign of the toy's runs, changed (table of t [s], u [N], x [mm] and more), with other channels."""

    def write(change=lambda t: t, channels=INPUT + OUTPUT, names="time,u,x", more="", system=None):
        text = HEAD.format(system=system or rig.packed) + channels
        for i, run in enumerate(rig.runs):
            table = change(run * np.array([1.0, 1.0, 1e3]))
            np.savetxt(tmp_path / f"run{i}.csv", table, "%.9g", ",", header=names, comments="")
            text += f'[[run]]\nfile = "run{i}.csv"\n' + more
        path = tmp_path / "campaign.toml"
        path.write_text(text)
        return path

    return write


def told(path):
    """What looks wrong: (channel, text) each."""
    return [(f.channel, f.text) for f in check(read(path)).findings]


def column(j, function):
    """A change of one column."""

    def change(table):
        table = table.copy()
        table[:, j] = function(table[:, j])
        return table

    return change


def test_there_is_no_run_to_fit(campaign):
    assert ("", NOTHING_TO_FIT) in told(campaign(more='use = "holdout"\n'))


def test_nothing_is_wrong(campaign, tmp_path, capsys):
    assert main(["check", str(campaign())]) == 0
    out = capsys.readouterr().out
    assert "Nothing looks wrong" in out
    assert "x" in out
    assert (tmp_path / "check.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("change", "channel", "part"),
    [
        (column(2, lambda x: x / 1e3), "x", "is it in m?"),
        (column(2, lambda x: -x), "x", "scale = -1 turns its sign or that of what drives it"),
        (column(2, lambda x: x[np.arange(len(x)) // 5 * 5]), "x", "new in every 5th row only"),
        (column(2, lambda x: x + np.where(np.arange(len(x)) < 300, 0.0, 500.0)), "x", "it jumps by "),
        (column(2, lambda x: np.full_like(x, 3.0) + 1e-3 * np.arange(len(x))), "x", "does not move"),
        (column(2, lambda x: np.clip(x, -1e9, 40.0)), "x", "clipped"),
        (column(2, lambda x: x + 4000.0), "x", "is a condition of the run missing"),
        (column(2, lambda x: np.roll(x, 20)), "x", " s late: is its clock another one?"),
        (column(2, lambda x: 300.0 * np.sin(np.arange(len(x)) ** 2)), "x", "the column 'spare' moves like o.x"),
        (lambda t: np.delete(t, slice(100, 160), 0), "", "nothing was measured for"),
        (lambda t: t[::8], "x", "sampling is too slow"),
        (column(1, lambda u: u / 1e3), "x", "is the input 'u' in kN"),
    ],
    ids=["unit", "sign", "held", "jump", "rests", "clipped", "level", "late", "column", "gap", "slow", "input"],
)  # fmt: skip
def test_slips(campaign, change, channel, part):
    def spare(table):
        made = change(table)
        return np.column_stack([made, table[:, 2]]) if len(made) == len(table) else np.column_stack([made, made[:, 2]])

    findings = told(campaign(spare, names="time,u,x,spare"))
    assert [f for f in findings if f[0] == channel and part in f[1]], findings


def test_exchanged_files(rig, campaign):
    runs = iter(rig.runs[::-1])
    findings = told(campaign(lambda table: np.column_stack([table[:, :2], 1e3 * next(runs)[:, 2]])))
    assert [text for _, text in findings if "are the files exchanged?" in text], findings


@pytest.mark.parametrize("rate", [0.5, 0.97, 1.003, 1.1])
def test_a_clock_at_another_rate(rate):
    step, t = 1e-3, np.arange(0.0, 8.0, 0.01)
    grid = np.arange(round(20.0 / step) + 1) * step
    signals = np.column_stack([np.sin(grid), np.tanh(grid - 3.0)])
    noise = np.random.default_rng(1).normal(0.0, 1e-5, (len(t), 2))
    series = []
    for k in range(2):
        read = np.interp(rate * t, grid, signals[:, k]) + noise[:, k]
        place = slice(k * len(t), (k + 1) * len(t))
        series.append(
            SimpleNamespace(run=0, channel=k, connector=f"o.{k}", t=t, y=read, noise_std=1e-5, place=place)
        )
    nominal = np.concatenate([np.interp(t, grid, signals[:, k]) for k in range(2)])

    def problem(**of_run):
        made = SimpleNamespace(
            rows=lambda points, step: [[signals]], fit_step=step, connectors=["o.0", "o.1"],
            observations=SimpleNamespace(series=series), runs=[SimpleNamespace(name="run0", inputs=of_run)],
        )  # fmt: skip
        made.of_runs = lambda runs: made
        return made

    (finding,) = check_runs(problem(), nominal)
    assert f"all channels follow the model at {rate:.4g} times its time" in finding.text
    assert not check_runs(problem(u=0.0), nominal)  # what drives it is on that clock, too
    series[1].y = np.interp(t, grid, signals[:, 1]) + noise[:, 1]
    assert not check_runs(problem(), nominal)  # one channel is late, and no clock


def test_marks_for_missing_values(campaign):
    def marked(x):
        return np.where(np.arange(len(x)) % 20 == 7, -999.0, x)

    with pytest.raises(CampaignError, match=r"run0.csv: 'x': 30 readings are -999 mm, the first at .* leave empty"):
        told(campaign(column(2, marked)))
    kept = OUTPUT + 'faulty_readings = "keep"\n'
    assert told(campaign(column(2, marked), INPUT + kept))


def test_another_connector(campaign):
    channels = INPUT + OUTPUT.replace("o.x", "o.v").replace('"mm"', '"mm/s"')
    findings = told(campaign(channels=channels))
    assert any("o.x" in text for _, text in findings), findings


def test_swapped_columns(campaign):
    more = '[[channel]]\ncolumn = "v"\nconnector = "o.v"\nunit = "1"\n'
    channels = INPUT + OUTPUT.replace('"mm"', '"1"') + more

    def swapped(table):
        v = np.gradient(table[:, 2] / 1e3, table[:, 0])
        return np.column_stack([table[:, 0], table[:, 1], v, table[:, 2] / 1e3])

    findings = told(campaign(swapped, channels, "time,u,x,v"))
    assert any("seem to be swapped" in text for _, text in findings), findings


def test_a_gap_below_the_noise(rig, campaign):
    from deepsea_cosim.master.simulation.session import Session

    with Session(rig.packed) as session:

        def modelled(table):
            t, rows = session.run(["o.x"], 12.0, 4e-3, {}, {"o.u": (table[:, 0], table[:, 1])})
            x = 1e3 * np.interp(table[:, 0], t, rows[:, 0]) + np.random.default_rng(1).normal(0.0, 0.2, len(table))
            return np.column_stack([table[:, :2], x])

        findings = told(campaign(modelled))
    assert [text for _, text in findings] == [
        "the model as delivered misses nothing beyond the noise: there is no gap to diagnose"
    ]


def test_parameters_out_of_the_catalogue(campaign):
    findings = told(campaign(more='parameters = { "o.F_c" = 7.5 }\n'))
    assert any("o.F_c = 7.5 is outside the catalogue's bounds, 0 to 5 (friction)" in text for _, text in findings)


def test_time_in_another_unit(campaign, capsys):
    assert main(["check", str(campaign(column(0, lambda t: 1e3 * t)))]) == 1
    assert "with time in ms" in " ".join(capsys.readouterr().out.split())


def test_without_a_catalogue_it_says_so(rig, campaign):
    findings = told(campaign(system=rig.plain))
    assert any("no catalogue of effects" in text for _, text in findings)


def test_exit_codes_and_places(campaign, tmp_path, capsys):
    path = campaign(column(2, lambda x: -x))
    assert main(["check", str(path), "--out", str(tmp_path / "seen")]) == 1
    assert (tmp_path / "seen" / "check.png").is_file()
    assert "scale = -1" in capsys.readouterr().out
    path.write_text(path.read_text().replace('"o.x"', '"o.xx"'))
    assert main(["check", str(path)]) == 2
    error = capsys.readouterr().err
    assert "o.xx" in error
    assert error.count("\n") == 1


def test_the_scale_of_a_channel_turns_its_sign(campaign):
    path = campaign(column(2, lambda x: -x / 20.0), INPUT + OUTPUT + "scale = -20\n")
    assert not told(path)
    path.write_text(path.read_text().replace("scale = -20", "scale = 0"))
    assert main(["check", str(path)]) == 2
