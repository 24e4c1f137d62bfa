"""modelDescription.xml and buildDescription.xml of a functional mock-up unit.

Input: its variables.  Output: XML of FMI 2.0 or 3.0.  Invariant: text of users is written by
``xml.etree``, which escapes it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from mechc_codegen.export.units import exponents
from mechc_codegen.export.variables import Variable, plain_text

ABILITIES = {
    "canGetAndSetFMUState": "true",
    "canSerializeFMUState": "true",
    "providesDirectionalDerivatives": "true",
}
_OF_FMI2 = {
    "canGetAndSetFMUState": "canGetAndSetFMUstate",
    "canSerializeFMUState": "canSerializeFMUstate",
    "providesDirectionalDerivatives": "providesDirectionalDerivative",
}


@dataclass(frozen=True)
class Unit:
    """What a description says of the whole unit."""

    identifier: str  # names of files: letters, digits and _
    title: str
    token: str
    version: str  # of FMI: "2.0" or "3.0"
    end: float  # s
    tolerance: float
    tool: str
    derivatives: bool = True
    events: int = 0


def model_description(unit: Unit, variables: Sequence[Variable], source: str) -> bytes:
    """The text of modelDescription.xml."""
    third = unit.version == "3.0"
    root = Element("fmiModelDescription", _head(unit, third))
    _interfaces(root, unit, source, third)
    _units(root, variables)
    categories = SubElement(root, "LogCategories")
    SubElement(categories, "Category", name="logStatusError", description="errors")
    SubElement(root, "DefaultExperiment", startTime="0.0", stopTime=repr(unit.end),
               tolerance=repr(unit.tolerance))  # fmt: skip
    listed = SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables):
        (_variable3 if third else _variable2)(listed, reference, variable)
    (_structure3 if third else _structure2)(SubElement(root, "ModelStructure"), variables)
    return _text(root)


def build_description(unit: Unit, source: str, flags: Sequence[str]) -> bytes:
    """The text of sources/buildDescription.xml (FMI 3.0)."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    build = SubElement(root, "BuildConfiguration", modelIdentifier=unit.identifier)
    files = SubElement(build, "SourceFileSet", language="C11", compilerOptions=" ".join(flags))
    SubElement(files, "SourceFile", name=source)
    SubElement(files, "IncludeDirectory", name=".")
    SubElement(build, "Library", name="m")
    return _text(root)


def _text(root: Element) -> bytes:
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def _head(unit: Unit, third: bool) -> dict[str, str]:
    head = {
        "fmiVersion": unit.version,
        "modelName": plain_text(unit.title) or unit.identifier,
        "instantiationToken" if third else "guid": unit.token,
        "generationTool": unit.tool,
        "variableNamingConvention": "flat",
    }
    return head if third else {**head, "numberOfEventIndicators": str(unit.events)}


def _interfaces(root: Element, unit: Unit, source: str, third: bool) -> None:
    can = ABILITIES if third else {_OF_FMI2[name]: value for name, value in ABILITIES.items()}
    can = {"modelIdentifier": unit.identifier, **can}
    if not unit.derivatives:
        del can["providesDirectionalDerivatives" if third else "providesDirectionalDerivative"]
    if third and unit.derivatives:
        can["providesAdjointDerivatives"] = "true"
    asks = {"needsCompletedIntegratorStep": "true"} if third else {}  # to close loops
    exchange = SubElement(root, "ModelExchange", can | asks)
    together = SubElement(
        root, "CoSimulation", {**can, "canHandleVariableCommunicationStepSize": "true"}
    )
    for each in () if third else (exchange, together):
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


def _said(variable: Variable, reference: int) -> dict[str, str]:
    """The attributes that both versions have."""
    said = {"name": variable.name, "valueReference": str(reference)}
    if variable.description:
        said["description"] = variable.description
    said |= {"causality": variable.causality, "variability": variable.variability}
    if variable.initial and variable.causality != "input":
        said["initial"] = variable.initial
    return said


def _number(variable: Variable, reference: int) -> dict[str, str]:
    """Those of a real number."""
    said = {"unit": plain_text(variable.unit)} if variable.unit else {}
    bounds = {"min": variable.lower, "max": variable.upper, "start": variable.start}
    return said | {key: repr(float(x)) for key, x in bounds.items() if x is not None}


def _variable3(listed: Element, reference: int, variable: Variable) -> None:
    said = {**_said(variable, reference), **_number(variable, reference)}
    if variable.rate_of is not None:
        said["derivative"] = str(variable.rate_of)
    if variable.causality == "output" and variable.initial == "exact":
        said["reinit"] = "true"  # loops may be closed in event mode
    SubElement(listed, "Float64", said)


def _variable2(listed: Element, reference: int, variable: Variable) -> None:
    number = _number(variable, reference)
    if variable.rate_of is not None:
        number["derivative"] = str(variable.rate_of + 1)  # its place in the list, from 1
    if variable.causality == "output" and variable.initial == "exact":
        number["reinit"] = "true"
    SubElement(SubElement(listed, "ScalarVariable", _said(variable, reference)), "Real", number)


# Outputs, rates, and what is unknown at the start.
_KINDS: Mapping[str, Callable[[Variable], bool]] = {
    "outputs": lambda variable: variable.causality == "output",
    "rates": lambda variable: variable.rate_of is not None,
    "unknown": lambda variable: variable.initial == "calculated" and not variable.is_indicator,
    "indicators": lambda variable: variable.is_indicator,
}


def _of(variables: Sequence[Variable], kind: str) -> list[int]:
    """The references of one kind."""
    return [reference for reference, v in enumerate(variables) if _KINDS[kind](v)]


def _structure3(structure: Element, variables: Sequence[Variable]) -> None:
    for tag, kind in (
        ("Output", "outputs"),
        ("ContinuousStateDerivative", "rates"),
        ("InitialUnknown", "unknown"),
        ("EventIndicator", "indicators"),
    ):
        for reference in _of(variables, kind):
            SubElement(structure, tag, valueReference=str(reference))


def _structure2(structure: Element, variables: Sequence[Variable]) -> None:
    for tag, kind in (
        ("Outputs", "outputs"),
        ("Derivatives", "rates"),
        ("InitialUnknowns", "unknown"),
    ):
        if references := _of(variables, kind):
            listed = SubElement(structure, tag)
            for reference in references:
                SubElement(listed, "Unknown", index=str(reference + 1))
