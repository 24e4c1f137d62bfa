"""Shared objects opened while the program runs; the same on every operating system."""

cdef extern from "abi/shared_object.h":
    void *mechc_open_shared(const char *path)
    void *mechc_find_shared(void *library, const char *name)
    void mechc_close_shared(void *library)
    void mechc_shared_error(char *text, size_t size)


cdef inline str shared_error():
    """Why the last of these calls failed."""
    cdef char text[4096]
    mechc_shared_error(text, sizeof(text))
    return text.decode(errors="replace")
