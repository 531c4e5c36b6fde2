"""MDF channels: masters of time, texts, names that occur twice, frames of a bus, damaged files."""

from __future__ import annotations

import math
import struct
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from engine.recordings.recording import Recording
from tests.engine.recordings.test_recording_formats import read, told

MAP = "columns: {T_em: {to: T_em, unit: N*m}}\n"
STAMPS = np.array([0.01, 0.02, 0.03, 0.04])
TORQUES = np.array([2.0, -1.25, 40.0, 3.0])


def signal(samples: Any, name: str = "T_em", **fields: Any) -> Any:
    from asammdf import Signal

    stamps = fields.pop("stamps", STAMPS[: len(samples)])
    return Signal(np.asarray(samples), stamps, name=name, **fields)


def write(path: Path, *groups: Any, names: tuple[str, ...] = (), version: str = "4.10") -> Path:
    from asammdf import MDF

    with MDF(version=version) as mdf:
        for k, group in enumerate(groups):
            mdf.append([group], acq_name=names[k] if names else None)
        mdf.save(path, overwrite=True)
    return path


def values_of(recording: Recording, name: str = "T_em") -> tuple[float, ...]:
    return recording.channels[name].values


def notes_of(recording: Recording) -> list[str]:
    return [f"{item.subject}: {item.value} ({item.reason})" for item in recording.assumptions]


class TestNames:
    @pytest.mark.parametrize("name", ["T", "t", "Time", "timestamps"])
    @pytest.mark.parametrize("version", ["4.10", "3.30"])
    def test_a_channel_may_be_named_like_time(
        self, tmp_path: Path, name: str, version: str
    ) -> None:
        file = tmp_path / ("a.mf4" if version.startswith("4") else "a.mdf")
        path = write(file, signal(TORQUES, name), version=version)
        found = read(path, MAP.replace("{T_em:", f"{{{name}:"))
        assert values_of(found, name) == tuple(TORQUES)

    def test_the_master_is_no_channel(self, tmp_path: Path) -> None:
        path = write(tmp_path / "a.mf4", signal(TORQUES))
        assert "there is no channel `time`" in told(path, MAP.replace("{T_em:", "{time:"))

    def test_a_name_in_two_groups_is_chosen_by_group(self, tmp_path: Path) -> None:
        path = write(tmp_path / "a.mf4", signal(TORQUES), signal(TORQUES[:2] * 2))
        text = told(path, MAP)
        assert "error: there are two channels `T_em`" in text
        assert "names one of them: `group0.T_em`, `group1.T_em`" in text
        found = read(path, MAP.replace("{to", "{column: group1.T_em, to"))
        assert values_of(found) == (4.0, -2.5)

    def test_a_name_in_two_groups_is_chosen_by_their_names(self, tmp_path: Path) -> None:
        path = write(
            tmp_path / "a.mf4", signal(TORQUES), signal(TORQUES[:2]), names=("fast", "slow")
        )
        assert "`fast.T_em`, `slow.T_em`" in told(path, MAP)
        found = read(path, MAP.replace("{to", "{column: slow.T_em, to"))
        assert values_of(found) == (2.0, -1.25)

    def test_a_name_in_one_group_is_chosen_by_source(self, tmp_path: Path) -> None:
        from asammdf import Source

        sources = [Source(name, f"path {name}", "", 1, 0) for name in ("Inverter", "Dyno")]
        groups = [signal(TORQUES, source=sources[0]), signal(TORQUES * 2, source=sources[1])]
        path = write(tmp_path / "a.mf4", *groups)
        assert "`Inverter.T_em`, `Dyno.T_em`" in told(path, MAP)
        found = read(path, MAP.replace("{to", "{column: Dyno.T_em, to"))
        assert values_of(found) == tuple(TORQUES * 2)


class TestTime:
    def without_master(self, path: Path, sync: int = 0) -> Path:
        from asammdf import MDF
        from asammdf.blocks import v4_constants as constants

        with MDF(version="4.10") as mdf:
            mdf.append([signal(TORQUES)])
            channels: list[Any] = mdf.groups[0].channels
            for channel in channels:
                if channel.channel_type == constants.CHANNEL_TYPE_MASTER:
                    if not sync:
                        channel.channel_type = constants.CHANNEL_TYPE_VALUE
                        channel.name = "stamp"
                    channel.sync_type = sync
            mdf.save(path, overwrite=True)
        return path

    def test_a_group_without_time_is_refused(self, tmp_path: Path) -> None:
        text = told(self.without_master(tmp_path / "a.mf4"), MAP)
        assert "error: channel `T_em` has no time: its group has no master channel" in text
        assert "`time: {column: t, unit: s}` in the map" in text
        assert "the group has `stamp`" in text

    def test_the_map_names_the_time_of_such_a_group(self, tmp_path: Path) -> None:
        path = self.without_master(tmp_path / "a.mf4")
        found = read(path, "time: {column: stamp, unit: ms}\n" + MAP)
        assert [float(t) for t in found.channels["T_em"].times] == [1e-5, 2e-5, 3e-5, 4e-5]

    @pytest.mark.parametrize(
        ("sync", "word"), [(2, "an angle"), (3, "a distance"), (4, "an index")]
    )
    def test_another_master_than_time_is_refused(
        self, tmp_path: Path, sync: int, word: str
    ) -> None:
        text = told(self.without_master(tmp_path / "a.mf4", sync), MAP)
        assert f"the master channel of its group is {word}" in text


class TestTexts:
    def test_a_word_for_a_missing_value_gives_no_value(self, tmp_path: Path) -> None:
        words = {"val_0": 255, "text_0": "SNA", "default": b""}
        path = write(tmp_path / "a.mf4", signal(np.array([1, 255, 20], "u1"), conversion=words))
        found = read(path, MAP.replace("unit: N*m", "unit: N*m, blank: skip"))
        assert values_of(found) == (1.0, 20.0)
        assert notes_of(found) == [
            "channel `T_em`: 1 of 3 samples have no value (the file calls them `SNA`)"
        ]

    def test_a_word_among_numbers_is_no_number(self, tmp_path: Path) -> None:
        words = {"val_0": 255, "text_0": "standstill", "default": b""}
        path = write(tmp_path / "a.mf4", signal(np.array([1, 255, 20], "u1"), conversion=words))
        assert "a.mf4:2:1: error: `standstill` in channel `T_em`" in told(path, MAP)

    def test_an_enumeration_has_its_numbers_and_its_words(self, tmp_path: Path) -> None:
        words = {"val_0": 0, "text_0": "off", "val_1": 3, "text_1": "on", "default": b"?"}
        path = write(tmp_path / "a.mf4", signal(np.array([0, 3, 0], "u1"), conversion=words))
        found = read(path, MAP.replace("N*m", "1"))
        assert values_of(found) == (0.0, 3.0, 0.0)
        assert notes_of(found) == [
            "values of channel `T_em`: numbers "
            "(the file converts them to words: `off` is 0, `on` is 3)"
        ]

    def test_a_channel_of_texts_is_read_as_numbers(self, tmp_path: Path) -> None:
        texts = np.array([b"1.5", b"-2e1", b"SNA"])
        path = write(tmp_path / "a.mf4", signal(texts, encoding="utf-8"))
        found = read(path, MAP.replace("unit: N*m", "unit: N*m, blank: skip"))
        assert values_of(found) == (1.5, -20.0)
        path = write(tmp_path / "a.mf4", signal(np.array([b"on"]), encoding="utf-8"))
        assert "error: `on` in channel `T_em` is not a finite number" in told(path, MAP)


class TestBus:
    DBC = """\
VERSION ""
NS_ :
BS_:
BU_: ECU
BO_ 256 Motor: 4 ECU
 SG_ T_em : 0|16@1- (0.25,0) [0|0] "Nm" ECU
 SG_ n_em : 16|16@1- (1,0) [0|0] "rpm" ECU
"""

    def write_bus(self, path: Path, channels: tuple[int, ...] = (1,)) -> Path:
        import can
        from can.io.mf4 import MF4Writer

        (path.parent / "car.dbc").write_text(self.DBC, "utf-8")
        writer = MF4Writer(str(path))
        for k, torque in enumerate(TORQUES):
            for channel in channels:
                data = round(4 * torque).to_bytes(2, "little", signed=True) + bytes([100, 0])
                writer.on_message_received(
                    can.Message(
                        timestamp=1.7e9 + 0.01 * k + 0.001 * channel,
                        arbitration_id=256,
                        is_extended_id=False,
                        data=data,
                        channel=channel,
                    )
                )
        writer.stop()
        return path

    def test_frames_are_decoded_with_the_dbc_of_the_map(self, tmp_path: Path) -> None:
        path = self.write_bus(tmp_path / "a.mf4")
        text = "dbc: car.dbc\n" + MAP + "  # both\n"
        found = read(path, text)
        assert values_of(found) == tuple(TORQUES)
        times = np.array([float(t) for t in found.channels["T_em"].times])
        assert np.diff(times) == pytest.approx([0.01] * 3, abs=1e-6)
        named = read(path, text.replace("{to", "{column: Motor.T_em, to"))
        assert values_of(named) == tuple(TORQUES)

    def test_two_buses_are_not_merged(self, tmp_path: Path) -> None:
        path = self.write_bus(tmp_path / "a.mf4", (1, 2))
        assert "`CAN1.Motor.T_em`, `CAN2.Motor.T_em`" in told(path, "dbc: car.dbc\n" + MAP)

    def test_without_a_dbc_the_hint_names_it(self, tmp_path: Path) -> None:
        text = told(self.write_bus(tmp_path / "a.mf4"), MAP)
        assert "help: the file contains frames of a CAN bus: `dbc: vehicle.dbc` in the map" in text


class TestDamage:
    def test_a_damaged_file_leaves_no_copy(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        path = write(tmp_path / "a.mf4", signal(TORQUES))
        whole = path.read_bytes()
        folder = tmp_path / "temporary"
        folder.mkdir()
        monkeypatch.setattr(tempfile, "tempdir", str(folder))
        unfinished = b"UnFinMF " + whole[8:60] + bytes([255, 0]) + whole[62:]
        for data in (unfinished[: len(whole) // 2], unfinished[:200], unfinished[:400]):
            path.write_bytes(data)
            assert "error: the recording cannot be understood" in told(path, MAP)
            assert not [one for one in folder.rglob("*") if one.is_file() and one.stat().st_size]

    def test_a_value_that_is_not_a_number_is_missing(self, tmp_path: Path) -> None:
        path = write(tmp_path / "a.mf4", signal([1.0, math.nan]))
        assert "a.mf4:2:1: error: channel `T_em` has no value here: `nan`" in told(path, MAP)
        found = read(path, MAP.replace("unit: N*m", "unit: N*m, blank: skip"))
        assert values_of(found) == (1.0,)
        path = write(tmp_path / "a.mf4", signal([1.0, math.inf]))
        assert "a.mf4:2:1: error: `inf` in channel `T_em`" in told(path, MAP)


BYTE_OFFSET, BIT_COUNT, INVALIDATION_BIT = 4, 8, 16
"""Places of the fields of a channel behind the links of its block."""


def damage(path: Path, kind: int, field: int, number: int) -> Path:
    """Write a number into a field of the channels of a type (0 values, 1 texts, 2 master)."""
    data = bytearray(path.read_bytes())
    start = data.find(b"##CN")
    while start >= 0:
        (links,) = struct.unpack_from("<Q", data, start + 16)
        fields = start + 24 + 8 * links
        if data[fields] == kind:
            struct.pack_into("<I", data, fields + field, number)
        start = data.find(b"##CN", start + 4)
    path.write_bytes(data)
    return path


class TestPlacesOutsideOfTheData:
    """asammdf reads the memory behind the data without a check, or ends the process."""

    @pytest.mark.parametrize("kind", [0, 2])
    @pytest.mark.parametrize(
        ("field", "number"),
        [
            (BYTE_OFFSET, 136), (BYTE_OFFSET, 9), (BYTE_OFFSET, 1 << 24), (BYTE_OFFSET, 0xFFFFFFFF),
            (BIT_COUNT, 640), (BIT_COUNT, 0xFFFFFFF8),
        ],
    )  # fmt: skip
    def test_a_channel_outside_of_its_records_is_refused(
        self, tmp_path: Path, kind: int, field: int, number: int
    ) -> None:
        path = damage(write(tmp_path / "a.mf4", signal(TORQUES)), kind, field, number)
        text = told(path, MAP)
        assert "error: the recording cannot be understood" in text
        if field == BYTE_OFFSET:
            assert "of records of 16 bytes" in text

    def test_another_channel_of_the_file_is_read(self, tmp_path: Path) -> None:
        path = tmp_path / "a.mf4"
        note = signal([b"a", b"b"], "note", encoding="utf-8")
        damage(write(path, signal(TORQUES), note), 1, BYTE_OFFSET, 4096)
        assert values_of(read(path, MAP)) == tuple(TORQUES)

    def test_a_mark_of_invalid_values_outside_of_its_bits_is_refused(self, tmp_path: Path) -> None:
        flags = np.array([False, True, False, False])
        path = write(tmp_path / "a.mf4", signal(TORQUES, invalidation_bits=flags))
        assert len(values_of(read(path, MAP.replace("N*m}", "N*m, blank: skip}")))) == 3
        damage(path, 0, INVALIDATION_BIT, 1 << 20)
        assert "has bit 1048576 of 8 that mark invalid values" in told(path, MAP)

    @pytest.mark.parametrize("length", [0x80000000, 0xFFFFFFFF, 100])
    def test_a_text_outside_of_its_data_is_refused(self, tmp_path: Path, length: int) -> None:
        path = write(tmp_path / "a.mf4", signal([b"off", b"on", b"off", b"on"], encoding="utf-8"))
        data = path.read_bytes()
        assert data.count(b"\x03\x00\x00\x00off") == 2
        path.write_bytes(data.replace(b"\x03\x00\x00\x00off", struct.pack("<I", length) + b"off"))
        assert "the value 1 of channel `T_em` lies outside of the file" in told(path, MAP)
