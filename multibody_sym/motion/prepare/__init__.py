"""From a System to what runs: settings, Programs, functions, exports."""
