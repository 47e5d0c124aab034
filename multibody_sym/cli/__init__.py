"""What did the command line say: `multibody-sym COMMAND ...`, one file a command.

    main           from words to output and exit code
    options        commands and their options, usage errors, suggestions, completion, `--help`; replies: `--json`,
                   text, units and digits, exit codes
    model, runs    the model file of a command; its run, recalled or prepared, written while it goes on
    commands       one file a command
    terminal       width, headings and colours of what a terminal shows; what a command does meanwhile
    error_pages    pages of `explain` and their small models
    version        `--version`

In: words. Out: output and an exit code; nothing that a user does wrong ends in a traceback.
"""
