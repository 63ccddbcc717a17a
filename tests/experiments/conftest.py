# SPDX-License-Identifier: MIT
import json

import pytest

from experiments.__main__ import main


@pytest.fixture
def measured(tmp_path):
    """Run an experiment by its command: the record that it has written."""

    def run(name, *arguments, data=None):
        given = [] if data is None else ["--data", str(data)]
        assert main(["run", name, *given, "--out", str(tmp_path / "records"), *arguments]) == 0
        return json.loads((tmp_path / "records" / f"{name}.json").read_text())

    return run
