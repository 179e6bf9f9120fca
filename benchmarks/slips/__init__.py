"""How measurements are spoilt, and what `cosim-gap check` has to say of each."""
