"""Texts of compiled units: files, instruction sets, and functions split for the compiler."""
