import pytest
from deepsea_cosim.core.errors import ParameterError, UnknownNameError
from deepsea_cosim.core.variables import VariableTable, parameter, signal_in, switch

TABLE = VariableTable(
    (
        signal_in("x", 0.0, "m", -1.0, 1.0, 0.1, "a displacement"),
        parameter("oil.nu0", 22e-6, "m2/s", 1e-7, 1e-2, "viscosity"),
        switch("on", True, "a switch"),
    )
)


def test_value_references_are_places():
    assert [TABLE.index(name) for name in ("x", "oil.nu0", "on")] == [0, 1, 2]
    assert TABLE["oil.nu0"].unit == "m2/s"


@pytest.mark.parametrize("value", [-1.0, 1.0, float("nan"), float("inf")])
def test_message_names_variable_value_and_range(value):
    with pytest.raises(ParameterError) as error:
        TABLE.parameters({"oil.nu0": value})
    for part in ("oil.nu0", f"{value:g}", "1e-07", "0.01", "m2/s"):
        assert part in str(error.value)


def test_unknown_parameter_gets_a_hint():
    with pytest.raises(UnknownNameError, match=r"did you mean 'oil\.nu0'"):
        TABLE.parameters({"oil.nu": 1.0})


def test_an_input_is_no_parameter():
    with pytest.raises(UnknownNameError, match="is an input"):
        TABLE.parameters({"x": 0.0})


def test_names_are_unique():
    with pytest.raises(ValueError, match="named twice"):
        VariableTable((TABLE[0], TABLE[0]))
