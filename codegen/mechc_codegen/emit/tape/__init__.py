"""A scene as data: tapes of operations on numbered values, which need no C compiler."""
