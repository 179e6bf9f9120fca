"""Orders are the same in every process."""

from __future__ import annotations

import os
import subprocess
import sys
from ast import literal_eval


def test_an_order_does_not_depend_on_how_texts_are_hashed():
    code = (
        "from deepsea_cosim.master.system.strongly_connected import in_order\n"
        "print(in_order({'end': {f'part{k}' for k in range(20)}, 'part3': {'part5', 'part7', 'part11'}}))"
    )
    made = {
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True,
            env={**os.environ, "PYTHONHASHSEED": str(seed)},
        ).stdout
        for seed in range(4)
    }  # fmt: skip
    assert len(made) == 1
    order = literal_eval(made.pop())
    assert order.index("part3") > max(order.index(f"part{k}") for k in (5, 7, 11))
    assert order[-1] == "end"
