# SPDX-License-Identifier: MIT
"""One schema of options: the same words wherever an option is wrong, and nothing generated is out of date."""

import importlib.util
import inspect
import re
from pathlib import Path

import numpy as np
import pytest

import sdftrack as st
from sdftrack import _core
from sdftrack._internal.option_files import options_as_toml
from sdftrack._internal.option_schema import TABLES, core_schema, schema_of
from sdftrack.contour.lwpr_data import AUTO

ROOT = Path(__file__).resolve().parents[2]

# Everything that takes options by keyword.
MAKERS = {
    "tracker": st.TrackerOptions, "reconstruct": st.ReconstructorOptions,
    "contour": st.contour.ContourTracker, "lwpr": st.LWPR, "memory": st.contour.ShapeMemory,
}  # fmt: skip
EVERY = [(table, option) for table in TABLES for option in schema_of(table).values()]
NUMBERS = [(table, option) for table, option in EVERY if option.kind in ("int", "number")]
CORE = {
    "tracker": _core.TrackerOptions, "reconstruct": _core.ReconstructionOptions,
    "contour": _core.ContourOptions, "lwpr": _core.LwprOptions,
}  # fmt: skip


def told(error, call, *arguments, **options):
    """The message of the error that the call raises; what happened instead, if it does not."""
    try:
        call(*arguments, **options)
    except error as raised:
        return str(raised)
    except Exception as raised:
        return f"another error: {raised!r}"
    return "no error"


def generator():
    spec = importlib.util.spec_from_file_location("generate_options", ROOT / "bindings/generate_options.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_what_is_generated_is_up_to_date():
    assert generator().outdated() == []


@pytest.mark.parametrize("table", TABLES)
def test_the_defaults_of_python_are_those_of_the_schema(table):
    made = MAKERS[table]()
    values = made.options if table == "contour" else made._options if table == "memory" else made
    for name, option in schema_of(table).items():
        value = values[name] if table == "contour" else getattr(values, name)
        if table == "lwpr" and name in AUTO:  # what the core does not know
            assert value == "auto"
            continue
        assert (value, type(value)) == (option.default, type(option.default)), name


# --- the same words everywhere
def test_an_unknown_option_is_refused_with_the_nearest_name():
    failed = []
    for table, option in EVERY:
        wrong = option.name + "x"
        message = told(TypeError, MAKERS[table], **{wrong: 1})
        near = re.fullmatch(rf"unknown option {wrong!r}; did you mean '(\w+)'\?", message)
        known = {*inspect.signature(MAKERS[table].__init__).parameters, *schema_of(table)}
        if near is None or near[1] not in known:
            failed.append((table, option.name, message))
    assert failed == []


def test_python_and_the_core_refuse_a_number_in_the_same_words():
    failed = []
    for table, option in NUMBERS:
        wrong = -1 if option.kind == "int" else -1.0
        expected = f"{option.name}: expected {option.expected}, got {wrong!r}"
        messages = [told(ValueError, MAKERS[table], **{option.name: wrong})]
        if table in CORE and option.name in core_schema(table):
            messages.append(told(ValueError, setattr, CORE[table](), option.name, wrong))
        if set(messages) != {expected}:
            failed.append((table, option.name, messages))
    assert failed == []


def test_the_bounds_are_taken_or_not_as_they_say():
    failed = []
    for table, option in NUMBERS:
        for end, is_open, outwards in ((option.min, option.min_open, -1), (option.max, option.max_open, 1)):
            if not np.isfinite(end):
                continue
            value = int(end) if option.kind == "int" else float(end)
            beyond = value + outwards if option.kind == "int" else np.nextafter(value, outwards * np.inf)
            message = told(ValueError, option.check, value if is_open else beyond)
            taken = is_open or option.check(value) == value
            if not (taken and message.startswith(f"{option.name}: expected")):
                failed.append((table, option.name, value, message))
    assert failed == []


def test_numbers_of_numpy_are_taken_and_kept_as_those_of_python():
    options = st.TrackerOptions(
        max_pixels=np.int64(500), padding_m=np.float32(0.5), free_space=np.bool_(False)
    )
    assert options == st.TrackerOptions(max_pixels=500, padding_m=0.5, free_space=False)
    kept = (options.max_pixels, options.padding_m, options.free_space)
    assert [type(v) for v in kept] == [int, float, bool]


def test_bounds_between_options_are_refused_in_the_same_words():
    with pytest.raises(ValueError, match=r"^w_prune: expected a number > 0\.2 and <= 1, got 0\.1$"):
        st.LWPR(w_prune=0.1)
    with pytest.raises(ValueError, match=r"^mu dt \(the product of both\): expected 0 to 0\.2001, got 0\.4"):
        st.contour.ContourTracker(dt=9.0)


# --- files
def test_a_file_of_every_option_is_read_back(tmp_path):
    from sdftrack.contour.options import options_from_file

    tracker = st.TrackerOptions(padding_m=0.06, residual="slope", free_space=False, max_pixels=99)
    reconstruct = st.ReconstructorOptions(noise_m=0.002, kept_frames=3, evidence="printed")
    contour = {"warp": "affine", "softness": 2.5}
    path = tmp_path / "o.toml"
    path.write_text(options_as_toml(tracker, reconstruct, contour))
    assert st.TrackerOptions.from_file(path) == tracker
    assert st.ReconstructorOptions.from_file(path) == reconstruct
    assert options_from_file(path) == {**_core.contour_options(), **contour}


def test_a_kind_of_sensor_names_its_errors():
    tof = st.TrackerOptions.for_sensor("azure_kinect", max_pixels=500)
    assert (tof.systematic_m, tof.noise_m, tof.max_pixels) == (0.005, 0.0015, 500)
    assert st.TrackerOptions.for_sensor("kinect_v1").noise_per_m == 0.0014
    with pytest.raises(ValueError, match=r"sensor: expected one of 'kinect_v1', .*, got 'kinect_v9'"):
        st.TrackerOptions.for_sensor("kinect_v9")
