from types import SimpleNamespace

import numpy as np
import pytest
from deepsea_cosim.gap.analysis.localisation import bands, change_points, describe, places
from deepsea_cosim.gap.campaign.catalogue import Region
from deepsea_cosim.gap.problem.observations import gather

T = np.arange(2000) / 100.0


def one(residual):
    return gather([(0, 0, "arm.x", T, np.zeros(len(T)), 1.0, None, True)]).blocks[0], residual


def test_bands_of_a_sine():
    block, e = one(np.sin(2 * np.pi * 10.0 * T))
    found = bands([block], e)
    assert found["5-25 Hz"] > 0.99
    assert sum(found.values()) == pytest.approx(1.0)


def test_a_step_is_a_change_point():
    rng = np.random.default_rng(0)
    block, e = one(rng.normal(0.0, 0.3, len(T)) + 4.0 * (T > 12.0))
    found = change_points(block, e)
    assert found[0] == pytest.approx(12.0, abs=0.2)
    assert len(found) == 1
    assert change_points(*one(rng.normal(size=len(T)))) == []


def test_regions_nest_where_the_energy_is():
    energy = np.zeros(len(T))
    masks = {"late": T > 10.0, "odd": (T.astype(int) % 2).astype(bool), "always": T > -1}
    energy[masks["late"] & masks["odd"]] = 1.0
    assert set(describe(energy, masks).split(", ")) == {"late", "odd"}
    assert describe(np.ones(len(T)), masks) == "everywhere"


def test_shares_add_up_and_noise_has_none():
    rng = np.random.default_rng(1)
    blocks = [(0, k, f"s{k}.x", T, np.zeros(len(T)), 1.0, None, True) for k in range(3)]
    problem = SimpleNamespace(observations=gather(blocks), labels=["s0.x", "s1.x", "s2.x"], runs=[SimpleNamespace(name="r")])
    residual = np.concatenate([rng.normal(size=len(T)), 3.0 * np.ones(len(T)), np.zeros(len(T))])
    found = places(problem, residual, {})
    assert sum(p.share for p in found) == pytest.approx(1.0)
    assert found[0].channel == "s1.x"
    assert found[0].share > 0.95
    assert found[0].subsystem == "s1"


def test_a_region_holds_where_it_says():
    x = np.array([-2.0, -0.5, 0.0, 0.5, 2.0])
    assert Region("r", "s", above=1.0).holds(x).tolist() == [False, False, False, False, True]
    assert Region("r", "s", above=1.0, size=True).holds(x).tolist() == [True, False, False, False, True]
    assert Region("r", "s", above=-1.0, below=0.2).holds(x).tolist() == [False, True, True, False, False]
