"""The equations as Programs: named, shaped inputs and outputs."""
