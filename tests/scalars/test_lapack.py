"""Routines of LAPACK come from scipy's extension modules, and are those of the package, whichever is imported first."""

from __future__ import annotations

import subprocess
import sys

import pytest

ASK = """
import sys
import numpy as np
{first}
from multibody_sym.scalars.pivoted_qr import blas, lapack
from multibody_sym.scalars.pivoted_qr import pivoted_qr

early = "scipy.linalg" in sys.modules
Q, R, order, rank = pivoted_qr(np.array([[0.0, 3.0], [2.0, 0.0]]))
assert ("scipy.linalg" in sys.modules) == early
assert (order.tolist(), rank) == ([1, 0], 2)
from scipy.linalg import blas as its_blas, lapack as its_lapack, qr
assert lapack().dgeqp3 is its_lapack.dgeqp3 and blas().dtrsm is its_blas.dtrsm
assert qr(np.eye(2), pivoting=True)[2].tolist() == [0, 1]
"""


@pytest.mark.parametrize("first", ["", "import scipy.linalg"])
def test_extension_modules_are_shared_with_scipy(first: str) -> None:
    done = subprocess.run([sys.executable, "-c", ASK.format(first=first)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
