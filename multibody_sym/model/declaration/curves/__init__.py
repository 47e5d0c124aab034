"""Curves that guide: how they are declared, and the elementary motion along one."""
