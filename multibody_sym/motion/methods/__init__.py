"""The methods, as tables that prove themselves.

    table        methods by name, with their summaries
    explicit     explicit Runge-Kutta methods
    multistep    implicit Runge-Kutta and multistep methods
"""
