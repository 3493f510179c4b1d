"""The ways in: the launcher, CMake, pip. Nothing here touches the system or the network: apt, sudo and the Python that
the launcher calls are stand-ins that write down what they were asked."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from importlib import metadata
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TOOLS = dict(os.environ, PATH=f"{Path(sys.executable).parent}:{os.environ['PATH']}")  # cmake and ninja come with pip


def run(*command, **options):
    """The standard output of a command that must succeed."""
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, **{"env": TOOLS} | options)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def cmake(*arguments):
    return run("cmake", *arguments)


# --- versions


def cmake_version():
    return re.search(r"project\(lobe VERSION (\d+)\.(\d+)\.(\d+)", (ROOT / "CMakeLists.txt").read_text()).groups()


def test_versions_of_cmake_glsl_and_python_agree():
    major, minor, patch = map(int, cmake_version())
    integer = re.search(r"#define LOBE_VERSION (\d+)", (ROOT / "glsl" / "core.glsl").read_text()).group(1)
    assert int(integer) == 10000 * major + 100 * minor + patch
    assert metadata.version("lobe") == f"{major}.{minor}.{patch}"


# --- CMake


def test_consumer_project_builds_with_the_installed_package(tmp_path):
    shaders, consumer, prefix = tmp_path / "shaders", tmp_path / "consumer", tmp_path / "prefix"
    cmake("-S", ROOT, "-B", shaders, "-G", "Ninja", "-DLOBE_BUILD_REFERENCE=OFF")
    cmake("--install", shaders, "--prefix", prefix)
    cmake("-S", ROOT / "tests" / "consumer", "-B", consumer, "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={prefix}")
    cmake("--build", consumer)

    core, lambert = ((ROOT / "glsl" / name).read_text() for name in ("core.glsl", "lambert.glsl"))
    assert run(consumer / "consumer") == f"{len(core.encode())}\n{core}{lambert}"
    assert (prefix / "share/lobe/LICENSE").exists()
    assert not [p for p in prefix.rglob("*") if p.suffix in (".so", ".a", ".py")]


def test_reference_builds_and_passes_its_tests_without_python():
    build = ROOT / "build" / "ctest"  # kept from run to run: only what changed is compiled
    cmake("-S", ROOT, "-B", build, "-G", "Ninja")
    assert not re.findall(r"^\w*Python\w*", (build / "CMakeCache.txt").read_text(), re.M)
    cmake("--build", build)
    run("ctest", "--test-dir", build, "--output-on-failure", "--no-tests=error")


def test_reference_passes_its_tests_under_sanitizers():
    """AddressSanitizer, with undefined behaviour. Where GCC does not optimise at all it breaks off, so -Og."""
    build = ROOT / "build" / "address"
    cmake("-S", ROOT, "-B", build, "-G", "Ninja", "-DLOBE_SANITIZE=address", "-DCMAKE_BUILD_TYPE=None",
          "-DCMAKE_CXX_FLAGS=-Og")
    cmake("--build", build)
    run(build / "lobe_reference_tests", "--gtest_brief=1")


# --- pip


@pytest.mark.full
def test_wheel_carries_the_command_and_its_data(tmp_path):
    run(sys.executable, "-m", "pip", "wheel", ROOT, "--no-deps", "--no-build-isolation", "-w", tmp_path,
        "-C", f"build-dir={tmp_path}/build")
    (wheel,) = tmp_path.glob("lobe-*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    for folder in ("lab", "viewer", "glsl", "data"):
        here = {p for p in (ROOT / folder).rglob("*") if p.is_file() and "__pycache__" not in p.parts}
        expected = {f"lobe/{p.relative_to(ROOT)}" for p in here} - {"lobe/data/mesh/bunny.obj"}
        assert expected == {name for name in names if name.startswith(f"lobe/{folder}/")}

    run(sys.executable, "-m", "venv", tmp_path / "venv")
    python = tmp_path / "venv" / "bin" / "python"
    run(python, "-m", "pip", "install", "--no-deps", "--no-index", wheel)
    site = run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip()
    Path(site, "dependencies.pth").write_text(sysconfig.get_path("purelib"))
    installed = run(python.parent / "lobe", "list", cwd=tmp_path)
    assert installed == run(Path(sys.executable).parent / "lobe", "list")
    run(python.parent / "lobe", "view", "--screenshot", "window.png", "--frames", "3", cwd=tmp_path)
    assert (tmp_path / "window.png").stat().st_size > 10_000


# --- the launcher

DPKG_QUERY = """echo "installed g++"
[ -n "$MISSING" ] || for p in "$@"; do echo "installed $p"; done"""

PYTHON = """case "$*" in
"-c "*) [ -z "$OLD_PYTHON" ] ;;
"-V") echo "Python 3.9.2" ;;
"-m venv --clear "*) mkdir -p "$4/bin" && cp "$0" "$4/bin/python"
    printf '#!/bin/sh\\necho "cli $PWD $*"\\n' >"$4/bin/lobe" && chmod +x "$4/bin/lobe" ;;
*" -e "*) sleep "${PIP_SECONDS:-0}"; cat "${COMPILER:-/dev/null}"; echo "pip was here"; [ -z "$BROKEN_BUILD" ] ;;
esac"""

REAL_TOOLS = "cat chmod cksum cp dirname env find flock ls mkdir readlink sed sh sleep tail touch tr"


class Machine:
    """A clone as far as the launcher looks at it, and a PATH on which only stand-ins could do any harm."""

    def __init__(self, folder):
        self.calls = folder / "calls"
        self.clone = folder / "a clone"
        self.bin = folder / "bin"
        self.bin.mkdir()
        for tool in REAL_TOOLS.split():
            (self.bin / tool).symlink_to(shutil.which(tool))
        self.stand_in("id", "echo 1000")
        self.stand_in("apt-get", "")
        self.stand_in("apt-cache", '[ "$2" = libosmesa6 ]')
        self.stand_in("dpkg-query", DPKG_QUERY)
        self.stand_in("python3", PYTHON)
        for name in ("cmake", "lab", "reference"):
            (self.clone / name).mkdir(parents=True)
        for name in ("lobe", "pyproject.toml", "CMakeLists.txt"):
            shutil.copy(ROOT / name, self.clone)

    def stand_in(self, name, body):
        tool = self.bin / name
        tool.write_text(f'#!/bin/sh\necho "{name} $*" >>"{self.calls}"\n{body}\n')
        tool.chmod(0o755)

    def launch(self, *arguments, launcher=None, cwd=None, **environment):
        """A started launcher, without a terminal; finish() waits for it."""
        return subprocess.Popen([launcher or self.clone / "lobe", *arguments], cwd=cwd or self.clone, text=True,
                                env={"PATH": str(self.bin)} | environment, stdin=subprocess.DEVNULL,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    def start(self, *arguments, **options):
        return finish(self.launch(*arguments, **options))

    def called(self, text):
        """How many calls of stand-ins contain this text."""
        lines = self.calls.read_text().splitlines() if self.calls.exists() else []
        return sum(text in line for line in lines)


def finish(process):
    stdout, stderr = process.communicate(timeout=60)
    return process.returncode, stdout, stderr


@pytest.fixture
def machine(tmp_path):
    return Machine(tmp_path)


def test_launcher_sets_up_once_and_passes_its_arguments_on(machine):
    status, stdout, stderr = machine.start("eval", "a b")
    assert (status, stdout) == (0, f"cli {machine.clone} eval a b\n")
    assert "building the reference" in stderr
    machine.calls.unlink()
    assert machine.start("list") == (0, f"cli {machine.clone} list\n", "")
    assert not machine.calls.exists(), "a later start calls neither dpkg nor Python"


def test_launcher_works_through_a_link_from_another_folder(machine, tmp_path):
    (tmp_path / "link").symlink_to(machine.clone / "lobe")
    assert machine.start("list", launcher=tmp_path / "link", cwd=tmp_path)[:2] == (0, f"cli {tmp_path} list\n")
    assert (machine.clone / ".venv").exists()


def test_launcher_rebuilds_what_is_older_than_the_reference(machine):
    machine.start()
    machine.calls.unlink()
    (machine.clone / "reference" / "new.cpp").touch()
    assert machine.start()[0] == 0
    assert (machine.called("-m venv"), machine.called("-e ")) == (0, 1)


def test_launcher_installs_again_when_a_module_is_new(machine):
    machine.start()
    machine.calls.unlink()
    (machine.clone / "lab" / "new.py").touch()
    assert machine.start()[0] == 0
    assert (machine.called("-m venv"), machine.called("-e ")) == (0, 1)
    machine.calls.unlink()
    assert machine.start()[0] == 0 and not machine.calls.exists()


def test_launcher_makes_a_new_environment_after_the_clone_moved(machine):
    machine.start()
    machine.clone = machine.clone.rename(machine.clone.with_name("moved"))
    assert machine.start()[0] == 0
    assert machine.called("-m venv") == 2


def test_launcher_repairs_a_set_up_that_broke_off(machine):
    status, stdout, stderr = machine.start(BROKEN_BUILD="yes")
    assert (status, stdout) == (2, "")
    assert "pip was here" in stderr and str(machine.clone / "build/setup.log") in stderr
    assert machine.start()[0] == 0
    assert machine.called("-m venv") == 2


def test_launcher_shows_the_errors_of_the_compiler(machine, tmp_path):
    errors = [f"  /a/lambert.h:{i}:5: error: expected ';' before number {i}\n" for i in range(1, 8)]
    (tmp_path / "compiler").write_text("".join(errors) + "  ninja: build stopped\n" * 40)
    status, _, stderr = machine.start(BROKEN_BUILD="yes", COMPILER=str(tmp_path / "compiler"))
    assert status == 2 and "".join(errors[:5]) in stderr and "number 6" not in stderr
    assert stderr.index("number 5") < stderr.index("pip was here")


def test_two_launchers_at_once_set_up_once(machine):
    both = [machine.launch("list", PIP_SECONDS="0.5") for _ in range(2)]
    assert [finish(p)[:2] for p in both] == [(0, f"cli {machine.clone} list\n")] * 2
    assert machine.called("-m venv") == 1


def test_launcher_without_rights_says_what_to_run(machine):
    status, stdout, stderr = machine.start(MISSING="yes")
    assert (status, stdout, stderr.count("\n")) == (2, "", 1)
    assert "sudo apt-get update && sudo apt-get install --no-install-recommends libgtest-dev" in stderr
    assert "libembree-dev" in stderr and "libosmesa6" in stderr and "g++" not in stderr
    assert not machine.called("apt-get")


def test_launcher_on_another_distribution_says_what_to_install(machine):
    (machine.bin / "apt-get").unlink()
    status, _, stderr = machine.start()
    assert (status, stderr.count("\n")) == (2, 1)
    assert "libembree-dev" in stderr and "LOBE_NO_APT=1" in stderr
    assert machine.start(LOBE_NO_APT="1")[0] == 0


def test_launcher_installs_packages_as_root(machine):
    machine.stand_in("id", "echo 0")
    assert machine.start(MISSING="yes")[:2] == (0, f"cli {machine.clone} \n")
    assert machine.called("apt-get -q -y -o DPkg::Lock::Timeout=600 update") == 1
    assert machine.called("install --no-install-recommends libgtest-dev") == 1


@pytest.mark.parametrize("apt_get", ["", "exit 100"])
def test_launcher_installs_what_charts_need_and_does_without(machine, apt_get):
    assert machine.start()[0] == 0
    machine.stand_in("id", "echo 0")
    machine.stand_in("dpkg-query", "case $* in *vulkan*) ;; *) " + DPKG_QUERY.replace("\n", "; ") + " ;; esac")
    machine.stand_in("apt-get", apt_get)
    status, stdout, stderr = machine.start("chart")
    assert (status, stdout) == (0, f"cli {machine.clone} chart\n")
    assert machine.called("mesa-vulkan-drivers") > 0 and ("could not install" in stderr) == bool(apt_get)
    asked = machine.called("apt-get")
    assert machine.start("list")[0] == 0 and machine.called("apt-get") == asked, "no other command needs it"


def test_launcher_refuses_an_old_python(machine):
    status, _, stderr = machine.start(OLD_PYTHON="yes")
    assert (status, stderr.count("\n")) == (2, 1)
    assert "needs Python 3.10 or newer, python3 is Python 3.9.2" in stderr


def test_launcher_and_pyproject_name_the_same_build_tools():
    launcher, pyproject = ((ROOT / name).read_text() for name in ("lobe", "pyproject.toml"))
    requires = re.findall(r'"([^"]+)"', re.search(r"^requires = \[(.*)\]", pyproject, re.M).group(1))
    build_tools = re.search(r'^build_tools="(.*)"', launcher, re.M).group(1).split()
    assert set(requires) <= set(build_tools)
