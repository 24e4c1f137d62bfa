"""Configurations and speeds that close the loops."""
