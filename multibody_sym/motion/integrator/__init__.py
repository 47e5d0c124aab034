"""One step in Python, and what may happen in it.

    loop                 the stepping loop and step control (the same in C: templates/c/runtime.c)
    flow                 records of steps and stages; why a step fails
    runge_kutta_steps    steps of Runge-Kutta and multistep methods
    library_steps        steps of scipy's and SUNDIALS' methods
    events               where switching functions change sign within a step (the same in C: templates/c/events.c)
    singular             steps over singular positions
"""
