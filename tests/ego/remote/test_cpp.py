"""The C++ header, with the compiler's sanitizers: no message makes it read what is not its own."""

import shutil
import socket
import struct
import subprocess
from pathlib import Path

import msgpack
import numpy as np
import pytest
from tests.approval import approve
from tests.ego.remote.asked import N, observation, scene

from bridgegen.drivers.remote.messages import MAX_FRAME, pack, unpack

CPP = Path(__file__).parents[3] / "docs" / "examples" / "cpp"
PROBE = """
#include "bridgegen.hpp"
#include <cstdio>

struct Probe : bridgegen::Driver {
  std::string name() const override { return "probe"; }
  void reset(std::size_t, const bridgegen::Value& scene) override {
    const std::size_t i = scene["i"].size();
    if (i == 7) throw 7;
    if (i == 8) throw std::runtime_error("\\xff\\xfe");
    std::fprintf(stderr, "%g\\n", scene["array"].array()(i));
  }
  void act(const bridgegen::Value& seen, std::vector<double>& a, std::vector<double>&) override {
    const auto found = seen["array"].array();
    a.assign(1, found(seen["i"].size(), seen["j"].size(), seen["k"].size()));
  }
};

int main() { Probe probe; return bridgegen::serve(probe); }
"""
HELLO = {"type": "hello", "protocol": 1, "software": "a test"}


@pytest.fixture(scope="module")
def programs(tmp_path_factory):
    """The example and a probe, with sanitizers that end the process at the first error."""
    folder = tmp_path_factory.mktemp("cpp")
    (folder / "probe.cpp").write_text(PROBE)
    compiler = shutil.which("g++")
    if compiler is None:
        pytest.skip("there is no g++")
    words = [compiler, "-std=c++17", "-O1", "-fsanitize=address,undefined", f"-I{CPP}"]
    words += ["-fno-sanitize-recover=all"]
    for source in (CPP / "main.cpp", folder / "probe.cpp"):
        made = subprocess.run([*words, "-o", folder / source.stem, source], capture_output=True)
        if b"cannot find" in made.stderr:
            pytest.skip("there are no sanitizers")
        assert made.returncode == 0, made.stderr
    return folder


class Program:
    """A program, and frames to and from it."""

    def __init__(self, path):
        self.process = subprocess.Popen(
            [path], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for pipe in (self.process.stdin, self.process.stdout):
            pipe.close()
        self.process.kill()
        self.process.wait()

    def ask(self, data):
        frame = data if isinstance(data, bytes) else pack(data)[4:]
        self.process.stdin.write(struct.pack("<I", len(frame)) + frame)
        self.process.stdin.flush()
        head = self.process.stdout.read(4)
        assert len(head) == 4, "it has ended"
        return unpack(self.process.stdout.read(*struct.unpack("<I", head)))


def array(shape, data=b"", dtype="float64"):
    return {"dtype": dtype, "shape": shape, "data": data}


def reset(i=0, n=1, **found):
    return msgpack.packb({"type": "reset", "n": n, "scene": {"i": i, **found}})


def act(i, j, k):
    seen = {"array": array([1, 2, 2], np.arange(4.0).tobytes()), "i": i, "j": j, "k": k}
    return msgpack.packb({"type": "act", "observation": seen})


@pytest.mark.parametrize(
    ("sent", "message"),
    [
        (reset(2**61 - 1, array=array([1], bytes(8))), "too short"),
        (reset(array=array([2], bytes(8))), "size of its shape"),
        (reset(array=array([2**62, 2**62], b"")), "too large"),
        (reset(array=array([0, 2**40], b"")), "too large"),
        (reset(array=array([1], bytes(8), "float16")), "unknown type"),
        (reset(array=array([-1], bytes(8))), "a size must be >= 0"),
        (reset(array=array([1.5], bytes(8))), "a size must be >= 0"),
        (reset(array=3), "has no"),
        (reset(n=2**40), "too many scenarios"),
        (reset(n=2**64 - 1), "too large"),
        (reset(7), "no std::exception"),
        (reset(8), "??"),
        (act(0, 2, 0), "no element"),
        (act(0, 0, 2), "no element"),
        (act(2**62, 2**62, 2**62), "no element"),
        (b"", "ends too early"),
        (b"\xc1", "no msgpack"),
        (b"\xdd\xff\xff\xff\xff", "too many parts"),
        (b"\xdf\x00\x4c\x4b\x40" + b"\xa0\xc0", "ends too early"),
        (b"\xc6\xff\xff\xff\xff", "ends too early"),
        (b"\x91" * 40, "nested too deeply"),
        (b"\x81\x01\x02", "a key must be a text"),
        (msgpack.packb(HELLO) + b"\x00", "more follows"),
        (msgpack.packb({"type": 3}), "unknown type"),
        (b"\x90", "has no 'type'"),
    ],
    ids=lambda one: one if isinstance(one, str) else "",
)
def test_a_hostile_message_is_answered_with_an_error(programs, sent, message):
    with Program(programs / "probe") as program:
        answer = program.ask(sent)
        assert answer["type"] == "error"
        assert message in answer["message"]
        assert program.ask(HELLO)["name"] == "probe"


def test_an_element_is_where_it_should_be(programs):
    with Program(programs / "probe") as program:
        program.ask(reset(array=array([1], bytes(8))))
        assert program.ask(act(0, 1, 0))["acceleration"].tolist() == [2.0]


def test_mutated_messages_end_it_never(programs):
    good = [pack(one)[4:] for one in (HELLO, {"type": "reset", "n": N, "scene": scene()})]
    good.append(pack({"type": "act", "observation": observation()})[4:])
    random = np.random.default_rng(3)
    with Program(programs / "main") as program:
        for _ in range(600):
            data = bytearray(good[random.integers(len(good))])
            for at in random.integers(0, min(len(data), 400), random.integers(1, 6)):
                data[at] = random.integers(256)
            assert program.ask(bytes(data[: random.integers(1, 2 * len(data))]))["type"]
        assert [program.ask(one)["type"] for one in good] == ["hello", "ready", "control"]


def test_an_early_end_and_a_closed_pipe_end_it_in_order(programs):
    for sent in (b"", b"\x05\x00", struct.pack("<I", 9) + b"abc", struct.pack("<I", MAX_FRAME + 1)):
        with Program(programs / "main") as program:
            program.process.stdin.write(sent)
            program.process.stdin.close()
            assert program.process.wait(20.0) == 0
    with Program(programs / "main") as program:
        program.process.stdout.close()
        program.process.stdin.write(pack(HELLO))
        program.process.stdin.flush()
        assert program.process.wait(20.0) == 0  # and not by SIGPIPE


@pytest.mark.parametrize("port", ["", "x", "0", "65536", "5555x"])
def test_what_is_no_port_is_refused(programs, port):
    found = subprocess.run([programs / "main", port], capture_output=True, text=True, timeout=20)
    assert found.returncode == 1
    approve(found.stderr, "65535")


def test_a_port_in_use_is_refused(programs):
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = str(other.getsockname()[1])
        found = subprocess.run([programs / "main", port], capture_output=True, timeout=20)
    assert found.returncode == 1
    assert b"cannot be listened on" in found.stderr
