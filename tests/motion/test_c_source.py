"""The runtime as C: no warnings, no sanitizer findings, no allocation."""

import re
import shutil
import subprocess

import numpy as np
import pytest
from hand_models import TEMPLATES, planar_pendulum

from multibody_sym.motion.loop.integrate import integrate
from multibody_sym.motion.loop.problem import NO_MODE, Problem
from multibody_sym.motion.methods.table import METHODS
from multibody_sym.program.native import open_library
from multibody_sym.program.target_layout import RUNTIME_SOURCES, STAND_INS, runtime_files, stand_in_files

CC = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
needs_compiler = pytest.mark.skipif(CC is None, reason="needs a C compiler")

DRIVER = """
#include "runtime.h"
#include <stdio.h>
#include <stdlib.h>
extern const mbs_program mbs_programs[];
static const double a[] = {A}, c[] = {C}, error[] = {ERROR}, dense[] = {DENSE};
int main(void)
{
    const double parameters[] = {9.81, 1, 0, 0}, x0[] = {1, 0, 0, 0};
    mbs_method method = {
        .stages = 7, .all_stages = 7, .order = 5, .error_order = 4, .dense_degree = 4,
        .a = a, .c = c, .error = error, .dense = dense};
    mbs_system system = {.state_derivative = &mbs_programs[0], .project_position = &mbs_programs[1],
                         .project_velocity = &mbs_programs[2], .parameters = parameters, .nq = 2, .nu = 2, .ns = 2};
    mbs_problem problem = {.method = &method, .system = &system, .t_end = 2.0, .rtol = 1e-8, .atol = 1e-8,
                           .contradiction = 1e-3, .closure = 1e-8, .max_steps = 1000000, .samples = 11, .project = 1};
    mbs_state state;
    double *work = malloc(sizeof(double) * (size_t)mbs_work(&problem)), *samples = malloc(sizeof(double) * 4 * 11);
    mbs_start(&problem, x0, &state, work);
    for (long long row = 0; state.status == MBS_RUNNING;)
        row += mbs_integrate(&problem, &state, work, 3, 11 - row < 2 ? 11 - row : 2, samples + 4 * row);
    for (int i = 0; i < 44; ++i)
        printf("%.17g\\n", samples[i]);
    free(work);
    free(samples);
    return state.status == MBS_DONE ? 0 : 1;
}
"""


def hanging(compiled):
    return Problem(
        compiled,
        METHODS["dormand_prince"],
        t0=0.0,
        t_end=2.0,
        q0=np.array([1.0, 0.0]),
        u0=np.zeros(2),
        parameters=np.array([9.81, 1, 0, 0]),
        mode=NO_MODE,
        samples=11,
        project=True,
    )


def write_sources(place):
    tableau = METHODS["dormand_prince"].tableau
    text = DRIVER
    for name, values in (("A", tableau.A), ("C", tableau.c), ("ERROR", tableau.error), ("DENSE", tableau.dense)):
        text = text.replace("{" + name + "}", "{" + ", ".join(map(repr, values.ravel().tolist())) + "}")
    for name, content in {**planar_pendulum(copies=2).sources(), "main.c": text}.items():
        (place / name).write_text(content)


def compiled(place, *arguments):
    return subprocess.run([CC, "-std=c99", *arguments], cwd=place, capture_output=True, text=True, check=False)


@needs_compiler
def test_the_compiler_has_nothing_to_warn_of(tmp_path):
    for name, text in {**runtime_files(), **stand_in_files()}.items():
        (tmp_path / name).write_text(text)
    warnings = ["-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Wstrict-prototypes", "-pedantic", "-Werror"]
    run = compiled(tmp_path, "-O2", *warnings, "-fsyntax-only", *RUNTIME_SOURCES, *STAND_INS)
    assert (run.returncode, run.stderr) == (0, "")


def test_it_includes_math_and_nothing_else():
    source = "".join(runtime_files().values())
    assert set(re.findall(r"#include <(\S+)>", source)) == {"math.h"}
    assert not re.search(r"\b(malloc|calloc|realloc|free|alloca)\b", source)


@needs_compiler
@pytest.mark.parametrize("sanitizer", ["address,undefined", ""], ids=["sanitized", "plain"])
def test_a_driver_in_c_gets_the_motion_that_python_gets(tmp_path, sanitizer):
    write_sources(tmp_path)
    flags = ["-O0", f"-fsanitize={sanitizer}", "-fno-sanitize-recover=all"] if sanitizer else ["-O1"]
    built = compiled(tmp_path, *flags, "main.c", "model.c", *RUNTIME_SOURCES, "-lm", "-o", "driver")
    if sanitizer and "cannot find" in built.stderr:
        pytest.skip("needs the sanitizers' libraries")
    assert built.returncode == 0, built.stderr
    run = subprocess.run([tmp_path / "driver"], capture_output=True, text=True, check=False)
    assert (run.returncode, run.stderr) == (0, "")
    wanted = integrate(hanging(planar_pendulum(copies=2).load()))
    found = np.array(run.stdout.split(), dtype=float).reshape(11, 4)
    np.testing.assert_allclose(found, np.hstack([wanted.q, wanted.u]), atol=1e-12)


def test_a_library_of_other_programs_is_refused():
    model = planar_pendulum()
    with pytest.raises(ValueError, match="expected sizes"):
        open_library(model.load().path, planar_pendulum(copies=2).signatures())
    with pytest.raises(OSError, match="no-such"):
        open_library(TEMPLATES / "no-such.so", model.signatures())
