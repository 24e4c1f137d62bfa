"""Derives, emits and compiles each shipped mechanism while extensions are built, and compiles the
units that run the tapes of all others.

For the instruction sets of this processor, or with MECHC_BUILD_FOR=any, as wheels for other
machines need it, for all of them.
"""

import os
import runpy
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from sysconfig import get_platform
from types import SimpleNamespace

from setuptools import Extension, find_packages, setup
from setuptools.command.build_ext import build_ext
from setuptools.modified import newer_group

CODEGEN = Path(__file__).resolve().parent / "codegen"
RUNTIME = CODEGEN / "mechc_codegen" / "runtime"
SCENES = "mechc._scenes."
UNITS = "mechc._units."
# What Cython writes into every module that takes arrays, once for all: half of what they compile.
OF_ALL_MODULES = "mechc.native._shared"
SHIPPED = ("four_bar",)
COMPILER = SimpleNamespace(**runpy.run_path("packaging/mechc_compiler.py"))
SHARED = sorted(map(str, Path("src/mechc/native").glob("*.pxd")))  # by the extensions
# Code that Cython writes for Python objects: optimised fully it takes twice as long to compile.
GLUE = ["-O1"]
NO_DEBUG_INFORMATION = "-g0"  # Python's own flags may ask for it: four fifths of a wheel
AS_WRITTEN = "-ffp-contract=off"  # no compiler chooses where products and sums are rounded once


class BuildScenes(build_ext):
    """build_ext that first generates the sources of ``mechc._scenes.*`` and ``mechc._units.*``.

    Generation happens here, not at import, because an in-place build runs no other command;
    generated files go under the build folder.
    """

    def finalize_options(self):
        sys.path.insert(0, str(CODEGEN))
        self.plat_name = self.plat_name or get_platform()
        self.units = dict(self.units_of_kinds())
        self.distribution.ext_modules += [Extension(name, []) for name in self.units]
        super().finalize_options()

    def run(self):
        os.environ.update(COMPILER.replacing(os.environ, self.plat_name))
        if self.plat_name in COMPILER.WINDOWS:
            self.compiler = self.compiler or COMPILER.GNU_ON_WINDOWS
        super().run()

    def units_of_kinds(self):
        """The name, kind and instruction set of each unit."""
        from mechc_codegen.emit.units.general import KINDS

        sets = self.instruction_sets()
        if self.plat_name in COMPILER.WINDOWS:  # where nothing tells what the processor can do
            sets = sets[:1]
        elif not self.for_any():
            sets = sets[-1:]
        for each in sets:
            for kind in KINDS:
                yield f"{UNITS}{kind}_{each.name}", (kind, each)

    def instruction_sets(self):
        from mechc_codegen.emit.units import instruction_sets as of

        machine = self.plat_name.rpartition("-")[2]
        return of.instruction_sets(machine) if self.for_any() else of.sets_of_this_processor()

    def for_any(self):
        return os.environ.get("MECHC_BUILD_FOR") == "any" or self.plat_name != get_platform()

    def build_extensions(self):
        if self.plat_name in COMPILER.WINDOWS:
            unused = Path(self.build_temp).resolve() / "import.lib"
            self.compiler.set_executables(**COMPILER.executables(os.environ, unused))
        from Cython.Build import cythonize

        self.builds, self.compilers = {}, ThreadPoolExecutor(os.cpu_count())
        for extension in self.extensions:
            extension.extra_compile_args += [NO_DEBUG_INFORMATION, AS_WRITTEN]
            if extension.name.startswith(SCENES):
                self.generate(extension)
            if extension.name == OF_ALL_MODULES:
                extension.sources = [self.shared_by_modules()]
            if extension.name in self.units:
                self.generate_unit(extension)
        folder = str(Path(self.build_temp).resolve() / "cython")
        self.parallel = self.parallel or os.cpu_count()
        modules = [each for each in self.extensions if each.name not in self.units]
        made = cythonize(
            modules, build_dir=folder, quiet=True, nthreads=self.parallel,
            shared_utility_qualified_name=OF_ALL_MODULES,
        )  # fmt: skip
        sources = {each.name: each.sources for each in made}
        for extension in self.extensions:  # in place: setuptools has set attributes on them
            extension.sources = sources.get(extension.name, [])
        super().build_extensions()

    def shared_by_modules(self):
        from Cython import __version__

        folder = Path(self.build_temp).resolve() / f"cython-{__version__}"
        target = folder / f"{OF_ALL_MODULES.rpartition('.')[2]}.c"
        folder.mkdir(parents=True, exist_ok=True)
        if not target.exists():
            command = [sys.executable, "-m", "cython", f"--generate-shared={target}"]
            subprocess.run(command, check=True)
        return str(target)

    def generate(self, extension):
        from mechc_codegen import build_scene, shipped_mechanism
        from mechc_codegen.extension.flags import FLAGS, runtime_headers

        name = extension.name.removeprefix(SCENES)
        folder = Path(self.build_temp).resolve() / "scenes" / name
        build = build_scene(shipped_mechanism(name), self.instruction_sets())
        build.write(folder)
        wrapper = folder / f"{name}.pyx"
        (folder / "scene.pyx").replace(wrapper)
        texts = [str(folder / text) for text in build.texts if text != "scene.pyx"]
        extension.sources = [str(wrapper)]
        extension.include_dirs = [str(folder), str(RUNTIME)]
        extension.depends = [*texts, *runtime_headers()]
        files = {name: [*FLAGS, *flags] for name, flags in build.flags.items()}
        self.builds[extension.name] = (folder, files)

    def generate_unit(self, extension):
        from mechc_codegen.emit.units.general import kind_flags, unit_sources
        from mechc_codegen.extension import build, flags

        kind, each = self.units[extension.name]
        lanes, name = each.lanes, "native"  # as that of scenes that are compiled here
        sources = unit_sources(kind, lanes, name)
        told = [*flags.GENERAL_FLAGS, *kind_flags(kind)]
        signature = build.unit_signature(sources, told)
        told += [*each.flags, flags.unit_key_flag(signature)]
        folder = Path(self.build_temp).resolve() / "units" / extension.name.removeprefix(UNITS)
        build.write_texts(folder, {**sources, "signature": signature})
        extension.include_dirs = list(flags.GENERAL_INCLUDES)
        extension.depends = [str(folder / "signature")]  # of the headers too
        self.builds[extension.name] = (folder, dict.fromkeys(sources, told))

    def build_extension(self, extension):
        """The C files of a scene or unit are compiled one by one: each has flags of its own."""
        if extension.name in self.builds and self.is_stale(extension):
            folder, files = self.builds[extension.name]

            def compile_file(file):
                name, flags = file
                return self.compiler.compile(
                    [str(folder / name)],
                    output_dir=self.build_temp,
                    include_dirs=extension.include_dirs,
                    extra_postargs=[*flags, NO_DEBUG_INFORMATION],
                )

            for objects in self.compilers.map(compile_file, files.items()):
                extension.extra_objects += objects
        super().build_extension(extension)

    def get_export_symbols(self, extension):
        """A unit is no module of Python."""
        return [] if extension.name in self.units else super().get_export_symbols(extension)

    def is_stale(self, extension):
        target = self.get_ext_fullpath(extension.name)
        return self.force or newer_group([*extension.sources, *extension.depends], target)


def headers(*folders):
    return [str(path) for folder in folders for path in sorted((RUNTIME / folder).glob("*.h"))]


DRIVER = headers("closing", "record", "run", "hybrid", "hybrid/events", "hybrid/contact")


def packages():
    """The runtime, the compiler, and the benchmarks."""
    parts = [f"mechc_bench.{name}" for name in find_packages("benchmarks")]
    return [*find_packages("src"), *find_packages("codegen"), "mechc_bench", *parts]


setup(
    packages=packages(),
    cmdclass={"build_ext": BuildScenes},
    ext_modules=[
        Extension(OF_ALL_MODULES, [], extra_compile_args=GLUE[:]),
        Extension(
            "mechc.native._arrays", ["src/mechc/native/_arrays.pyx"], extra_compile_args=GLUE[:]
        ),
        Extension(
            "mechc.native._codes",
            ["src/mechc/native/_codes.pyx"],
            include_dirs=[str(RUNTIME)],
            depends=headers("abi"),
        ),
        Extension(
            "mechc.native._driver",
            ["src/mechc/native/_driver.pyx"],
            include_dirs=[str(RUNTIME)],
            extra_compile_args=GLUE[:],
            depends=[*SHARED, *headers("abi")],
        ),
        Extension(
            "mechc.native._inputs",
            ["src/mechc/native/_inputs.pyx"],
            include_dirs=[str(RUNTIME)],
            extra_compile_args=["-O3"],
            depends=[*SHARED, *headers("abi")],
        ),
        Extension(
            "mechc.native._batch",
            ["src/mechc/native/_batch.pyx"],
            include_dirs=[str(RUNTIME)],
            extra_compile_args=["-O3"],
            depends=[*SHARED, *headers("abi", "batch"), *DRIVER],
        ),
        *(
            Extension(
                f"mechc.native.{name}",
                [f"src/mechc/native/{name}.pyx"],
                include_dirs=[str(RUNTIME)],
                extra_compile_args=GLUE[:],
                depends=[*SHARED, *headers("abi"), *DRIVER],
            )
            for name in ("_events", "_motion", "_steps")
        ),
        Extension(
            "mechc.native._closing",
            ["src/mechc/native/_closing.pyx"],
            include_dirs=[str(RUNTIME)],
            extra_compile_args=GLUE[:],
            depends=[*SHARED, *headers("abi", "closing")],
        ),
        Extension(
            "mechc.native._tableaus",
            ["src/mechc/native/_tableaus.pyx"],
            include_dirs=[str(RUNTIME)],
            depends=headers("run", "methods"),
        ),
        *(Extension(SCENES + name, [f"{name}.pyx"]) for name in SHIPPED),
    ],
)
