"""Texts of compiled units: their files, instruction sets, and functions split for the compiler."""
