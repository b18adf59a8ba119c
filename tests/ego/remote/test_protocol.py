"""The schema of the protocol: every message of both ends obeys it."""

import importlib.util
import json
import re
from dataclasses import replace
from pathlib import Path

import jsonschema
import msgpack
import numpy as np
import pytest
from tests.ego.drivers import Cruises, Raises
from tests.ego.remote.asked import N, observation, road_map, scene, with_all
from tests.ego.remote.remote_drivers import Plans

from bridgegen.drivers import views
from bridgegen.drivers.driver_process import DriverError
from bridgegen.drivers.remote import messages, server
from bridgegen.drivers.remote.messages import pack, unpack
from bridgegen.drivers.remote.process import RemoteDriver

DOCS = Path(__file__).parents[3] / "docs"
FILE = Path(messages.__file__).with_name("protocol.json")
SCHEMA = json.loads(FILE.read_text("utf-8"))


def test_the_schema_is_up_to_date():
    """Otherwise: python docs/make_protocol.py."""
    spec = importlib.util.spec_from_file_location("make_protocol", DOCS / "make_protocol.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    assert FILE.read_text("utf-8") == script.text()


def validate(message, part):
    """Hold a message, as msgpack reads it, against a part of the schema; arrays, too."""
    schema = {"$ref": f"#/$defs/{part}", "$defs": SCHEMA["$defs"]}
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    jsonschema.Draft202012Validator(schema).validate(message)
    arrays = []
    compare(message, SCHEMA["$defs"][part], {"N": N}, arrays)
    return arrays


def compare(value, schema, sizes, arrays):
    """Hold the arrays in a value against what the schema says of type and shape."""
    if "anyOf" in schema:
        if value is not None:
            compare(value, schema["anyOf"][0], sizes, arrays)
        return
    name = schema.get("$ref", "").rpartition("/")[2]
    if name == "array":
        assert value["dtype"] == schema["dtype"] or schema["dtype"] == "any but bool"
        assert len(value["data"]) == np.dtype(value["dtype"]).itemsize * np.prod(value["shape"])
        shapes = [re.findall(r"\w+", one) for one in schema["shape"].split(" or ")]
        letters = next(one for one in shapes if len(one) == len(value["shape"]))
        for letter, size in zip(letters, value["shape"], strict=True):
            known = int(letter) if letter.isdecimal() else sizes.get(letter, size)
            is_left_out = size == 0 and "empty" in schema.get("description", "")
            assert size == known or is_left_out, (schema, letter)
        arrays.append(schema)
    elif name:
        compare(value, SCHEMA["$defs"][name], sizes, arrays)
    elif "items" in schema and value is not None:
        for one in value:
            compare(one, schema["items"], sizes, arrays)
    else:
        assert set(value) <= set(schema["properties"]) if "properties" in schema else True
        for key, inner in schema.get("properties", {}).items():
            if key in value:
                compare(value[key], inner, sizes, arrays)


def reply(driver, message):
    """What the driver's end answers to a message."""
    return msgpack.unpackb(pack(server._answer(driver, unpack(message), []))[4:])


@pytest.mark.parametrize("make", [Cruises, Plans])
def test_an_exchange_obeys_the_schema(make):
    driver = make()
    given, seen = with_all() if make is Plans else (scene(), observation())
    exchange = (
        ("hello", {"protocol": 1, "software": "BridgeGen"}, "hello"),
        ("reset", {"n": N, "scene": given}, "ready"),
        ("act", {"observation": seen}, "trajectory" if make is Plans else "control"),
    )
    for request, parts, answer in exchange:
        message = pack({"type": request, **parts})[4:]
        asked = validate(msgpack.unpackb(message), f"request_{request}")
        answered = validate(reply(driver, message), f"answer_{answer}")
    assert len(asked) == (17 if make is Plans else 12)
    assert len(answered) == (5 if make is Plans else 2)


def test_errors_obey_the_schema(tmp_path):
    class Pipe(list):
        def write(self, data):
            self.append(bytes(data))

        def flush(self):
            pass

    path, out = tmp_path / "in", Pipe()
    questions = [{"type": "hello"}, {"type": "act", "observation": observation()}, {"type": "no"}]
    path.write_bytes(b"".join(map(pack, questions)) + b"\x01\x00\x00\x00\xc1")
    with path.open("rb") as file:
        server._converse(Raises, file, out)
    found = [msgpack.unpackb(one[4:]) for one in out]
    for one in found[1:]:
        validate(one, "answer_error")
    assert [one.get("kind") for one in found] == [None, "raised", *["answered nonsense"] * 2]


class Noted:
    """A wire to a server's end in this process; it notes the length of each request."""

    has_more = is_json = False

    def __init__(self, driver):
        self.driver, self.maps, self.sent = driver, [], []

    def ask(self, frame, seconds):
        message = msgpack.unpackb(frame[4:])
        validate(message, f"request_{message['type']}")
        self.sent.append(len(frame))
        return pack(server._answer(self.driver, unpack(frame[4:]), self.maps))[4:]

    def close(self):
        pass


class Keeps:
    """Notes the maps of its scenes."""

    def __init__(self):
        self.seen = []

    def reset(self, n, scene):
        self.seen.append([one.route[0] for one in scene.maps])


def test_a_map_is_sent_once_to_a_driver_that_keeps_them(monkeypatch):
    one, two, three = (replace(road_map(), route=(name,)) for name in "123")
    wanted = [(one, two), (two,), (), (three, one), (two, two)]
    sent = {}
    for keeps in (True, False):
        driver = Keeps()
        wire = Noted(driver)
        remote = RemoteDriver(wire, {"keeps_maps": keeps}, DriverError)
        for maps in wanted:
            remote.reset(N, scene(maps=maps, map_of=np.zeros(N, np.int64)))
        assert driver.seen == [[x.route[0] for x in maps] for maps in wanted]
        sent[keeps] = wire.sent
    bare = min(sent[False])
    assert sent[True][1] < bare + 100 < sent[False][1]
    assert sent[True][4] < bare + 100
    monkeypatch.setattr(views, "MOST_PIECES", 1)  # then it begins anew
    remote = RemoteDriver(Noted(Keeps()), {"keeps_maps": True}, DriverError)
    for maps in wanted:
        remote.reset(N, scene(maps=maps, map_of=np.zeros(N, np.int64)))
    assert remote._wire.driver.seen == [[x.route[0] for x in maps] for maps in wanted]
    assert len(remote._wire.maps) == 1
