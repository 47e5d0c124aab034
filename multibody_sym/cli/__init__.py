"""What did the command line say: `multibody-sym COMMAND ...`, one file a command.

    main, options, model, runs     from words to a model and a run, which may be recalled
    commands                       one file a command
    output, recording, error_pages, completion, version     what is printed and written

In: words. Out: output and an exit code; nothing that a user does wrong ends in a traceback.
"""
