"""modelDescription.xml and buildDescription.xml of a functional mock-up unit.

Input: its variables.  Output: XML of FMI 2.0 or 3.0.  Invariant: text of users is written by
``xml.etree``, which escapes it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from mechc_codegen.export.units import exponents
from mechc_codegen.export.variables import FmuOptions, Variable, plain_text

# Attributes of an interface in FMI 2.0 and in 3.0.
_STATES = {
    "2.0": ("canGetAndSetFMUstate", "canSerializeFMUstate"),
    "3.0": ("canGetAndSetFMUState", "canSerializeFMUState"),
}
_DERIVATIVES = {
    "2.0": ("providesDirectionalDerivative",),
    "3.0": ("providesDirectionalDerivatives", "providesAdjointDerivatives"),
}
# Variables that ModelStructure lists, with their element in FMI 2.0 (if it has one) and in 3.0.
_STRUCTURE: tuple[tuple[str, str, Callable[[Variable], bool]], ...] = (
    ("Outputs", "Output", lambda v: v.causality == "output"),
    ("Derivatives", "ContinuousStateDerivative", lambda v: v.rate_of is not None),
    (
        "InitialUnknowns",
        "InitialUnknown",
        lambda v: v.initial == "calculated" and not v.is_indicator,
    ),
    ("", "EventIndicator", lambda v: v.is_indicator),
)


def model_description(
    options: FmuOptions, title: str, token: str, variables: Sequence[Variable], source: str,
    indicators: int | None,
) -> bytes:  # fmt: skip
    """The text of modelDescription.xml; ``indicators``: number of events that model exchange is
    asked about, None where it is not offered."""
    third = options.version == "3.0"
    head = {
        "fmiVersion": options.version,
        "modelName": plain_text(title) or options.name,
        "instantiationToken" if third else "guid": token,
        "generationTool": options.tool,
        "variableNamingConvention": "flat",
    }
    head |= {} if third else {"numberOfEventIndicators": str(indicators or 0)}
    root = Element("fmiModelDescription", head)
    _interfaces(root, options, source, exchange=indicators is not None)
    _units(root, variables)
    categories = SubElement(root, "LogCategories")
    SubElement(categories, "Category", name="logStatusError", description="errors")
    SubElement(root, "DefaultExperiment", startTime="0.0", stopTime=repr(options.end),
               tolerance=repr(options.rtol))  # fmt: skip
    listed = SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables):
        _variable(listed, reference, variable, third)
    _structure(SubElement(root, "ModelStructure"), variables, third)
    return _text(root)


def build_description(name: str, source: str, flags: Sequence[str]) -> bytes:
    """The text of sources/buildDescription.xml (FMI 3.0)."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    build = SubElement(root, "BuildConfiguration", modelIdentifier=name)
    files = SubElement(build, "SourceFileSet", language="C11", compilerOptions=" ".join(flags))
    SubElement(files, "SourceFile", name=source)
    SubElement(files, "IncludeDirectory", name=".")
    SubElement(build, "Library", name="m")
    return _text(root)


def _text(root: Element) -> bytes:
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def _interfaces(root: Element, options: FmuOptions, source: str, *, exchange: bool) -> None:
    third = options.version == "3.0"
    able = _STATES[options.version] + (_DERIVATIVES[options.version] if options.derivatives else ())
    can = {"modelIdentifier": options.name, **dict.fromkeys(able, "true")}
    asks = {"needsCompletedIntegratorStep": "true"} if third else {}  # to close loops
    interfaces = [SubElement(root, "ModelExchange", can | asks)] if exchange else []
    interfaces.append(
        SubElement(root, "CoSimulation", can | {"canHandleVariableCommunicationStepSize": "true"})
    )
    for each in () if third else interfaces:
        SubElement(SubElement(each, "SourceFiles"), "File", name=source)


def _units(root: Element, variables: Sequence[Variable]) -> None:
    names = sorted({plain_text(variable.unit) for variable in variables} - {""})
    if not names:
        return
    definitions = SubElement(root, "UnitDefinitions")
    for name in names:
        unit = SubElement(definitions, "Unit", name=name)
        known = exponents(name)
        if known is not None:
            SubElement(unit, "BaseUnit", {base: str(power) for base, power in known.items()})


def _variable(listed: Element, reference: int, variable: Variable, third: bool) -> None:
    """One variable: a single element in FMI 3.0, two elements in FMI 2.0."""
    said = {"name": variable.name, "valueReference": str(reference)}
    if variable.description:
        said["description"] = variable.description
    said |= {"causality": variable.causality, "variability": variable.variability}
    if variable.initial and variable.causality != "input":
        said["initial"] = variable.initial
    number = {"unit": plain_text(variable.unit)} if variable.unit else {}
    bounds = {"min": variable.lower, "max": variable.upper, "start": variable.start}
    number |= {key: repr(float(x)) for key, x in bounds.items() if x is not None}
    if variable.rate_of is not None:
        number["derivative"] = str(variable.rate_of + (not third))  # 2.0: the place, from 1
    if variable.causality == "output" and variable.initial == "exact":
        number["reinit"] = "true"  # loops may be closed in event mode
    if third:
        SubElement(listed, "Float64", said | number)
    else:
        SubElement(SubElement(listed, "ScalarVariable", said), "Real", number)


def _structure(structure: Element, variables: Sequence[Variable], third: bool) -> None:
    for second, tag, belongs in _STRUCTURE:
        references = [reference for reference, v in enumerate(variables) if belongs(v)]
        if third:
            for reference in references:
                SubElement(structure, tag, valueReference=str(reference))
        elif second and references:
            several = SubElement(structure, second)
            for reference in references:
                SubElement(several, "Unknown", index=str(reference + 1))
