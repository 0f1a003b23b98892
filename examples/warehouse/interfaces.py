"""Compiles Nav2's action and the messages of tf for the Python of `examples/fleet`: there are no wheels for them.

    python3.11 examples/warehouse/interfaces.py [PYTHON]

From the definitions in `interfaces` it makes the packages in `built`, with the generators of ROS 2 that are among the
wheels. PYTHON is `examples/fleet/venv/bin/python` unless it is given. It needs a C++ compiler and the headers of
Python. A second run does nothing unless the definitions or that Python have changed.
"""

import hashlib
import os
import pathlib
import shutil
import subprocess
import sys
import sysconfig

HERE = pathlib.Path(__file__).resolve().parent
DEFINITIONS, BUILT = HERE / "interfaces", HERE / "built"
# What the generators need. One of the two has no wheel.
TOOLS = (
    "empy==3.3.4 --hash=sha256:73ac49785b601479df4ea18a7c79bc1304a8a7c34c02b9472cf1206ae88f01b3\n"
    "lark==1.3.1 --hash=sha256:c629b661023a014c37da873b4ff58a817398d12635d3bbb2c5a03be7fe5d1e12\n"
)
# Packages whose messages are parts of those that are compiled.
PARTS = ("action_msgs", "builtin_interfaces", "geometry_msgs", "service_msgs", "std_msgs", "unique_identifier_msgs")
SUPPORT = "rosidl_typesupport_fastrtps_c"


def stamp(python: pathlib.Path) -> str:
    """What the packages depend on."""
    digest = hashlib.sha256(pathlib.Path(__file__).read_bytes() + str(python).encode())
    for file in sorted(DEFINITIONS.rglob("*.idl")):
        digest.update(file.read_bytes())
    return digest.hexdigest()


def run(command: list[str], problem: str, environment: dict[str, str] | None = None) -> None:
    """Runs a command, and ends this program if it fails."""
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True)
    except FileNotFoundError:
        sys.exit(f"interfaces.py: {problem}: there is no `{command[0]}`")
    if done.returncode != 0:
        sys.exit(f"interfaces.py: {problem}: {' '.join(command)}\n{done.stdout}{done.stderr}")


def install_tools(folder: pathlib.Path) -> None:
    """Installs what the generators need."""
    requirements = folder.with_suffix(".txt")
    requirements.write_text(TOOLS)
    options = ["--quiet", "--disable-pip-version-check", "--no-deps", "--require-hashes"]
    command = [sys.executable, "-m", "pip", "install", *options, "--target", str(folder), "-r", str(requirements)]
    run(command, "what the generators need cannot be installed")


def generate(target: pathlib.Path) -> None:
    """Generates the code of all packages; runs in the Python with the generators."""
    from rosidl_generator_c.cli import GenerateC
    from rosidl_generator_py.cli import GeneratePython
    from rosidl_generator_type_description.cli import HashTypeDescription
    from rosidl_typesupport_c.cli import GenerateCTypesupport
    from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport

    share = [os.path.join(sys.prefix, "share")]
    for package in sorted(DEFINITIONS.iterdir()):
        out = target / package.name
        files = sorted(file.relative_to(package) for file in package.rglob("*.idl"))
        definitions = [f"{package}:{file}" for file in files]
        hashes = HashTypeDescription("hashes").generate_type_hashes(package.name, definitions, share, out)
        of_types = [str(file) for file in hashes if file.stem in {file.stem for file in files}]
        GenerateC("c").generate(package.name, definitions, share, out, type_description_files=of_types)
        python = GeneratePython("py", typesupport_implementations=["rosidl_typesupport_c"])
        python.generate(package.name, definitions, share, out)
        support = GenerateCTypesupport("c", typesupport_implementations=[SUPPORT])
        support.generate(package.name, definitions, share, out)
        GenerateFastRTPSCTypesupport("fastrtps_c").generate(package.name, definitions, share, out)
        (out / "__init__.py").touch()


def compile_package(package: pathlib.Path, environment: pathlib.Path) -> None:
    """Compiles the generated code of a package to the one library that Python loads."""
    [numpy] = environment.glob("lib/python*/site-packages/numpy/_core/include")
    headers = [environment / "include", *sorted((environment / "include").iterdir()), package.parent, numpy]
    include = [f"-I{folder}" for folder in [*headers, sysconfig.get_paths()["include"]]]
    libraries = sorted(
        file
        for part in PARTS
        for kind in ("generator_c", "generator_py", "typesupport_c", "typesupport_fastrtps_c")
        for file in environment.glob(f"lib/lib{part}__rosidl_{kind}.so")
    )
    libraries += sorted(environment.glob("lib/librosidl_runtime_c.so"))
    libraries += sorted(environment.glob("lib/librosidl_typesupport_*c*.so"))
    libraries += sorted(environment.glob("lib/libfastcdr.so"))
    objects = []
    for source in sorted([*package.rglob("*.c"), *package.rglob("*.cpp")]):
        compiler = ["cc"] if source.suffix == ".c" else ["c++", "-std=c++17"]
        objects.append(f"{source}.o")
        command = [*compiler, "-fPIC", "-w", "-c", str(source), "-o", objects[-1], *include]
        run(command, "the generated code cannot be compiled")
    library = package / f"{package.name}_s__rosidl_typesupport_c.so"
    linked = ["-shared", "-o", str(library), *objects, *map(str, libraries), f"-Wl,-rpath,{environment / 'lib'}"]
    run(["c++", *linked], "the generated code cannot be linked")
    for file in map(pathlib.Path, objects):
        file.unlink()


def main() -> None:
    """Makes the packages, unless they are there."""
    if sys.argv[1:2] == ["--generate"]:
        generate(pathlib.Path(sys.argv[2]))
        return
    default = HERE.parent / "fleet" / "venv" / "bin" / "python"
    python = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else default).absolute()
    if not python.is_file():
        sys.exit(f"interfaces.py: there is no {python}: python3.11 examples/set_up.py examples/fleet makes it")
    done = BUILT / "stamp"
    if done.is_file() and done.read_text() == stamp(python):
        print(f"{BUILT} is up to date")
        return
    shutil.rmtree(BUILT, ignore_errors=True)
    BUILT.mkdir()
    environment = python.parent.parent
    tools = BUILT / "tools"
    install_tools(tools)
    paths = {**os.environ, "PYTHONPATH": str(tools), "AMENT_PREFIX_PATH": str(environment)}
    command = [str(python), __file__, "--generate", str(BUILT)]
    run(command, "the code of the packages cannot be generated", paths)
    for package in DEFINITIONS.iterdir():
        compile_package(BUILT / package.name, environment)
    shutil.rmtree(tools)
    done.write_text(stamp(python))
    print(f"{BUILT} is ready")


if __name__ == "__main__":
    main()
