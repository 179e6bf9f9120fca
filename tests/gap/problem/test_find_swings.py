"""Where a machine swings by itself: found where it does, and only there."""

import numpy as np
import pytest
from deepsea_cosim.gap.problem.find_swings import as_compared, compare_swings, find_swings
from deepsea_cosim.gap.problem.observations import RawBlock, average_neighbours, gather
from deepsea_cosim.gap.settings import DEFAULT, SwingSettings

from tests.gap.formula import FormulaProblem, at_any_step

T = np.arange(0.0, 20.0, 0.02)
NOISE = 0.01
SETTINGS = SwingSettings()


def commanded(t=T):
    """What the command makes of the machine: slow, with a ripple."""
    return np.sin(0.3 * t) + 0.02 * np.sin(2.0 * np.pi * 1.3 * t)


def own(frequency=3.0, start=6.0, end=16.0):
    return 0.2 * np.sin(2.0 * np.pi * frequency * T + 1.0) * ((start < T) & (end > T))


def observed(*channels, seed=0, most=len(T)):
    """Readings of channels in one run, averaged to at most so many."""
    random = np.random.default_rng(seed)
    blocks = []
    for k, y in enumerate(channels):
        times, read = average_neighbours(T, y + random.normal(0.0, NOISE, len(T)), most)
        noise = NOISE / np.sqrt(times.shape[1])
        blocks.append(RawBlock(0, k, f"m.{k}", times.mean(1), read, noise, None, True, members=times))
    return gather(blocks)


def swings(measured, model):
    """Swings of one channel."""
    return find_swings(observed(measured), model, SETTINGS)[0]


def test_what_the_model_does_not_do_by_itself_is_a_swing_from_its_beginning_to_its_end():
    (found,) = swings(commanded() + own(), commanded())
    assert found.at[0] == pytest.approx(6.0, abs=2.0)
    assert found.at[-1] == pytest.approx(16.0, abs=2.0)
    assert found.frequency == pytest.approx(3.0, rel=0.02)


def test_a_swing_at_another_frequency_does_not_keep_pace():
    assert len(swings(commanded() + own(3.0), commanded() + own(3.6))) == 1


@pytest.mark.parametrize("delay", [0.0, 0.04, 0.1])
def test_what_follows_the_command_late_is_compared_sample_by_sample(delay):
    late = commanded(T - delay) + 0.2 * np.sin(2.0 * np.pi * 3.0 * (T - delay))
    assert swings(late, commanded() + 0.2 * np.sin(2.0 * np.pi * 3.0 * T)) == []


def test_noise_alone_swings_nowhere():
    for seed in range(10):
        assert find_swings(observed(commanded(), seed=seed), commanded(), SETTINGS) == [[]]


def test_a_rough_signal_has_no_frequency_of_its_own():
    rough = np.convolve(np.random.default_rng(5).normal(0.0, 0.2, len(T)), np.ones(3) / 3.0, "same")
    assert swings(commanded() + rough, commanded()) == []


def test_a_few_periods_are_a_transient():
    assert swings(commanded() + own(start=6.0, end=7.5), commanded()) == []


def test_a_channel_that_shows_several_frequencies_swings_along():
    several = own(3.0) + own(7.0) + own(4.9)
    found = find_swings(observed(commanded() + own(), several), np.tile(commanded(), 2), SETTINGS)
    assert [s.frequency is None for s in found[0]] == [False]
    assert [s.frequency is None for s in found[1]] == [True]
    assert "frequency" not in found[1][0].quantities


@pytest.mark.parametrize("drive", [0.0, 0.2])
def test_what_a_measured_input_drives_does_not_swing_by_itself(drive):
    """The model answers at another phase each time, for its resonance is elsewhere; a slow input drives nothing."""
    t = np.arange(0.0, 20.0, 0.005)
    given = np.sin(0.3 * t) + drive * np.sin(2.0 * np.pi * 3.0 * t) + np.random.default_rng(1).normal(0.0, 0.02, len(t))
    found = find_swings(observed(commanded() + own()), commanded(), SETTINGS, [[(t, given)]])
    assert len(found[0]) == (0 if drive else 1)


def posed(measured, model):
    """The problem of a formula, compared as what swings asks for."""
    observations = observed(measured)
    machine = at_any_step(lambda p: model)
    return compare_swings(FormulaProblem(machine, observations, settings=DEFAULT), np.tile(model, 1))


def test_where_nothing_swings_the_problem_stays_the_same():
    observations = observed(commanded())
    problem = FormulaProblem(at_any_step(lambda p: commanded()), observations)
    assert compare_swings(problem, commanded()) is problem


def test_the_right_machine_out_of_phase_fits_to_the_noise_and_the_delivered_one_does_not():
    problem = posed(commanded() + own(), commanded())
    observations = problem.observations
    assert problem.recorded is not None
    assert len(observations) < len(problem.recorded)
    shifted = commanded() + 0.2 * np.sin(2.0 * np.pi * 3.0 * T + 2.7) * ((T > 6.0) & (T < 16.0))
    left = [np.sqrt(np.mean(observations.whiten(as_compared(problem, x)) ** 2)) for x in (shifted, commanded())]
    by_samples = np.sqrt(np.mean(problem.recorded.whiten(shifted) ** 2))
    assert left[0] < 1.2
    assert left[1] > 5.0
    assert by_samples > 10.0


def test_simulated_rows_and_recorded_samples_are_compared_alike():
    problem = posed(commanded() + own(), commanded())
    read = problem.observations.observe([T], [commanded()[:, None]], {"m.0": 0})
    assert read == pytest.approx(as_compared(problem, commanded()), abs=1e-12)


def test_simulated_rows_are_averaged_as_the_samples_of_a_swing_are():
    observations = observed(commanded() + own(), most=len(T) // 2)
    averaged = observations.observe([T], [commanded()[:, None]], {"m.0": 0})
    problem = compare_swings(FormulaProblem(at_any_step(lambda p: averaged), observations), averaged)
    assert problem.recorded is observations
    read = problem.observations.observe([T], [commanded()[:, None]], {"m.0": 0})
    assert read == pytest.approx(as_compared(problem, averaged), abs=1e-12)


def test_entries_have_the_time_and_channel_of_their_block():
    observations = posed(commanded() + own(), commanded()).observations
    assert [b.place.start for b in observations.blocks[1:]] == [b.place.stop for b in observations.blocks[:-1]]
    for b in observations.blocks:
        assert observations.time[b.place] == pytest.approx(b.t)
        assert set(observations.channel[b.place]) == {b.channel}
    assert observations.blocks[-1].place.stop == len(observations)


@pytest.mark.parametrize("hole", [1.1, 1.3, 1.6, 1.8])
def test_a_hole_in_the_readings_of_a_swing(hole):
    """A window without samples has no amplitude: it would be the logarithm of nothing."""
    there = (T < 10.0) | (10.0 + hole < T)
    random, y = np.random.default_rng(0), commanded() + own()
    read = (y + random.normal(0.0, NOISE, len(T)))[there]
    observations = gather([RawBlock(0, 0, "m.0", T[there], read, NOISE, None, True)])
    problem = FormulaProblem(at_any_step(lambda p: commanded()[there]), observations)
    compared = compare_swings(problem, commanded()[there])
    assert any(b.feature is not None for b in compared.observations.blocks)
    assert np.isfinite(compared.observations.y).all()
    assert np.isfinite(as_compared(compared, y[there])).all()
    assert compared.observations.noise_std.min() > 0.1 * NOISE


@pytest.mark.parametrize("missing", [[10], [3, 30], [len(T) - 20, len(T) - 7]])
def test_a_reading_that_is_missing_near_an_end_leaves_a_swing_whole(missing):
    """There a window has half of its samples anyway."""
    there = np.delete(np.arange(len(T)), missing)
    y = commanded() + 0.2 * np.sin(2.0 * np.pi * 3.0 * T)
    read = (y + np.random.default_rng(0).normal(0.0, NOISE, len(T)))[there]
    observations = gather([RawBlock(0, 0, "m.0", T[there], read, NOISE, None, True)])
    ((found,),) = find_swings(observations, commanded()[there], SETTINGS)
    assert (found.at[0], found.at[-1]) == (T[there][0], T[there][-1])
