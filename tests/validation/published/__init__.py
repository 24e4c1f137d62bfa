"""Other people's suites: Chrono's joints against ADAMS, Modelica's reference results.

`scenes` describes their models for mechc, `elsewhere` computes them by other formulations, and
`compare` brings both and the recorded values together.
"""
