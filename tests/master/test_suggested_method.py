"""The coupling that a package suggests: used unless another one is asked for."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.core.errors import UsageError
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.master.simulation.session import Session

from benchmarks import native

from ..packages import component, connector, description, link, pack, system

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fmus")
    return {f"resources/{n}.fmu": native.linear(folder, 1, n, through=False) for n in ("a", "b")}


@pytest.fixture
def suggesting(tmp_path, fmus):
    """Makes a package whose annotation suggests a method."""

    def made(method):
        ports = connector("u1", "input"), connector("y1", "output")
        parts = [component(n, f"resources/{n}.fmu", *ports) for n in ("a", "b")]
        links = [link("a.y1", "b.u1"), link("b.y1", "a.u1")]
        text = description(system("root", *parts, links=links), stop=1.0, step=0.1)
        said = text.replace('stepSize="0.1"/>', f'stepSize="0.1" method="{method}"/>') if method else text
        return pack(tmp_path / f"{method}.ssp", {"SystemStructure.ssd": said, **fmus})

    return made


def test_the_package_decides_unless_another_is_asked_for(suggesting, tmp_path):
    plain, jacobi = suggesting(None), suggesting("jacobi")

    def method(package, **options):
        return run(package, tmp_path / "out", Options(**options)).summary["method"]

    assert [method(plain), method(jacobi), method(jacobi, method="nepce")] == ["gauss-seidel", "jacobi", "nepce"]
    with Session(jacobi) as session:
        own, asked = (session.run(["a.y1", "b.y1"], 1.0, 0.1, method=m)[1] for m in (None, "jacobi"))
    np.testing.assert_array_equal(own, asked)


def test_one_that_is_not_known_is_refused_in_one_line(suggesting, tmp_path):
    package = suggesting("jakobi")
    with pytest.raises(UsageError, match=r"method 'jakobi' that the package suggests; .* did you mean 'jacobi'"):
        run(package, tmp_path / "out", Options())
    assert any("jakobi" in line for line in check(package).errors)
    assert run(package, tmp_path / "out", Options(method="jacobi")).summary["method"] == "jacobi"
