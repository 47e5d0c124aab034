"""FMUs: their description and archive, without a compiler; `tests/peers/test_fmu_by_fmpy.py` runs them."""

from __future__ import annotations

import io
import xml.etree.ElementTree as ET
import zipfile
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.motion.prepare import fmu as fmu_module
from multibody_sym.motion.prepare.fmu import write_fmu
from multibody_sym.program.loading import Compiler

EXAMPLES = Path(__file__).parents[2] / "examples"
CART = """
multibody_sym: 1
name: cart & "pole"
gravity: [0, -9.81, 0]
parameters: {M: {value: 2 kg, positive: true}, l: 500 mm, half: l/2, k: 3, T: 100 ms}
bodies: {cart: {mass: M}, pole: {shape: {rod: l, mass: 200 g}}}
joints:
  track: {type: prismatic, parent: ground, child: cart, axis: x, q: x}
  hinge: {type: revolute, parent: cart, child: pole, axis: z, q: theta, initial: {q: 95 deg}}
states: {f: {rate: (push - f)/T, initial: 1 N}}
inputs: {push: 0 N, hum: k*sin(t)}
forces: {motor: {type: force, on: cart, value: [f + hum, 0, 0]}}
outputs: {middle: half, held: fy(track)}
stop: {far: x > 3}
simulation: {t_end: 4, rtol: 1e-8}
"""


@lru_cache
def cart() -> mbs.System:
    return mbs.loads(CART)


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    without_compiler(monkeypatch, tmp_path / "library")


def without_compiler(patch: pytest.MonkeyPatch, library: Path) -> None:
    library.write_bytes(b"a library")
    patch.setattr(fmu_module, "find_compiler", lambda: Compiler(("cc",), (), ""))
    patch.setattr(fmu_module, "build_library", lambda *_: library)


@lru_cache
def exported(system: mbs.System, fmi: int = 2, k: int = 3) -> bytes:
    with pytest.MonkeyPatch.context() as patch, TemporaryDirectory() as folder:
        without_compiler(patch, Path(folder) / "library")
        changes = {} if k == 3 else {"parameters": {"k": k}}
        (file,) = mbs.export(system, "fmu", Path(folder) / "x.fmu", fmi=fmi, **changes)
        return file.read_bytes()


def archive_of(content: bytes) -> zipfile.ZipFile:
    return zipfile.ZipFile(io.BytesIO(content))


def described(content: bytes) -> ET.Element:
    return ET.fromstring(archive_of(content).read("modelDescription.xml"))


def test_variables_have_causality_units_and_values_of_the_start() -> None:
    root = described(exported(cart()))
    assert root.attrib["modelName"] == 'cart & "pole"'
    assert {x.tag: x.attrib["modelIdentifier"] for x in root if "modelIdentifier" in x.attrib} == {
        "ModelExchange": "cart____pole_", "CoSimulation": "cart____pole_",
    }  # fmt: skip
    variables = {x.attrib["name"]: (x.attrib, x[0].attrib) for x in root.iter("ScalarVariable")}
    kinds = {name: (x["causality"], real.get("unit", ""), real.get("start")) for name, (x, real) in variables.items()}
    assert kinds["theta"] == ("output", "rad", str(np.radians(95.0)))
    assert kinds["f"] == ("output", "N", "1.0")
    assert kinds["push"] == ("input", "N", "0.0")
    assert kinds["hum"] == ("local", "", None)  # k has no unit
    assert kinds["half"] == ("calculatedParameter", "m", None)
    assert kinds["l"] == ("parameter", "m", "0.5")
    assert kinds["held"] == ("output", "N", None)
    assert (variables["M"][0]["variability"], variables["M"][1]["min"]) == ("tunable", "0.0")
    names = list(variables)
    for state in ("x", "theta", "f", "u_x", "u_theta"):
        assert names[int(variables[f"der({state})"][1]["derivative"]) - 1] == state
    units = {x.attrib["name"]: x.find("BaseUnit").attrib for x in root.iter("Unit")}
    assert units["N"] == {"kg": "1", "m": "1", "s": "-2"}
    assert units["rad/s^2"] == {"s": "-2", "rad": "1"}
    assert root.find("DefaultExperiment").attrib == {"startTime": "0.0", "stopTime": "4.0", "tolerance": "1e-08"}
    assert root.attrib["numberOfEventIndicators"] == "1"


@pytest.mark.parametrize("fmi", [2, 3])
def test_dependencies_are_those_of_the_equations(fmi: int) -> None:
    """Accelerations of a cart and its pole depend on the angle, its speed and the force, not on the place."""
    root = described(exported(cart(), fmi))
    if fmi == 2:
        names = [x.attrib["name"] for x in root.iter("ScalarVariable")]
        unknowns = {
            names[int(x.attrib["index"]) - 1]: {names[int(k) - 1] for k in x.attrib["dependencies"].split()}
            for kind in ("Outputs", "Derivatives") for x in root.find("ModelStructure").find(kind)
        }  # fmt: skip
    else:
        by_reference = {x.attrib["valueReference"]: x.attrib["name"] for x in root.iter("Float64")}
        unknowns = {
            by_reference[x.attrib["valueReference"]]: {by_reference[k] for k in x.attrib["dependencies"].split()}
            for x in root.find("ModelStructure") if x.tag in ("Output", "ContinuousStateDerivative")
        }  # fmt: skip
        assert by_reference[root.find("ModelStructure").find("EventIndicator").attrib["valueReference"]]
    assert unknowns["der(x)"] == {"u_x"}
    assert unknowns["der(f)"] == {"f", "push"}
    assert unknowns["der(u_theta)"] == unknowns["held"] == {"theta", "u_theta", "f"}
    assert unknowns["middle"] == set()
    assert unknowns["x"] == {"x"}


def test_parameters_of_constraints_on_positions_are_fixed() -> None:
    root = described(exported(mbs.load(EXAMPLES / "four_bar.yaml"), 3))
    kinds = {x.attrib["name"]: x.attrib["variability"] for x in root.iter("Float64")}
    assert {name: kinds[name] for name in ("a", "d", "rho", "torque")} == {
        "a": "fixed", "d": "fixed", "rho": "tunable", "torque": "tunable",
    }  # fmt: skip


def test_masses_stay_positive_though_nobody_says_so() -> None:
    text = CART.replace("M: {value: 2 kg, positive: true}", "M: 2 kg")
    about = described(exported(mbs.loads(text)))
    least = {each.get("name"): each.find("Real").get("min") for each in about.iter("ScalarVariable")}  # type: ignore[union-attr]
    assert (least["M"], least["k"]) == ("0.0", None)


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_archive_has_its_sources_and_is_the_same_twice(fmi: int) -> None:
    content = exported(cart(), fmi)
    archive = archive_of(content)
    assert exported.__wrapped__(cart(), fmi) == content
    names = archive.namelist()
    assert names[0] == "modelDescription.xml"
    assert [archive.read(name) for name in names if name.startswith("binaries/")] == [b"a library"]
    root = described(content) if fmi == 2 else ET.fromstring(archive.read("sources/buildDescription.xml"))
    listed = {x.attrib["name"] for x in root.iter("File" if fmi == 2 else "SourceFile")}
    assert f"fmi{fmi}.c" in listed
    assert {f"sources/{name}" for name in listed} == {name for name in names if name.endswith(".c")}


def test_slip_that_is_undetermined_at_the_start_does_not_end_the_motion() -> None:
    """The corners of a box share its friction in many ways: one of them would slip by the least forces at the start."""
    text = (EXAMPLES / "textbook" / "slips_or_tips.yaml").read_text(encoding="utf-8")
    content = exported(mbs.loads(f"{text}\nsimulation: {{method: radau_5}}\n"))
    header = archive_of(content).read("sources/fmu_model.h").decode()
    assert "mbs_fmu_margins[] = {1e-09, -1e-09, 1e-09, 1e-09, 1e-09, 1e-09};" in header


@pytest.mark.usefixtures("library")
def test_a_file_that_no_export_wrote_stays(tmp_path: Path) -> None:
    path, heavier = tmp_path / "cart.fmu", exported(cart(), k=4)
    path.write_bytes(heavier)
    mbs.export(cart(), "fmu", path)
    assert path.read_bytes() == exported(cart())
    assert described(heavier).attrib["guid"] != described(path.read_bytes()).attrib["guid"]
    for content in (b"my own work", b"", heavier[:-1] + b"x"):
        path.write_bytes(content)
        with pytest.raises(mbs.InputError, match="not as an export wrote it"):
            write_fmu(SimpleNamespace(), path, 2)
        assert path.read_bytes() == content


def test_what_an_fmu_cannot_hold_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "x.fmu"
    with pytest.raises(mbs.InputError, match="FMI 2 or 3, not 1"):
        mbs.export(cart(), "fmu", path, fmi=1)
    with pytest.raises(mbs.InputError, match="an FMU has parameters"):
        mbs.export(cart(), "fmu", path, fold=True)
    with pytest.raises(mbs.ModelError, match="begins with an impact"):
        mbs.export(mbs.load(EXAMPLES / "impacts" / "struck_four_bar.yaml"), "fmu", path)
    timed = CART.replace("middle: half", "time: half")
    with pytest.raises(mbs.InputError, match="two variables of the FMU would be called 'time'"):
        mbs.export(mbs.loads(timed), "fmu", path)
    monkeypatch.setenv("CC", "nothing_of_this_name")
    with pytest.raises(mbs.OutputError, match="no C compiler"):
        mbs.export(cart(), "fmu", path)
    assert not path.exists()
    with pytest.MonkeyPatch.context() as patch:
        without_compiler(patch, tmp_path / "library")
        with pytest.raises(mbs.OutputError, match="No such file"):
            mbs.export(cart(), "fmu", tmp_path / "no" / "cart.fmu")


@pytest.mark.usefixtures("library")
def test_the_command_says_what_is_inside(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "cart.yaml").write_text(CART, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert main(["export", "cart.yaml", "--to", "fmu", "--fmi", "3"]) == 0
    printed = capsys.readouterr().out
    assert "wrote cart.fmu\n" in printed
    assert "computed in the FMU: hum; --inputs hum=0 makes it an input from outside" in printed
    assert described(Path("cart.fmu").read_bytes()).attrib["fmiVersion"] == "3.0"
    assert main(["export", "cart.yaml", "--to", "python"]) == 0
    assert (tmp_path / "cart_python" / "model.py").exists()
