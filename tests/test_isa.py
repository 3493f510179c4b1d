"""What a call costs in AMD's machine code: the compiler is asked for the same thing each time, and without branches."""

import re

import numpy as np
import pytest

from lobe.lab import catalogue, gl, isa, spirv
from lobe.lab.errors import InputError

LIBRARY = catalogue.load()


@pytest.fixture(scope="module")
def tools():
    try:
        isa.require_tools()
    except InputError as error:
        pytest.skip(str(error))


def test_more_work_costs_more_and_none_costs_nothing(tools):
    inputs = {"x": "float", "y": "float"}
    nothing, one, root = (isa.cost("", call, "float", inputs) for call in ("x + y", "x * y + y", "sqrt(x + y) * y"))
    assert (nothing.instructions, nothing.inverse_throughput, nothing.branches) == (0, 0, 0)
    assert 0 <= one.inverse_throughput < root.inverse_throughput
    assert root.latency > one.latency


def test_channels_are_not_merged(tools):
    """Were the three channels of f0 equal to the compiler, Schlick's term would cost as much as of one channel."""
    grey, colour = (isa.cost("", "f0 * x * x + x", kind, {"x": "float", "f0": kind}) for kind in ("float", "vec3"))
    assert colour.inverse_throughput > grey.inverse_throughput


EARLY = """float early(float x) {
    if (x < 0.5) return sqrt(x);
    float y = sin(x) / (x + 1.0);
    if (y < 0.2) return exp(y) * y;
    float z = 0.0;
    if (x > 0.6) { if (y > 0.4) return y * y + 3.0; z = 0.1; }
    if (x > 0.9) { z = log(x); if (y > 0.45) return z; z += inversesqrt(x); } else z = cos(y * x);
    for (int i = 0; i < 3; ++i) z = sqrt(z * z + x);
    return z;
}
"""


def test_early_returns_and_loops_leave_no_branch(tools):
    assert isa.cost(EARLY, "early(x)", "float", {"x": "float"}).branches == 0


def test_driver_and_stage_are_named_where_unknown():
    with pytest.raises(InputError, match="expected a GPU of NAVI21"):
        isa.cost("", "x", "float", {"x": "float"}, gpu="NAVI99")


def test_flattened_code_decides_as_the_branches_did(tools, tmp_path):
    """Of the selects alone: both texts, with arithmetic done by NumPy, against OpenGL on the source itself."""
    x = np.random.default_rng(5).uniform(0, 1, 4096).astype(np.float32)
    call = isa.Call(EARLY, "early(x)", "float", (("x", "float"),))
    binary = isa._spirv(isa.shader(call, "fragment"), tmp_path / "early.frag")
    got = interpreted(isa._tool("spirv-dis", "--raw-id", binary), {"x": x})
    context = gl.create_context("egl")
    expected = gl.evaluate(context, EARLY, "early(x)", "float", {"x": x[None, :, None]})[:, 0]
    close = np.isclose(got, expected, rtol=1e-4, atol=1e-5)
    assert close.mean() > 0.995, x[~close][:9]  # built-ins differ in last digits: beside a jump either side may do


_ARITHMETIC = {
    "OpFAdd": np.add, "OpFSub": np.subtract, "OpFMul": np.multiply, "OpFDiv": np.divide, "OpFNegate": np.negative,
    "OpFOrdLessThan": np.less, "OpFOrdGreaterThan": np.greater, "OpLogicalNot": np.logical_not,
    "OpLogicalOr": np.logical_or, "OpLogicalAnd": np.logical_and, "OpCopyObject": lambda a: a, "OpSelect": np.where,
    "Sqrt": np.sqrt, "Sin": np.sin, "Cos": np.cos, "Exp": np.exp, "Log": np.log,
    "InverseSqrt": lambda a: 1 / np.sqrt(a),
}


def interpreted(text: str, inputs: dict[str, np.ndarray]) -> np.ndarray:
    """What one block of scalar SPIR-V stores in its first channel."""
    names = {m[1]: m[2] for m in re.finditer(r'OpName (%\d+) "(\w+)"', text)}
    values = {}
    for line in text.splitlines():
        if not (m := re.match(r"\s*(%\w+) = (\w+) ?(.*)", line)):
            continue
        name, operation, operands = m[1], m[2], m[3].split()
        if operation == "OpConstant":
            values[name] = np.float64(operands[1]) if re.match(r"-?[\d.e+-]+$", operands[1]) else None
        elif operation in ("OpConstantTrue", "OpConstantFalse"):
            values[name] = np.bool_(operation == "OpConstantTrue")
        elif operation == "OpLoad":
            values[name] = inputs[names[operands[1]].removeprefix("lobe_in_")].astype(float)
        elif operation == "OpExtInst":
            values[name] = _ARITHMETIC[operands[2]](*(values[o] for o in operands[3:]))
        elif operation in _ARITHMETIC:
            with np.errstate(invalid="ignore", divide="ignore"):
                values[name] = _ARITHMETIC[operation](*(values[o] for o in operands[1:]))
        elif operation == "OpCompositeConstruct":
            values[name] = values[operands[1]]
        elif operation == "OpCompositeExtract":
            values[name] = values[operands[1]]
        elif operation == "OpPhi":
            raise AssertionError("a branch is left")
    stored = re.search(r"OpStore %\w+ (%\w+)", text)[1]
    return values[stored]


def test_a_loop_is_no_straight_line():
    with pytest.raises(spirv.NotFlat):
        spirv.flattened("""%main = OpFunction %void None %3
%5 = OpLabel
OpBranch %6
%6 = OpLabel
OpLoopMerge %8 %7 None
OpBranch %7
%7 = OpLabel
OpBranch %6
%8 = OpLabel
OpReturn
OpFunctionEnd
""")
