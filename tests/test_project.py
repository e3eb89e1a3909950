"""The project's frame: what is shipped, what is pinned, what the command line costs."""

import ast
import os
import re
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from collections.abc import Iterator
from importlib import import_module
from importlib.metadata import distribution, requires, version
from pathlib import Path
from types import FunctionType

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]

# What only other commands and other logs need.
NOT_FOR_THE_SAMPLE = {
    "sqlalchemy",
    "trimesh",
    "objstate.world",
    "urllib.request",
}

# Modules that take long to load; the command line needs none of them to show its help.
HEAVY = {
    "numpy", "scipy", "numba", "polars", "trimesh", "shapely", "rosbags", "embreex", "PIL",
    "sqlalchemy", "distributed",
}  # fmt: skip


@pytest.fixture(scope="module")
def pins() -> dict[str, str]:
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pairs = [line.split("==") for line in lines if not line.startswith("#")]
    return dict(pairs)


def needed(name: str, extra: str = "", seen: frozenset[str] = frozenset()) -> frozenset[str]:
    """All distributions that ``name`` needs here, dependencies of dependencies included."""
    for text in requires(name) or []:
        requirement = Requirement(text)
        marker = requirement.marker
        own = canonicalize_name(requirement.name)
        if own in seen or (marker is not None and not marker.evaluate({"extra": extra})):
            continue
        seen = needed(own, seen=seen | {own})
    return seen


def own_extras(extra: str) -> list[str]:
    """The extras of this project that one of them pulls in."""
    wanted = [Requirement(text) for text in requires("objstate") or []]
    return [
        inner
        for requirement in wanted
        if requirement.name == "objstate"
        and requirement.marker is not None
        and requirement.marker.evaluate({"extra": extra})
        for inner in requirement.extras
    ]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel as it is built of this checkout."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    return wheel


def test_the_wheel_holds_only_the_package(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    info = f"objstate-{version('objstate')}.dist-info"
    assert {name.split("/")[0] for name in names} == {"objstate", info}
    assert "objstate/py.typed" in names
    assert "objstate/experiments/schulz2001/doors.scene.yaml" in names
    assert "objstate/experiments/schulz2001/department.urdf" in names
    assert f"{info}/licenses/LICENSE" in names


def test_the_wheel_runs_the_sample_in_an_environment_of_its_own(
    wheel: Path, tmp_path: Path
) -> None:
    here = [sys.executable, "-m"]
    home = tmp_path / "env"
    subprocess.run([*here, "venv", "--without-pip", str(home)], check=True)
    (packages,) = home.glob("lib/python*/site-packages")
    # what it depends on, as installed here; a path in a .pth file brings no editable installs along
    (packages / "here.pth").write_text(sysconfig.get_path("purelib") + "\n")
    install = [*here, "pip", "--python", str(home), "install", "--no-deps", "--no-index", "-q"]
    subprocess.run([*install, str(wheel)], check=True, capture_output=True)
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    environment["NUMBA_DISABLE_JIT"] = "1"  # compiling would take longer than all else
    log, building = ROOT / "logs/corridor.mcap", ROOT / "models/corridor/corridor.urdf"
    (tmp_path / "few.yaml").write_text("localization: {max_particles: 104}")
    shortly = ["--to", "0.2", "--config", "few.yaml", "-q"]
    objstate, python = home / "bin" / "objstate", home / "bin" / "python"
    truth = ROOT / "logs/corridor.truth.csv"
    others = [["inspect", building], ["evaluate", "result", "--truth", truth], ["report", "result"]]
    words = [[str(word) for word in arguments] for arguments in others]
    script = (
        "import sys, objstate\nfrom objstate.cli import main\nprint(objstate.__file__)\n"
        f"sys.exit(any([main(arguments) for arguments in {words!r}]))"
    )
    for command in (
        [objstate, "--version"],
        [objstate, "estimate", log, "--building", building, "--out", "result", *shortly],
        [python, "-c", script],
    ):
        done = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(str(packages))


def test_completion_knows_commands_and_options() -> None:
    environment = os.environ | {"_OBJSTATE_COMPLETE": "complete_bash", "COMP_CWORD": "1"}
    script = "from objstate.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", script],
        env=environment | {"COMP_WORDS": "objstate est"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.split() == ["estimate"]


def test_the_image_copies_what_it_installs() -> None:
    lines = (ROOT / "deploy" / "Dockerfile").read_text().splitlines()
    copied = [word for line in lines if line.startswith("COPY") for word in line.split()[1:-1]]
    kept = (ROOT / ".dockerignore").read_text().splitlines()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert {f"!{name}" for name in copied} <= set(kept)
    assert {project["readme"], *project["license-files"], "objstate"} <= set(copied)
    assert all((ROOT / name).exists() for name in copied)
    base = next(line.split()[1] for line in lines if line.startswith("FROM"))
    least = project["requires-python"].removeprefix(">=")
    assert base == f"python:{least}-slim"


def test_every_dependency_is_pinned(pins: dict[str, str]) -> None:
    for extra in ("dev", *own_extras("dev")):
        assert needed("objstate", extra) - {"objstate"} - pins.keys() == set()


def test_constraints_are_pins_and_nothing_else(pins: dict[str, str]) -> None:
    assert all(re.fullmatch(r"[a-z0-9-]+", name) for name in pins)
    assert all(re.fullmatch(r"[0-9][0-9a-z.]*", pinned) for pinned in pins.values())


def test_pins_meet_the_lower_bounds(pins: dict[str, str]) -> None:
    bounds = [Requirement(text) for text in requires("objstate") or []]
    wrong = [
        str(bound)
        for bound in bounds
        if not bound.specifier.contains(pins[canonicalize_name(bound.name)])
    ]
    assert wrong == []


def test_constants_of_the_estimator_are_defined_once() -> None:
    """A name stands for another value elsewhere only where it means something else there."""
    known = dict[tuple[str, str], str]()
    for room in ("estimator", "localization", "objects", "particles", "sensing", "smoothing"):
        for path in sorted((ROOT / "objstate" / room).rglob("*.py")):
            for name, value in constants(path.read_text()):
                first = known.setdefault((name, value), path.name)
                assert first == path.name, f"{name} = {value} in {first} and {path.name}"


def constants(source: str) -> Iterator[tuple[str, str]]:
    """The module's constants and their expressions."""
    for line in ast.parse(source).body:
        if not isinstance(line, ast.Assign):
            continue
        for target in line.targets:
            if isinstance(target, ast.Name):
                pairs = [(target, line.value)]
            else:
                together = target, line.value
                is_listed = all(isinstance(each, ast.Tuple) for each in together)
                pairs = (
                    list(zip(*(each.elts for each in together), strict=True)) if is_listed else []
                )
            for name, value in pairs:
                if name.id.isupper():
                    yield name.id, ast.unparse(value)


def test_the_version_is_one() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    changelog = (ROOT / "CHANGELOG.md").read_text()
    assert project["version"] == distribution("objstate").version
    assert f"## {project['version']}" in changelog


def test_help_loads_nothing_heavy() -> None:
    script = (
        "import sys; from objstate.cli import main; main(['--help']); "
        "main(['estimate', '--help']); main(['world', 'at', '--help']); print(*sys.modules, file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], check=True, capture_output=True, text=True
    )
    loaded = {name.split(".")[0] for name in done.stderr.split()}
    assert loaded & HEAVY == set()
    assert "objstate" in loaded


def test_an_estimate_loads_only_what_it_needs(tmp_path: Path) -> None:
    log, building = (
        ROOT / each for each in ("logs/corridor.mcap", "models/corridor/corridor.urdf")
    )
    script = (
        "import sys; from objstate.cli import main; "
        f"main(['estimate', '{log}', '--building', '{building}', '--to', '1', '--out', '{tmp_path}/out']); "
        "print(*sys.modules, file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], check=True, capture_output=True, text=True
    )
    loaded = set(done.stderr.split())
    assert loaded & NOT_FOR_THE_SAMPLE == set()
    assert "numba" in loaded


@pytest.mark.parametrize(
    "name", ["", ".batch", ".gaze", ".grid", ".maintenance", ".report", ".world"]
)
def test_what_is_public_says_what_it_is(name: str) -> None:
    module = import_module(f"objstate{name}")
    public = [(each, getattr(module, each)) for each in module.__all__]
    parts = [
        (f"{each}.{part}", value)
        for each, kind in public
        if isinstance(kind, type)
        for part, value in vars(kind).items()
        if not part.startswith("_") and isinstance(value, property | FunctionType | staticmethod)
    ]
    named = [(each, value) for each, value in public if getattr(value, "__name__", "") == each]
    assert [each for each, value in [*named, *parts] if not value.__doc__] == []
