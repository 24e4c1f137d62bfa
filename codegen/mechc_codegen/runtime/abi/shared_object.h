/* Shared objects opened at run time, and their symbols by name. */
#pragma once

#include <stddef.h>
#include <stdio.h>

#ifdef _WIN32

#define WIN32_LEAN_AND_MEAN
#define NOMINMAX
#include <windows.h>
#undef near /* its macros of common words */
#undef far
#undef small

/* Open a shared object by its path in UTF-8; NULL if that fails. */
static inline void *mechc_open_shared(const char *path)
{
    wchar_t wide[4096];
    if (!MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, wide, 4096)) return NULL;
    return (void *)LoadLibraryW(wide);
}

static inline void *mechc_find_shared(void *library, const char *name)
{
    return (void *)(size_t)GetProcAddress((HMODULE)library, name);
}

static inline void mechc_close_shared(void *library)
{
    FreeLibrary((HMODULE)library);
}

/* The reason why the last call of this thread failed. */
static inline void mechc_shared_error(char *text, size_t size)
{
    snprintf(text, size, "Windows error %lu", (unsigned long)GetLastError());
}

#else

#include <dlfcn.h>

static inline void *mechc_open_shared(const char *path)
{
    return dlopen(path, RTLD_NOW | RTLD_LOCAL);
}

static inline void *mechc_find_shared(void *library, const char *name)
{
    return dlsym(library, name);
}

static inline void mechc_close_shared(void *library)
{
    dlclose(library);
}

static inline void mechc_shared_error(char *text, size_t size)
{
    const char *why = dlerror();
    snprintf(text, size, "%s", why ? why : "no reason was given");
}

#endif
