"""fpga.rewrite: what is rewritten does the same, cycle for cycle."""

import random
import re

import cocotb
import pytest
from cocotb.triggers import RisingEdge

from fpga.rewrite.rewrite import rewrite
from sim.cosim import verilate
from tests.streams import start

# As Yosys writes: a wire for each operator, of the width that the operator has there.
EXPRESSIONS = [
    # wires of the operators, what is assigned to an output, and the output's width
    ([("[3:0]", "a + b")], "{ \\$1 , c }", 8),  # as wide as its operands: no carry
    ([("[4:0]", "a + b")], "{ \\$1 , c }", 8),  # wider: the carry would be lost
    ([("[4:0]", "a + b")], "\\$1 ", 5),
    ([("[4:0]", "a + b")], "\\$1 [3:0]", 4),
    ([("[4:0]", "a + b")], "\\$1 [4:1]", 4),
    ([("[4:0]", "a - b"), ("[5:0]", "$signed(\\$1 ) + $signed({ 1'h0, c })")], "\\$2 [3:0]", 4),
    ([("[4:0]", "a - b"), ("[5:0]", "$signed(\\$1 ) + $signed({ 1'h0, c })")], "\\$2 ", 6),
    (
        [("[3:0]", "$signed(a) + $signed(c)")],
        "{ 2'h0, a } + \\$1 ",
        8,
    ),  # of the sign of its context
    ([("[4:0]", "a + b"), ("", "\\$1  < c")], "\\$2 ", 1),
    ([("[4:0]", "a + b"), ("", "\\$1  == 5'h10")], "\\$2 ", 1),
    ([("[3:0]", "~ a"), ("[7:0]", "{ 4'h0, c } + \\$1 ")], "\\$2 ", 8),  # zeros above, not ones
    ([("[3:0]", "~ a"), ("[3:0]", "\\$1  & b")], "\\$2 ", 4),
    ([("[3:0]", "~ a")], "\\$1  + { 4'h0, b }", 8),
    ([("[2:0]", "a + b")], "{ 1'h1, \\$1  }", 8),  # narrower
    ([("", "a == b"), ("[4:0]", "\\$1  ? 5'h00 : \\$3 "), ("[4:0]", "a + 1'h1")], "\\$2 [3:0]", 4),
    ([("", "a == b"), ("[4:0]", "\\$1  ? 5'h1f : \\$3 "), ("[4:0]", "a + 1'h1")], "\\$2 [3:0]", 4),
    ([("[3:0]", "a >> c"), ("[7:0]", "\\$1  * b")], "\\$2 ", 8),
    ([("[7:0]", "a << c")], "\\$1 [3:0]", 4),
    ([("[7:0]", "a << c"), ("[3:0]", "b >> \\$1 ")], "\\$2 ", 1),
    ([("[3:0]", "$signed(a) >>> c")], "{ b, \\$1  }", 8),
    ([("[3:0]", "$signed(a) >>> c")], "\\$1  ^ b", 4),
    ([("", "| a"), ("", "! b"), ("", "& c"), ("", "\\$1  ^ \\$2 ")], "\\$4  | \\$3 ", 8),
    ([("", "^ a"), ("[1:0]", "\\$1  + \\$1 ")], "{ \\$2 , \\$1  }", 8),  # used twice
    ([("[3:0]", "a * b"), ("[7:0]", "\\$1  * c")], "{ \\$1 , \\$2  }", 8),
    ([("", "$signed(a) < $signed(b)"), ("", "a < b")], "{ \\$1 , \\$2  }", 8),
    ([("[4:0]", "5'h13")], "{ \\$1 [4:2], \\$1 [0] }", 8),
    ([("[5:0]", "{ a, c[1:0] }")], "\\$1 [4:1]", 4),
]


def module(name: str) -> str:
    """A module with an output for each expression, of a register, and of a process."""
    outputs = "".join(f"o{k}, " for k in range(len(EXPRESSIONS)))
    lines = [f"module {name}(clk, rst, a, b, c, {outputs}r, s);"]
    for port, bits in (("clk", ""), ("rst", ""), ("a", "[3:0] "), ("b", "[3:0] "), ("c", "[3:0] ")):
        lines += [f"  input {bits}{port};", f"  wire {bits}{port};"]
    body, number = [], 0
    for k, (wires, result, width) in enumerate(EXPRESSIONS):

        def renumber(text, number=number):
            return re.sub(r"\\\$(\d+)", lambda m: f"\\${int(m[1]) + number}", text)

        for j, (bits, text) in enumerate(wires, 1):
            bits, name = f"{bits} " if bits else "", f"\\${number + j}"
            lines.append(f"  wire {bits}{name} ;")
            body.append(f"  assign {name}  = {renumber(text)};")
        lines += [f"  {kind} [{width - 1}:0] o{k};" for kind in ("output", "wire")]
        body.append(f"  assign o{k} = {renumber(result)};")
        number += len(wires)
    lines += [
        "  reg \\$auto$verilog_backend.cc:1:dump_module$9  = 0;",
        "  output [3:0] r;",
        "  reg [3:0] r = 4'h5;",
        "  output [3:0] s;",
        "  reg [3:0] s;",
        "  reg [3:0] \\$900 ;",
        "  wire \\begin ;",
        "  wire [1:0] \\b.high ;",
        "  wire [3:0] intersect;",
        *body,
        "  assign \\begin  = a[0];",
        "  assign \\b.high  = b[3:2];",
        "  assign intersect = a;",
        "  always @(posedge clk)",
        "    r <= \\$900 ;",
        "  always @* begin",
        "    if (\\$auto$verilog_backend.cc:1:dump_module$9 ) begin end",
        "    \\$900  = r;",
        "    if (\\begin ) begin",
        "      \\$900 [1:0] = b[3:2];",
        "    end",
        "    if (rst) begin",
        "      \\$900  = 4'h5;",
        "    end",
        "  end",
        "  always @* begin",
        "    if (\\$auto$verilog_backend.cc:1:dump_module$9 ) begin end",
        "    s = 4'h3;",
        "    casez (intersect)",
        "      4'h1:",
        "          s = b;",
        "      4'h2:",
        "          /* empty */;",
        "    endcase",
        "  end",
        "endmodule",
    ]
    return "\n".join(lines) + "\n"


def both() -> str:
    """A module with the ports of what is rewritten and of what it is of, side by side."""
    names = [*(f"o{k}" for k in range(len(EXPRESSIONS))), "r", "s"]
    widths = [*(width for _, _, width in EXPRESSIONS), 4, 4]
    ports = [
        f"output wire [{w - 1}:0] {side}_{n}"
        for side in "xy"
        for n, w in zip(names, widths, strict=True)
    ]
    head = "input wire clk, input wire rst, input wire [3:0] a, input wire [3:0] b, input [3:0] c"
    inner = ["clk", "rst", "a", "b", "c"]
    text = f"module both({', '.join([head, *ports])});\n"
    for side, name in (("x", "original"), ("y", "rewritten")):
        links = [f".{p}({p})" for p in inner] + [f".{n}({side}_{n})" for n in names]
        text += f"{name} {name}_i ({', '.join(links)});\n"
    return text + "endmodule\n"


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def all_inputs_give_the_same(dut):
    await start(dut, a=0, b=0, c=0)
    for k in random.sample(range(4096), 4096):
        dut.a.value, dut.b.value, dut.c.value = k & 15, k >> 4 & 15, k >> 8
        dut.rst.value = random.random() < 0.1
        await RisingEdge(dut.clk)
        for name in [*(f"o{n}" for n in range(len(EXPRESSIONS))), "r", "s"]:
            x, y = (getattr(dut, f"{side}_{name}").value for side in "xy")
            assert x == y, f"{name} of {k:x}: {EXPRESSIONS[int(name[1:])] if name[1:] else ''}"


def test_it_means_the_same(tmp_path, seed):
    after = rewrite(module("rewritten"), "rewritten", {})
    original = module("original").replace("intersect", "chosen")
    folder = verilate.build_text([both(), original, after], top="both")
    verilate.run(folder, __name__, tmp_path, top="both", COCOTB_RANDOM_SEED=seed)


def test_names_are_plain_and_few():
    after = rewrite(module("rewritten"), "rewritten", {})
    assert "\\" not in after and "$" not in re.sub(r"\$signed", "", after)
    assert after.count("assign") < 0.8 * module("rewritten").count("assign")
    assert "if (a[0])" in after or "if (begin_2)" in after
    assert "r[1:0] <= b_high;" in after, "a register and its next value in one process"
    assert "intersect_2" in after, "words of SystemVerilog are no names"


def test_modules_that_are_alike_are_one():
    unit = "module \\top.{0} (i, o);\n  input i;\n  wire i;\n  output o;\n  wire o;\n{1}endmodule\n"
    first = unit.format("x.left", "  wire \\$1 ;\n  assign o = \\$1 ;\n  assign \\$1  = ~ i;\n")
    other = unit.format("right", "  assign o = ~ i;\n").replace("i;", "\\go$3 ;")
    other = other.replace("(i,", "(\\go$3 ,").replace("~ i", "~ \\go$3 ")
    top = (
        "module top(a, b);\n  input a;\n  wire a;\n  output b;\n  wire b;\n  wire mid;\n"
        "  \\top.x.left  left (\n    .i(a),\n    .o(mid)\n  );\n"
        "  \\top.right  \\right$4  (\n    .\\go$3 (mid),\n    .o(b)\n  );\nendmodule\n"
    )
    kinds = {"top.x.left": "inverter", "top.right": "inverter"}
    text = rewrite(top + first + other, "top", kinds)
    assert re.findall(r"^module (\w+)", text, re.MULTILINE) == ["top", "top_inverter"]
    assert text.count("top_inverter ") == 3 and "  top_inverter right (" in text
    assert ".i(mid)" in text


@pytest.mark.parametrize("line", ["  wire signed [3:0] x;", "  generate"])
def test_other_verilog_is_refused(line):
    with pytest.raises(ValueError, match="top: "):
        rewrite(f"module top();\n{line}\nendmodule\n", "top", {})
