"""The tests, laid out as the sources are; what they share is in :mod:`tests.support`."""
