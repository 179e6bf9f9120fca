"""Two axes on one supply, against the whole as one differential equation."""

from benchmarks.two_axes import errors


def test_the_shipped_step_holds_the_displacement_and_nepce_does_at_twice_that(built):
    """Both cylinders run from 4 s on."""
    plain, nepce = errors(built / "two_axes.ssp", 4.6, (("gauss-seidel", 5e-4), ("nepce", 1e-3)))
    for x in (0, 3):
        assert plain[x] < 0.05e-3
        assert nepce[x] < 0.005e-3
    assert plain[6] < 2e3
