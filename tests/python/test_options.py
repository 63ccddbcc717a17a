# SPDX-License-Identifier: MIT
"""One schema of options: the same words wherever an option is wrong, and nothing generated is out of date."""

import copy
import dataclasses
import inspect
import pickle
import re

import numpy as np
import pytest

import sdftrack as st
from sdftrack import _core
from sdftrack._internal.option_files import options_as_toml
from sdftrack.contour.lwpr_data import AUTO

# Everything that takes options by keyword.
MAKERS = {
    "tracker": st.TrackerOptions, "reconstruct": st.ReconstructorOptions,
    "contour": st.contour.ContourTracker, "lwpr": st.LWPR, "memory": st.contour.ShapeMemory,
}  # fmt: skip
CORE = {
    "tracker": _core.TrackerOptions, "reconstruct": _core.ReconstructionOptions,
    "contour": _core.ContourOptions, "lwpr": _core.LwprOptions, "memory": _core.MemoryOptions,
}  # fmt: skip
EVERY = [(table, option) for table in CORE for option in CORE[table].fields().values()]
NUMBERS = [(table, option) for table, option in EVERY if option.type in ("int", "float", "float | None")]
# Bounds that depend on another option, and what lets this one reach its own.
TOGETHER = {
    "dt": {"mu": 1e-6}, "mu": {"dt": 0.001}, "n_inputs": {"n_harmonics": 32}, "size": {"n_harmonics": 3, "n_inputs": 1},
    "n_harmonics": {"size": 64, "n_inputs": 1}, "w_prune": {"w_gen": 1e-9, "w_cutoff": 1e-12},
    "w_gen": {"w_prune": 1.0, "w_cutoff": 1e-12}, "w_cutoff": {"w_gen": 0.94},
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


@pytest.mark.parametrize("table", ["lwpr", "memory"])
def test_parameters_that_repeat_the_schema_have_its_names_order_and_defaults(table):
    schema = {
        o.name: "auto" if table == "lwpr" and o.name in AUTO else o.default for t, o in EVERY if t == table
    }
    given = {name: p.default for name, p in inspect.signature(MAKERS[table].__init__).parameters.items()}
    assert [(n, v) for n, v in given.items() if n in schema] == list(schema.items())


# --- the class of the core is that of Python
@pytest.mark.parametrize("cls", [st.TrackerOptions, st.ReconstructorOptions])
def test_options_have_the_interface_of_a_frozen_dataclass(cls):
    changed = cls(noise_m=0.002, padding_m=np.float32(0.5))
    assert dataclasses.is_dataclass(cls)
    assert dataclasses.asdict(changed) == changed.to_dict()
    assert list(changed.to_dict()) == [f.name for f in dataclasses.fields(cls)]
    for f in dataclasses.fields(cls):
        assert getattr(cls(), f.name) == f.default
        assert f.metadata["meaning"] in getattr(cls, f.name).__doc__
    assert dataclasses.replace(cls(), noise_m=0.002, padding_m=0.5) == changed != cls()
    assert cls().replace(noise_m=0.002).replace(padding_m=0.5) == changed
    assert hash(cls(noise_m=0.002)) == hash(cls(noise_m=0.002))
    assert repr(changed) == f"{cls.__name__}(noise_m=0.002, padding_m=0.5)"
    for other in (pickle.loads(pickle.dumps(changed)), copy.copy(changed), copy.deepcopy(changed)):
        assert (other, type(other)) == (changed, cls)
    for name in ("noise_m", "nois"):
        with pytest.raises(AttributeError):
            setattr(changed, name, 1.0)


# --- the same words everywhere
def test_an_unknown_option_is_refused_with_the_nearest_name():
    failed = []
    for table, option in EVERY:
        wrong = option.name + "x"
        message = told(TypeError, MAKERS[table], **{wrong: 1})
        near = re.fullmatch(rf"unknown option {wrong!r}; did you mean '(\w+)'\?", message)
        known = {
            *CORE[table].fields(),
            "memory",
            "burn_in",
            "n_in",
            "n_out",
            "norm_in",
            "norm_out",
        }
        if near is None or near[1] not in known:
            failed.append((table, option.name, message))
    assert failed == []


def test_an_option_of_another_kind_or_out_of_range_is_refused_in_the_same_words():
    failed = []
    for table, option in EVERY:
        expected = option.metadata["expected"]
        kind = {"int": "a whole number", "float": "a number", "float | None": "a number"}.get(
            option.type, expected
        )
        cases = [(TypeError, object, kind)] if option.name not in AUTO else []
        if option.type == "str":
            cases.append((ValueError, "neither", expected))
        if (table, option) in NUMBERS:
            cases.append((ValueError, -1 if option.type == "int" else -1.0, expected))
        for error, wrong, words in cases:
            message = told(error, MAKERS[table], **{option.name: wrong})
            if message != f"{option.name}: expected {words}, got {wrong!r}":
                failed.append((table, option.name, message))
    assert failed == []


def test_the_bounds_are_taken_or_not_as_they_say():
    failed, names = [], {(table, option.name) for table, option in EVERY}
    for table, option in NUMBERS:
        about = option.metadata
        for end, is_open, outwards in (
            (about["min"], about["min_open"], -1),
            (about["max"], about["max_open"], 1),
        ):
            if not np.isfinite(end):
                continue
            value = int(end) if option.type == "int" else float(end)
            beyond = value + outwards if option.type == "int" else np.nextafter(value, outwards * np.inf)
            others = {n: v for n, v in TOGETHER.get(option.name, {}).items() if (table, n) in names}
            message = told(ValueError, CORE[table], **{**others, option.name: value if is_open else beyond})
            taken = is_open or getattr(CORE[table](**{**others, option.name: value}), option.name) == value
            if not (taken and message.startswith(f"{option.name}: expected")):
                failed.append((table, option.name, value, message))
    assert failed == []


def test_whole_numbers_are_neither_fractions_nor_truths_nor_too_large():
    for wrong in (1.5, True, np.bool_(True), "3", np.array([1, 2]), None):
        with pytest.raises(TypeError, match=r"^max_pixels: expected a whole number, got"):
            st.TrackerOptions(max_pixels=wrong)
    for wrong in (10**12, -(10**400)):
        with pytest.raises(ValueError, match=r"^max_pixels: expected a whole number > 0"):
            st.TrackerOptions(max_pixels=wrong)
    with pytest.raises(ValueError, match=r"^noise_m: expected a number > 0 and < 1e\+09, got nan$"):
        st.TrackerOptions(noise_m=float("nan"))


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
    from sdftrack.contour.options import options_of_file

    tracker = st.TrackerOptions(padding_m=0.06, residual="slope", free_space=False, max_pixels=99)
    reconstruct = st.ReconstructorOptions(noise_m=0.002, kept_frames=3, evidence="printed")
    contour = {"warp": "affine", "softness": 2.5}
    path = tmp_path / "o.toml"
    path.write_text(options_as_toml(tracker, reconstruct, contour))
    assert st.TrackerOptions.from_file(path) == tracker
    assert st.ReconstructorOptions.from_file(path) == reconstruct
    assert options_of_file(path) == _core.ContourOptions(**contour).to_dict()


def test_a_kind_of_sensor_names_its_errors():
    tof = st.TrackerOptions.for_sensor("azure_kinect", max_pixels=500)
    assert (tof.systematic_m, tof.noise_m, tof.max_pixels) == (0.005, 0.0015, 500)
    assert st.TrackerOptions.for_sensor("kinect_v1").noise_per_m == 0.0014
    with pytest.raises(ValueError, match=r"sensor: expected one of 'kinect_v1', .*, got 'kinect_v9'"):
        st.TrackerOptions.for_sensor("kinect_v9")
